"""What a plain YAML scalar means: the core schema of YAML 1.2, which is also that of the command line."""

from __future__ import annotations

import math
import re

from busflow.launchfile.value import Scalar
from busflow.text import printable

_NULL = re.compile(r"~|null|Null|NULL|")
_BOOL = re.compile(r"true|True|TRUE|false|False|FALSE")
_INT = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_INFINITY_OR_NAN = re.compile(r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")
_BASES = {"0o": 8, "0x": 16}
_MOST_DIGITS = 64
"""More than 64 bits need in any base; Python itself refuses to read some thousands."""


def plain_scalar(text: str) -> Scalar:
    """The value of an unquoted scalar.

    >>> [plain_scalar(text) for text in ("yes", "12:30", "010", "1e3", "0x1f", "~", "True")]
    ['yes', '12:30', 10, 1000.0, 31, None, True]

    Raises:
        ValueError: It is a number that 64 bits cannot hold.
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
