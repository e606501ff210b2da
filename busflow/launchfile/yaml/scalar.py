"""Reads plain YAML scalars and writes values, by the core schema of YAML 1.2; the command line uses the same."""

from __future__ import annotations

import json
import math
import re
import shlex
import sys
from collections.abc import Mapping
from typing import Any, cast

from busflow.launchfile.yaml.value import Scalar
from busflow.text import printable

_NULL = re.compile(r"~|null|Null|NULL|")
_BOOL = re.compile(r"true|True|TRUE|false|False|FALSE")
_INT = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_INFINITY_OR_NAN = re.compile(r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")
_PLAIN_TEXT = re.compile(r"(?!\.[0-9_])[A-Za-z_/~.][A-Za-z0-9_/~.-]*")
"""Texts without a meaning in YAML; some readers of YAML 1.1 take `._1` for a number."""
_OTHERWISE = frozenset({"y", "n", "yes", "no", "on", "off", "nan", "inf", "infinity", ".nan", ".inf"})
"""Texts that readers of YAML 1.1 take for true and false, and rcl, which reads numbers as C does, for numbers."""
_BOOLS = {
    **dict.fromkeys(("true", "yes", "on", "y"), True),
    **dict.fromkeys(("false", "no", "off", "n"), False),
}
_BASES = {"0o": 8, "0x": 16}
_MOST_DIGITS = 64
"""More digits than 64 bits need in any base; Python itself refuses to read some thousands."""


def plain_scalar(text: str) -> Scalar:
    """Return the value of an unquoted scalar.

    >>> [plain_scalar(text) for text in ("yes", "12:30", "010", "1e3", "0x1f", "~", "True")]
    ['yes', '12:30', 10, 1000.0, 31, None, True]

    Raises:
        ValueError: The scalar is a number that 64 bits cannot hold.
    """
    if _NULL.fullmatch(text):
        return None
    if _BOOL.fullmatch(text):
        return text[0] in "tT"
    if _INT.fullmatch(text):
        digits = text.lstrip("+-0") if text[:2] not in _BASES else text[2:].lstrip("0")
        number = int(text, _BASES.get(text[:2], 10)) if len(digits) <= _MOST_DIGITS and len(text) < 4000 else None
        if number is None or not -(1 << 63) <= number < 1 << 63:
            raise ValueError(f"the integer {printable(text, limit=40)} does not fit in 64 bits")
        return number
    if _FLOAT.fullmatch(text):
        value = float(text)
        if math.isinf(value):
            raise ValueError(f"the number {printable(text, limit=40)} is beyond what a float can hold")
        return value
    return float(text.replace(".", "")) if _INFINITY_OR_NAN.fullmatch(text) else text


_TAG = "tag:yaml.org,2002:"


def is_known_tag(tag: str) -> bool:
    """Return whether a tag states a type of parameters: `!!str`, `!!int`, `!!float` or `!!bool`."""
    return tag.startswith(_TAG) and tag.removeprefix(_TAG) in {"str", "int", "float", "bool"}


def event_scalar(event: Any) -> Scalar:
    """Return the value of a scalar in PyYAML's events, whose tag may state its type.

    Raises:
        ValueError: It is no value of that type, or a number that 64 bits cannot hold.
    """
    text: str = event.value
    if event.tag is None:
        return plain_scalar(text) if event.implicit[0] and not event.style else text
    kind = event.tag.removeprefix(_TAG)
    if kind == "str":
        return text
    if kind == "bool" and (word := _BOOLS.get(text.lower())) is not None:
        return word
    value = plain_scalar(text)
    if kind == "float" and isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    if kind == "int" and isinstance(value, int) and not isinstance(value, bool):
        return value
    raise ValueError(f"!!{kind} takes no {printable(text, limit=40)!r}")


def scalar_or_text(text: str) -> Scalar:
    """Return the value of an unquoted scalar, or the text itself if it is a number that 64 bits cannot hold."""
    try:
        return plain_scalar(text)
    except ValueError:
        return text


def written(value: Scalar) -> str:
    """Write a scalar for a launch file: on one line, valid outside and inside brackets.

    >>> [written(value) for value in ("lab/imu", "yes", "${x}", 0.5, None, float("inf"))]
    ['lab/imu', '"yes"', '"$${x}"', '0.5', 'null', '.inf']
    """
    match value:
        case None:
            return "null"
        case bool():
            return "true" if value else "false"
        case float() if not math.isfinite(value):
            return ".nan" if math.isnan(value) else f"{'-' * (value < 0)}.inf"
        case str():
            return _text(value)
        case _:
            return repr(value)


def flow(value: Any) -> str:
    """Write a value for a launch file on one line.

    >>> flow({"qos": ["left arm", 0.5, {}]})
    '{qos: ["left arm", 0.5, {}]}'
    """
    match value:
        case Mapping():
            members = cast("Mapping[str, object]", value).items()
            return "{" + ", ".join(f"{written(key)}: {flow(each)}" for key, each in members) + "}"
        case list():
            return "[" + ", ".join(map(flow, cast("list[object]", value))) + "]"
        case _:
            return written(cast("Scalar", value))


def flow_words(command: str) -> str:
    """Return a command as a list of its words, on one line, split as a shell would.

    >>> flow_words("ros2 run cam 'node one'")
    '[ros2, run, cam, "node one"]'
    """
    try:
        words = shlex.split(command)
    except ValueError:  # a quote that does not end
        words = command.split()
    return f"[{', '.join(map(flow, words))}]"


def _text(text: str) -> str:
    """Write a text: plain if every reader takes it for text; else in double quotes, with `${` escaped."""
    if _PLAIN_TEXT.fullmatch(text) and text.lower() not in _OTHERWISE and scalar_or_text(text) == text:
        return text
    # `printable` writes control characters as escapes, and YAML has the same ones: \x9b, \u202e, \U000e0001.
    return printable(json.dumps(text.replace("${", "$${"), ensure_ascii=False), limit=sys.maxsize)
