"""Stated values: the defaults and constants that definition files write as text, read by ROS 2's rules."""

from __future__ import annotations

import re
from struct import error as StructError  # noqa: N812 - it is an exception, whatever the standard library calls it
from struct import pack
from typing import TypeAlias

from busflow.interfaces.encoding.description import PRIMITIVES, Count, Field
from busflow.text import printable

Scalar: TypeAlias = bool | int | float | str

_TRUTH = {"true": True, "1": True, "false": False, "0": False}
_INTEGER = re.compile(r"[+-]?(0[xX][0-9a-fA-F]+|0[oO][0-7]+|0[bB][01]+|[0-9]+)")
_FLOAT = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?|[+-]?(inf|nan)", re.IGNORECASE)
_QUOTES = "\"'"
_ITEM = re.compile(r"""\s*("(?:\\"|[^"])*"|'(?:\\'|[^'])*'|[^,]*?)\s*(?:,|$)""")
_DIGITS = 400
"""The most characters of a number; Python refuses to read an integer of more than 4,300."""


def value_of(field: Field) -> Scalar | tuple[Scalar, ...]:
    """Return the default of a field, read from its text.

    >>> value_of(Field("gains", "float32", count=Count.FIXED, size=2, default="[1, 0.5]"))
    (1.0, 0.5)

    Raises:
        ValueError: It is not a value of the field's type; the text says why.
    """
    if field.count is Count.ONE:
        return scalar(field.base, field.default, field.string_bound)
    items = _items(field.default)
    if field.count is Count.FIXED and len(items) != field.size:
        raise ValueError(f"exactly {field.size} values are needed, not {len(items)}")
    if field.count is Count.BOUNDED and len(items) > field.size:
        raise ValueError(f"at most {field.size} values are allowed, not {len(items)}")
    return tuple(scalar(field.base, item, field.string_bound) for item in items)


def scalar(base: str, text: str, bound: int = 0) -> Scalar:
    """Return one value of a primitive type; `bound` limits the characters of a text.

    >>> scalar("uint8", "0x10"), scalar("bool", "true"), scalar("string", "'ahoy'")
    (16, True, 'ahoy')

    Raises:
        ValueError: The text is not such a value.
    """
    shown = printable(text, limit=40)
    if base in ("string", "wstring"):
        return _text(text, bound)
    if base == "bool":
        if text.lower() not in _TRUTH:
            raise ValueError(f"{shown} is not a bool; write true or false")
        return _TRUTH[text.lower()]
    is_float = base.startswith("float")
    if len(text) > _DIGITS or not (_FLOAT if is_float else _INTEGER).fullmatch(text):
        raise ValueError(f"{shown} is not a valid {base}")
    value = float(text) if is_float else _integer(text)
    try:
        pack(f"<{PRIMITIVES[base].code}", value)
    except (StructError, OverflowError):
        raise ValueError(f"{shown} is out of the range of {base}{_range(base)}") from None
    return value


def closing_quote(text: str) -> int:
    """Return the index of the quote that ends the quoted text at the start of `text`; -1 if none does."""
    at = text.find(text[0], 1)
    while at > 0 and text[at - 1] == "\\":
        at = text.find(text[0], at + 1)
    return at


def _integer(text: str) -> int:
    try:
        return int(text)  # `010` is ten, as ROS 2 reads it
    except ValueError:
        return int(text, 0)


def _range(base: str) -> str:
    bits = 8 * PRIMITIVES[base].size
    if base.startswith("float"):
        return ""
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if base.startswith("int") else (0, (1 << bits) - 1)
    return f", {low} to {high}"


def _text(text: str, bound: int) -> str:
    if text[:1] in _QUOTES and text:
        quote = text[0]
        if len(text) < 2 or text[-1] != quote:
            raise ValueError(f"the quote at {printable(text, limit=40)} is not closed")
        if 0 < closing_quote(text) < len(text) - 1:
            raise ValueError(f"a quote inside the text ends it; write \\{quote} there")
        text = text[1:-1].replace(f"\\{quote}", quote)
    if bound and len(text) > bound:
        raise ValueError(f"{len(text)} characters where {bound} are allowed")
    return text


def _items(text: str) -> list[str]:
    if len(text) < 2 or text[0] != "[" or text[-1] != "]":
        raise ValueError(f"the values of an array stand in brackets: [{printable(text, limit=40)}]")
    inner, items, at = text[1:-1].strip(), list[str](), 0
    while at < len(inner):
        found = _ITEM.match(inner, at)
        if found is None or not found[1]:
            raise ValueError("a value is missing between commas, or a quote is not closed")
        items.append(found[1])
        at = found.end()
    if inner.endswith(","):
        raise ValueError("a value is missing after the last comma")
    return items
