"""Lines of a definition file: each split into the words of a declaration, with columns, and its comment."""

from __future__ import annotations

import re
from dataclasses import dataclass

from busflow.interfaces.encoding.stated_values import closing_quote

_WORDS = re.compile(r"(?P<type>[^\s#]+)(\s+(?P<name>[^\s=#]+))?\s*(?P<equals>=)?\s*")
_SEPARATOR = re.compile(r"-+\s*")


@dataclass(frozen=True, slots=True)
class Word:
    """A part of a line and its column, counted from 0."""

    text: str
    column: int


@dataclass(frozen=True, slots=True)
class Line:
    """A line in its words; one that declares nothing has none of them."""

    number: int
    """Counted from 1."""
    text: str
    type: Word | None = None
    name: Word | None = None
    equals: int | None = None
    """The column of the `=` of a constant."""
    value: Word | None = None
    comment: str | None = None
    """What follows the `#`, without it."""

    @property
    def is_separator(self) -> bool:
        """True for the line between the parts of a service or an action, or one that was meant to be."""
        return _SEPARATOR.fullmatch(self.text) is not None

    @property
    def is_indented(self) -> bool:
        """True for a line that begins with a space or tab."""
        return self.text[:1].isspace()


def split(number: int, text: str) -> Line:
    """Split a line of a definition into its words.

    >>> line = split(1, "uint8 RED=1  # a colour")
    >>> line.type.text, line.name.text, line.value.text, line.comment
    ('uint8', 'RED', '1', ' a colour')
    """
    start = len(text) - len(text.lstrip())
    found = _WORDS.match(text, start)
    if found is None:
        return Line(number, text, comment=_comment(text[start:]))
    end = found.end() + _length_of_value(text[found.end() :])
    value = text[found.end() : end].rstrip()
    name = found["name"]
    return Line(
        number,
        text,
        Word(found["type"], found.start("type")),
        Word(name, found.start("name")) if name else None,
        found.start("equals") if found["equals"] else None,
        Word(value, found.end()) if value else None,
        _comment(text[end:]),
    )


def _comment(text: str) -> str | None:
    return text.lstrip("#").rstrip() if text.startswith("#") else None


def _length_of_value(text: str) -> int:
    """Return the length of the value at the start of `text`: a `#` within its quotes begins no comment."""
    if text[:1] in ("'", '"') and text:
        end = closing_quote(text)
        if end > 0:
            return _until_comment(text, end)
    if text.startswith("["):
        at = 1
        while at < len(text) and text[at] not in "]#":
            end = closing_quote(text[at:]) if text[at] in "'\"" else 0
            at += 1 + max(end, 0)
        return _until_comment(text, at)
    return _until_comment(text, 0)


def _until_comment(text: str, start: int) -> int:
    found = text.find("#", start)
    return len(text) if found < 0 else found
