"""Text for people: escaped control characters, counts with their noun, suggestions for misspelt words."""

import re
from collections.abc import Iterable, Sequence
from itertools import islice
from typing import cast

# C0 and C1 controls, DEL, line and paragraph separators, and the bidirectional overrides that can make a
# terminal show another text than the real one; lone surrogates cannot be encoded at all.
UNSAFE = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]")

_SEPARATOR = re.compile("[/.]")
"""The separators of the parts of a topic, type or parameter name."""

_ALIKE = 0.6
"""The ratio of difflib from which two words are alike."""
_TRIED = 10
"""Most similar candidates that `nearest` looks at more closely."""
_COMPARED = 500
"""Candidates, and characters of the word, that `nearest` compares: a hostile file has ten thousand, or a megabyte."""


_SHOWN = 200
"""Items of a sequence that `plain` shows, and characters that `quoted` does: more than fit on a line of the log."""


def printable(text: object, *, limit: int = 4096) -> str:
    r"""Return `str(text)` on one line, with control characters escaped for a terminal.

    >>> printable("ok\x1b[31mred")
    'ok\\x1b[31mred'
    >>> printable("x" * 10, limit=5)
    'xxxx…'
    """
    shown = str(text)
    if len(shown) > limit:
        shown = shown[: limit - 1] + "…"
    return UNSAFE.sub(_escape, shown)


def quoted(name: object) -> str:
    """Return a name in quotes, cut to 200 characters: one from a hostile file may have millions.

    >>> quoted("imu"), len(quoted("x" * 1_000_000))
    ("'imu'", 202)
    """
    return repr(printable(name, limit=_SHOWN))


def plain(value: object, *, depth: int = 4) -> str:
    """Return a value as text for people: items of sequences and mappings without quotes.

    >>> plain(["left/arm", 0.5]), plain({"gains": (1, None)}), plain([])
    ('[left/arm, 0.5]', '{gains: [1, None]}', '[]')
    """
    if depth and isinstance(value, list | tuple):
        return f"[{', '.join(plain(each, depth=depth - 1) for each in cast('Sequence[object]', value)[:_SHOWN])}]"
    if depth and isinstance(value, dict):
        pairs = islice(cast("dict[object, object]", value).items(), _SHOWN)
        return f"{{{', '.join(f'{name}: {plain(each, depth=depth - 1)}' for name, each in pairs)}}}"
    return str(value)


def counted(count: int, one: str, several: str = "") -> str:
    """Return a count with its noun; `several` is by default `one` with an s.

    >>> counted(1, "message"), counted(0, "message"), counted(2, "message was", "messages were")
    ('1 message', '0 messages', '2 messages were')
    """
    return f"{count} {one if count == 1 else several or f'{one}s'}"


def nearest(word: str, words: Iterable[str]) -> str | None:
    """Return the word most similar to `word`, or None if none is close.

    >>> nearest("rate_hzz", ["rate_hz", "noise"])
    'rate_hz'
    >>> nearest("Imu", ["sensor_msgs/msg/Imu", "sensor_msgs/msg/Image"])
    'sensor_msgs/msg/Imu'
    """
    candidates = sorted(set(words))
    for candidate in candidates:
        if candidate.casefold() == word.casefold():
            return candidate
    last = word.lstrip("/").casefold()
    same = [each for each in candidates if _SEPARATOR.split(each)[-1].casefold() == last]
    if len(same) == 1:  # with two, a bare name may mean either
        return same[0]
    import difflib  # here, as it is needed for errors alone

    found = difflib.get_close_matches(word[:_COMPARED], candidates[:_COMPARED], _TRIED, cutoff=_ALIKE)
    return next((each for each in found if _alike(_SEPARATOR.split(word), _SEPARATOR.split(each))), None)


def _alike(one: list[str], two: list[str]) -> bool:
    """Return whether two names are alike in the parts that differ: a common namespace alone makes them no more so."""
    while one and two and one[0] == two[0]:
        one, two = one[1:], two[1:]
    while one and two and one[-1] == two[-1]:
        one, two = one[:-1], two[:-1]
    import difflib

    return not (one and two) or difflib.SequenceMatcher(None, "/".join(one), "/".join(two)).ratio() >= _ALIKE


def did_you_mean(word: str, words: Iterable[str], *, none: str = "there are none", show: int = 8) -> str:
    """Return the advice that ends an error about an unknown name: the nearest one, else the known ones.

    Where no name is known, the advice is `none`: as the fix of a problem, say there what to do.

    >>> did_you_mean("imuu", ["imu", "joints"])
    "did you mean 'imu'?"
    >>> did_you_mean("zzz", ["imu", "joints"])
    'known: imu, joints'
    >>> did_you_mean("zzz", [], none="leave it out")
    'leave it out'
    """
    known = sorted(set(words))
    guess = nearest(word, known)
    if guess is not None:
        return f"did you mean {printable(guess)!r}?"
    if not known:
        return none
    more = f" … and {len(known) - show} more" if len(known) > show else ""
    return "known: " + ", ".join(printable(name) for name in known[:show]) + more


def _escape(match: re.Match[str]) -> str:
    return match.group().encode("unicode_escape").decode("ascii")
