"""Patterns of names: `/imu/*` matches the topics directly below `/imu`, `/arm/**` those at any depth below `/arm`."""

from __future__ import annotations

import re
from collections.abc import Sequence

from busflow.bus.names import is_hidden
from busflow.errors import InvalidName
from busflow.text import printable

_PATTERN = re.compile(r"/?(?:[A-Za-z_*][A-Za-z0-9_*]*)(?:/[A-Za-z_*][A-Za-z0-9_*]*)*", re.ASCII)


class Selection:
    """A set of topics: those that a pattern of `topics` matches (all without patterns), minus the excluded ones.

    In a pattern `*` stands for any part of a name up to the next slash, `**` for any number of parts. A hidden name (a
    part of it begins with `_`) is matched only by a pattern that is hidden itself.

    >>> wanted = Selection(["/imu/*", "/arm/**"], exclude=["/arm/debug"])
    >>> [name for name in ("/imu/data", "/imu/left/data", "/arm/left/state", "/arm/debug") if wanted.includes(name)]
    ['/imu/data', '/arm/left/state']
    """

    def __init__(
        self,
        topics: Sequence[str] = (),
        exclude: Sequence[str] = (),
        *,
        regexes: Sequence[str] = (),
        exclude_regexes: Sequence[str] = (),
        foreign: bool = False,
    ) -> None:
        """Create a selection; a pattern needs no leading slash, a regular expression matches anywhere in a name.

        With `foreign` a pattern may have any characters, as the names that other programs have recorded.

        Raises:
            InvalidName: one of them cannot match any name, or is not a regular expression.
        """
        self._wanted = {pattern: _compiled(pattern, foreign=foreign).fullmatch for pattern in topics}
        self._wanted |= {regex: _expression(regex).search for regex in regexes}
        self._unwanted = [_compiled(pattern, foreign=foreign).fullmatch for pattern in exclude]
        self._unwanted += [_expression(regex).search for regex in exclude_regexes]
        self._unmatched = dict.fromkeys(self._wanted)

    def includes(self, *names: str) -> bool:
        """Return whether the selection includes a topic known by these names."""
        if any(matches(name) for matches in self._unwanted for name in names):
            return False
        if not self._wanted:
            return not is_hidden(names[0])
        found = [
            stated
            for stated, matches in self._wanted.items()
            if any(matches(name) and (is_hidden(stated) or not is_hidden(name)) for name in names)
        ]
        for stated in found:
            self._unmatched.pop(stated, None)
        return bool(found)

    @property
    def unmatched(self) -> tuple[str, ...]:
        """The patterns and regular expressions that have matched nothing so far."""
        return tuple(self._unmatched)


def check_pattern(pattern: str) -> str:
    """Return the pattern itself.

    Raises:
        InvalidName: it cannot match any name.
    """
    if not _PATTERN.fullmatch(pattern) or "***" in pattern:
        raise InvalidName(
            f"{printable(pattern, limit=200)!r} is not a pattern of topics: a name in which * stands for a part, ** "
            "for several: /imu/*, /arm/**"
        )
    return pattern


def _expression(regex: str) -> re.Pattern[str]:
    try:
        return re.compile(regex)
    except (re.error, OverflowError, RecursionError) as error:
        shown = printable(regex, limit=200)
        raise InvalidName(f"invalid regular expression {shown!r}: {error}; example: '/(left|right)/image.*'") from None


def _compiled(pattern: str, *, foreign: bool) -> re.Pattern[str]:
    """Return the pattern as an expression that needs no more than the square of a name's length.

    The first place at which the text after a wildcard stands is as good as a later one, and is kept (`(?>…)`), unless
    it is the last: that must reach the end of the name.
    """
    first, *others = f"/{(pattern if foreign else check_pattern(pattern)).strip('/')}".split("**")
    itself = f"{re.escape(pattern)}|" if foreign else ""  # e.g. a name that ends with a slash
    if not others:
        return re.compile(itself + _within(first, last=True))
    middle = (f"(?>.*?{_within(each)})" for each in others[:-1])
    return re.compile(f"{itself}{_within(first)}{''.join(middle)}.*{_within(others[-1], last=True)}")


def _within(pattern: str, *, last: bool = False) -> str:
    """Return the expression for a part of a pattern without `**`, which is tried from each place of a name once."""
    first, *others = map(re.escape, pattern.split("*"))
    final = f"[^/]*{others.pop()}" if others and last else ""
    return first + "".join(f"(?>[^/]*?{each})" for each in others) + final
