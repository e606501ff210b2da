"""How text is shown: control characters from outside escaped, counts as people say them, the nearest word suggested."""

import difflib
import re
from collections.abc import Iterable, Sequence
from itertools import islice
from typing import cast

# C0 and C1 controls, DEL, line and paragraph separators, and the bidirectional overrides that can make a
# terminal show something other than what is there; lone surrogates cannot be encoded at all.
UNSAFE = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]")

_SEPARATOR = re.compile("[/.]")
"""What stands between the parts of a name: of a topic, a type, a parameter."""

_COMPARED = 500
"""Candidates that `nearest` compares: a hostile file may name ten thousand, at 30 µs each."""


_SHOWN = 200
"""Things of a sequence that `plain` shows: more than a line of the log has room for, which says that there are more."""


def printable(text: object, *, limit: int = 4096) -> str:
    r"""`str(text)` on one line, safe for a terminal: what would steer it is shown as an escape.

    >>> printable("ok\x1b[31mred")
    'ok\\x1b[31mred'
    >>> printable("x" * 10, limit=5)
    'xxxx…'
    """
    shown = str(text)
    if len(shown) > limit:
        shown = shown[: limit - 1] + "…"
    return UNSAFE.sub(_escape, shown)


def plain(value: object, *, depth: int = 4) -> str:
    """A value as people read it: what is within sequences and mappings without the quotes of code.

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
    """So many of something, as people say it; `several` is `one` with an s unless told.

    >>> counted(1, "message"), counted(0, "message"), counted(2, "message was", "messages were")
    ('1 message', '0 messages', '2 messages were')
    """
    return f"{count} {one if count == 1 else several or f'{one}s'}"


def nearest(word: str, words: Iterable[str]) -> str | None:
    """The word that `word` most likely meant, or None when nothing is close.

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
    if len(same) == 1:  # two would be a guess: who leaves out where a name is can mean either
        return same[0]
    found = difflib.get_close_matches(word, candidates[:_COMPARED], 1, cutoff=0.6)
    return found[0] if found else None


def did_you_mean(word: str, words: Iterable[str], *, show: int = 8) -> str:
    """The advice that ends an error about an unknown name: the nearest one, else what there is.

    >>> did_you_mean("imuu", ["imu", "joints"])
    "did you mean 'imu'?"
    >>> did_you_mean("zzz", ["imu", "joints"])
    'known: imu, joints'
    >>> did_you_mean("zzz", [])
    'there are none'
    """
    known = sorted(set(words))
    guess = nearest(word, known)
    if guess is not None:
        return f"did you mean {printable(guess)!r}?"
    if not known:
        return "there are none"
    more = f" … and {len(known) - show} more" if len(known) > show else ""
    return "known: " + ", ".join(printable(name) for name in known[:show]) + more


def _escape(match: re.Match[str]) -> str:
    return match.group().encode("unicode_escape").decode("ascii")
