"""Declarations: the fields and constants of one part, each checked as its line is read."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

from busflow.definitions.comments import dedented, joined
from busflow.definitions.definition import DefinedConstant, DefinedField
from busflow.definitions.field_type import UnreadableType, read_type
from busflow.definitions.lines import Line, Word
from busflow.errors import Place
from busflow.interfaces.encoding.description import Count, Field
from busflow.interfaces.encoding.stated_values import scalar, value_of
from busflow.text import quoted

Value = TypeVar("Value")

MAX_DECLARATIONS = 2_000
"""The most fields and constants of one part."""

_FIELD = re.compile(r"[a-z](_?[a-z0-9])*")
_CONSTANT = re.compile(r"[A-Z](_?[A-Z0-9])*")
_ANY = re.compile(r"\w+", re.ASCII)


class ReportProblem(Protocol):
    """A function that records a problem with a word of a line."""

    def __call__(self, code: str, message: str, line: Line, word: Word, fix: str | None = None) -> None:
        """Record the problem."""
        ...


@dataclass(frozen=True, slots=True)
class _Declared:
    """A declaration and its comment: the lines above it, and those behind it, of which more may follow."""

    made: Callable[[str], DefinedField | DefinedConstant]
    above: str
    behind: list[str]

    def finish(self) -> DefinedField | DefinedConstant:
        return self.made(joined(self.above, dedented(self.behind)))


class Declarations:
    """The fields and constants of a part so far."""

    def __init__(self, package: str, report: ReportProblem, file: str, *, lenient: bool) -> None:
        self._package, self._report, self._file, self._lenient = package, report, file, lenient
        self._declared: list[_Declared] = []
        self._lines: dict[str, int] = {}
        self._open: list[str] | None = None

    @property
    def is_empty(self) -> bool:
        """True until something is declared."""
        return not self._lines

    def goes_on(self, comment: str) -> bool:
        """Add an indented line to the comment behind the last declaration; return whether there is one."""
        if self._open:
            self._open.append(comment)
        return bool(self._open)

    def end_comment(self) -> None:
        """Let no further line belong to the comment behind the last declaration."""
        self._open = None

    def take_only_comment(self) -> str:
        """Return and remove the comment above the first declaration, if no other has one: it is about all of them."""
        if not self._declared or any(each.above for each in self._declared[1:]):
            return ""
        first = self._declared[0]
        self._declared[0] = replace(first, above="")
        return first.above

    def finish(self) -> tuple[tuple[DefinedField, ...], tuple[DefinedConstant, ...]]:
        """Return all fields and all constants."""
        made = [each.finish() for each in self._declared]
        fields = tuple(each for each in made if isinstance(each, DefinedField))
        return fields, tuple(each for each in made if isinstance(each, DefinedConstant))

    def add(self, line: Line, above: str) -> None:
        """Read the declaration of a line; `above` is the comment in the lines before it."""
        self._open = None
        if line.type is None or not self._has_name(line, line.type) or line.name is None:
            return
        try:
            shape = read_type(line.type.text, self._package, lenient=self._lenient)
        except UnreadableType as error:
            word = Word(line.type.text[error.start : error.end], line.type.column + error.start)
            self._report("invalid-type", error.reason, line, word, error.fix)
            return
        made = (self._field if line.equals is None else self._constant)(line, line.name, shape)
        if made is not None:
            self._open = [] if line.comment is None else [line.comment]
            self._declared.append(_Declared(made, above, self._open))

    def _has_name(self, line: Line, type_: Word) -> bool:
        """Report what is wrong with the name; return whether the declaration can be used."""
        name, kind = line.name, "field" if line.equals is None else "constant"
        if name is None:
            end = Word("", type_.column + len(type_.text))
            self._report("missing-name", f"this {kind} has no name", line, end, f"write {type_.text} name")
            return False
        known = self._lines.setdefault(name.text, line.number)
        upper = line.equals is not None
        if not (_ANY if self._lenient else _CONSTANT if upper else _FIELD).fullmatch(name.text):
            rule = f"a letter, then {'upper' if upper else 'lower'} case, digits, single underscores"
            message = f"{quoted(name.text)} is no name of a {kind}: {rule}"
            self._report("invalid-name", message, line, name, _better(line, name.text))
        elif known != line.number:
            message = f"{name.text} is declared already, on line {known}"
            self._report("duplicate-name", message, line, name, "rename one of them")
        elif len(self._lines) == MAX_DECLARATIONS + 1:
            message = f"a message has at most {MAX_DECLARATIONS} fields and constants"
            self._report("too-many", message, line, type_, "put some into a message of their own")
        else:
            return len(self._lines) <= MAX_DECLARATIONS
        return False

    def _constant(self, line: Line, name: Word, shape: Field) -> Callable[[str], DefinedConstant] | None:
        if shape.nested or shape.count is not Count.ONE or line.type is None:
            message = "a constant is one number, bool or text"
            self._report("invalid-constant", message, line, line.type or name, "make it a field")
            return None
        text = line.value.text if line.value else ""
        if line.value is None and shape.base not in ("string", "wstring") and line.equals is not None:
            end = Word("", line.equals + 1)
            self._report("missing-value", f"the constant {name.text} has no value", line, end, "write it behind the =")
            return None
        value = self._value(line, lambda: scalar(shape.base, text, shape.string_bound))
        place = self._place(line, name)
        return lambda comment: DefinedConstant(name.text, shape.base, value, text, comment, place)

    def _field(self, line: Line, name: Word, shape: Field) -> Callable[[str], DefinedField] | None:
        field, default = replace(shape, name=name.text), None
        if line.value is not None:
            if field.nested and not self._lenient:
                message = "a field that holds a message has no default"
                self._report("invalid-default", message, line, line.value, "leave it out")
                return None
            field = replace(field, default="" if field.nested else line.value.text)
            default = None if field.nested else self._value(line, lambda: value_of(field))
        place, type_place = self._place(line, name), self._place(line, line.type or name)
        return lambda comment: DefinedField(field, default, comment, place, type_place)

    def _value(self, line: Line, read: Callable[[], Value]) -> Value | str:
        try:
            return read()
        except ValueError as error:
            if line.value is not None and not self._lenient:
                self._report("invalid-value", str(error), line, line.value)
            return line.value.text if line.value else ""

    def _place(self, line: Line, word: Word) -> Place:
        return Place(self._file, line.number, word.column + 1, len(word.text), line.text)


def _better(line: Line, name: str) -> str | None:
    """Suggest a name that ROS 2 takes; also the other declaration, since `=` alone parts a constant from a default."""
    upper = line.equals is not None
    word = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|\W+|_+", "_", name).strip("_")
    word = word.upper() if upper else word.lower()
    if not (_CONSTANT if upper else _FIELD).fullmatch(word):
        return None
    if line.type is None or line.value is None or not (_FIELD if upper else _CONSTANT).fullmatch(name):
        return f"did you mean {word!r}?"
    kind, equals = ("default", " ") if upper else ("constant", "=")
    return f"did you mean {word!r}, or the {kind} `{line.type.text} {name}{equals}{line.value.text}`?"
