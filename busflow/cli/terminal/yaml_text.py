r"""YAML text as `ros2 topic echo` prints it, from plain values: mappings, sequences, text and numbers.

Text that YAML 1.1 or 1.2 would read as something else is quoted, as PyYAML quotes it. Control characters and line
breaks are escapes in double quotes. PyYAML is not imported: that takes as long as all of the rest.

>>> print("\n".join(yaml_lines({"header": {"frame_id": "imu"}, "data": [1, 2.0]})))
header:
  frame_id: imu
data:
- 1
- 2.0
>>> list(yaml_lines({"data": [1, float("nan")], "text": "\x1b[31m"}, flow=True))
['data: [1, .nan]', 'text: "\\x1b[31m"']
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from math import isfinite, isnan
from typing import Any, cast

from busflow.text import UNSAFE

_WORD = re.compile(r"/?[A-Za-z][A-Za-z0-9_/.]*")
"""Text that needs no quotes, unless it is one of the words below."""
_OTHERWISE = re.compile(
    r"""  # text that YAML 1.1 or 1.2 reads as another type
    [yY]es|YES|[nN]o|NO|[tT]rue|TRUE|[fF]alse|FALSE|[oO]n|ON|[oO]ff|OFF|~|[nN]ull|NULL|<<|=
    |[-+]?0b[01_]+|[-+]?0o?[0-7_]+|[-+]?0x[0-9a-fA-F_]+|[-+]?[0-9][0-9_]*(:[0-5]?[0-9])*(\.[0-9_]*)?([eE][-+]?[0-9]+)?
    |[-+]?\.[0-9][0-9_]*([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)
    |[0-9]{4}-[0-9]{1,2}-[0-9]{1,2}([Tt \t].*)?
    """,
    re.VERBOSE,
)
_MARKS = re.compile(
    r"""  # text with a meaning in YAML outside of quotes
    [\x23,\[\]{}&*!|>'"%@`]|---|\.\.\.|[-?:](\s|$)|\s  # at the beginning
    |.*(:(\s|$)|\s\x23)|.*\s$  # further on
    """,
    re.VERBOSE | re.DOTALL,
)
_MARKS_IN_FLOW = re.compile(r"[?:]|.*[,?\[\]{}:]", re.DOTALL)
_ESCAPED = re.compile(f'["\\\\]|\N{ZERO WIDTH NO-BREAK SPACE}|[\ufffe\uffff]|{UNSAFE.pattern}')
_SHORT = {"\n": r"\n", "\t": r"\t", "\r": r"\r", '"': r"\"", "\\": r"\\"}


def yaml_lines(value: Any, *, flow: bool = False) -> Iterator[str]:
    """Return the lines of a value; `flow` writes each sequence on one line."""
    if _holds(value, Mapping):
        return _mapping(cast("Mapping[str, Any]", value), "", flow=flow)
    if _holds(value, Sequence) and not flow:
        return _sequence(cast("Sequence[Any]", value), "", flow=flow)
    return iter([_flow(value)])


def _mapping(value: Mapping[str, Any], indent: str, *, flow: bool) -> Iterator[str]:
    for key, each in value.items():
        start = f"{indent}{_key(key)}:"
        if _holds(each, Mapping):
            yield start
            yield from _mapping(each, f"{indent}  ", flow=flow)
        elif not flow and _holds(each, Sequence):
            yield start
            yield from _sequence(each, indent, flow=flow)
        else:
            yield f"{start} {_flow(each)}"


def _sequence(value: Sequence[Any], indent: str, *, flow: bool) -> Iterator[str]:
    deeper = f"{indent}  "
    for each in value:
        if _holds(each, Mapping):
            lines = _mapping(each, deeper, flow=flow)
        elif _holds(each, Sequence):
            lines = _sequence(each, deeper, flow=flow)
        else:
            yield f"{indent}- {_flow(each)}"
            continue
        yield f"{indent}- {next(lines)[len(deeper) :]}"
        yield from lines


def _flow(value: Any, *, within: bool = False) -> str:
    """Return a value on one line; `within` is True inside a collection in flow style."""
    if isinstance(value, str):
        return yaml_text(value, flow=within)
    if isinstance(value, float):
        return _float(value)
    if isinstance(value, Mapping):
        members = cast("Mapping[str, Any]", value).items()
        shown = (f"{yaml_text(str(key), flow=True)}: {_flow(each, within=True)}" for key, each in members)
        return "{" + ", ".join(shown) + "}"
    if isinstance(value, Sequence):
        return "[" + ", ".join(_flow(each, within=True) for each in cast("Sequence[Any]", value)) + "]"
    return "null" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def _float(value: float) -> str:
    if not isfinite(value):
        return ".nan" if isnan(value) else ".inf" if value > 0 else "-.inf"
    text = repr(value)
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


def yaml_text(text: str, *, flow: bool = False) -> str:
    """Return text as a scalar, quoted if needed; with `flow` also if a comma or bracket would end it."""
    if _WORD.fullmatch(text) and not _OTHERWISE.fullmatch(text):
        return text
    if not text:
        return "''"
    if _ESCAPED.search(text.replace('"', "").replace("\\", "")):
        return '"' + _ESCAPED.sub(_escape, text) + '"'
    if _MARKS.match(text) or _OTHERWISE.fullmatch(text) or (flow and _MARKS_IN_FLOW.match(text)):
        return "'" + text.replace("'", "''") + "'"
    return text


@lru_cache(4096)
def _key(key: str) -> str:
    """Return a key as YAML text; cached, as messages repeat their keys."""
    return yaml_text(key)


def _escape(match: re.Match[str]) -> str:
    char = match.group()
    number = ord(char)
    return _SHORT.get(char) or (f"\\x{number:02x}" if number < 0x100 else f"\\u{number:04x}")


def _holds(value: Any, kind: type[Any]) -> bool:
    """Return whether a value is a collection of this kind with items; an empty one is written in line."""
    return isinstance(value, kind) and not isinstance(value, str) and bool(value)
