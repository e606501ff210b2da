"""Tables: rows with aligned columns, which shrink to fit a narrow terminal."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from unicodedata import combining, east_asian_width

import click

from busflow.cli.terminal.output import colour
from busflow.text import printable

_GAP = "  "
_PARTS = re.compile(r"/?[^\s/,]+[/,]?|[/,]")
"""A part of a cell that is kept on one line, unless it is longer than the line."""
_USUAL = 80
"""The width of a terminal that does not state its own."""
_NARROWEST = 20
"""The least width of a folding column, unless its cells need less."""


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table, and how it shrinks in a narrow terminal."""

    title: str = ""
    right: bool = False
    """Whether its cells are aligned to the right, as numbers are."""
    short: Callable[[str], str] | None = None
    """A function that shortens its cells, where folding does not suffice."""
    goes: int = 0
    """The order in which columns are then left out, the lowest number first; a column with 0 stays."""
    folds: bool = False
    """Whether its cells may take several lines."""


@dataclass(frozen=True, slots=True)
class _Lane:
    """A column with its cells."""

    column: Column
    cells: tuple[str, ...]

    @property
    def width(self) -> int:
        return max(map(_width, (self.column.title, *self.cells)))

    @property
    def narrowest(self) -> int:
        if not self.column.folds:
            return self.width
        parts = (_width(part) for cell in self.cells for part in _PARTS.findall(cell))
        return min(self.width, max(_NARROWEST, _width(self.column.title), *parts))

    def shortened(self) -> _Lane:
        return replace(self, cells=tuple(map(self.column.short, self.cells))) if self.column.short else self


def print_table(rows: Iterable[Sequence[object]], *columns: Column, indent: str = "") -> None:
    """Print rows so that no word is broken in a terminal; a file or pipe gets lines of any length."""
    for line in table_lines(rows, *columns, indent=indent, width=terminal_width()):
        click.echo(line, color=colour())


def print_text(*parts: str, indent: str = "") -> None:
    """Print a line without breaking parts or words in a terminal; continuation lines are indented."""
    width, shown = terminal_width(), [printable(part) for part in parts]
    for line in [" ".join(shown)] if width is None else folded(shown, width, indent):
        click.echo(line)


def bare(name: str) -> str:
    """Return a type without its package, or a queue without its overflow policy.

    >>> bare("std_msgs/msg/Float64"), bare("depth 10, drop_oldest")
    ('Float64', 'depth 10')
    """
    return name.rpartition("/")[2].partition(",")[0]


def terminal_width() -> int | None:
    """Return the width of standard output in characters; None if it is not a terminal."""
    if sys.stdout is None or not sys.stdout.isatty():  # pyright: ignore[reportUnnecessaryComparison]  # `>&-` closes it
        return None
    stated = os.environ.get("COLUMNS", "")
    try:
        found = int(stated) if stated.isdecimal() else os.get_terminal_size(sys.stdout.fileno()).columns
    except OSError:  # a terminal that only Python simulates
        found = 0
    return found or _USUAL


def table_lines(
    rows: Iterable[Sequence[object]], *columns: Column, indent: str = "", width: int | None = None
) -> Iterator[str]:
    """Yield the rows as lines, control characters escaped; in a narrow terminal columns shrink as they state.

    If that does not suffice, the first column has lines of its own, with the others below it.

    >>> list(table_lines([("a", 1, ""), ("long", "", "x")]))
    ['a     1', 'long     x']
    >>> list(table_lines([("/arm/left", 10)], width=9))
    ['/arm/left', '  10']
    """
    table = [[printable(cell) for cell in row] for row in rows]
    named = columns or tuple(Column() for _ in (table[0] if table else ()))
    lanes = [_Lane(column, tuple(row[place] for row in table)) for place, column in enumerate(named)]
    room = None if width is None else max(1, width - len(indent))
    for line in _lines(lanes, room) if lanes else ():
        yield (indent + line).rstrip()


def _lines(lanes: Sequence[_Lane], room: int | None) -> Iterator[str]:
    for below in (False, True):
        for left in _reductions(lanes):
            beside = left[1:] if below else left
            widths = _widths(beside, None if room is None else room - below * len(_GAP))
            if widths is not None:
                return _below(left, widths, room or 0) if below else _side_by_side(left, widths)
    return _sentences([lane.shortened() for lane in lanes], room or 0)


def _reductions(lanes: Sequence[_Lane]) -> Iterator[list[_Lane]]:
    """Yield the whole table, then with shortened cells, then with fewer and fewer columns."""
    yield list(lanes)
    left = [lane.shortened() for lane in lanes]
    yield left
    for number in sorted({lane.column.goes for lane in lanes} - {0}):
        left = [lane for lane in left if lane.column.goes != number]
        yield left


def _widths(lanes: Sequence[_Lane], room: int | None) -> list[int] | None:
    """Return the width of each column; None if they do not fit side by side."""
    widths = [lane.width for lane in lanes]
    if room is None:
        return widths
    excess = sum(widths) + len(_GAP) * (len(lanes) - 1) - room
    spare = [lane.width - lane.narrowest for lane in lanes]
    if excess > sum(spare):
        return None
    for _ in range(excess):
        widest = max(range(len(lanes)), key=lambda place: spare[place])
        widths[widest] -= 1
        spare[widest] -= 1
    return widths


def _side_by_side(lanes: Sequence[_Lane], widths: Sequence[int]) -> Iterator[str]:
    if head := _head(lanes, widths):
        yield head
    for row in zip(*(lane.cells for lane in lanes), strict=True):
        yield from _row(row, lanes, widths)


def _below(lanes: Sequence[_Lane], widths: Sequence[int], room: int) -> Iterator[str]:
    """Yield the first column on lines of its own, with the others below it."""
    names, others = lanes[0], lanes[1:]
    if names.column.title:
        yield click.style(names.column.title, bold=True)
        yield _GAP + _head(others, widths)
    for name, *row in zip(*(lane.cells for lane in lanes), strict=True):
        yield from folded([name], room)
        if any(row):
            yield from (_GAP + line for line in _row(row, others, widths))


def _sentences(lanes: Sequence[_Lane], room: int) -> Iterator[str]:
    """Yield the first column on lines of its own, with the others below it as a sentence."""
    for name, *row in zip(*(lane.cells for lane in lanes), strict=True):
        yield from folded([name], room)
        said = [f"{lane.column.title} {cell}".strip() for lane, cell in zip(lanes[1:], row, strict=True) if cell]
        if said:
            said[0] = _GAP + said[0]
            yield from folded([f"{each}," for each in said[:-1]] + said[-1:], room)


def _head(lanes: Sequence[_Lane], widths: Sequence[int]) -> str:
    titles = [_aligned(lane.column.title, lane, width) for lane, width in zip(lanes, widths, strict=True)]
    head = _GAP.join(titles).rstrip()
    return click.style(head, bold=True) if head else ""


def _row(cells: Sequence[str], lanes: Sequence[_Lane], widths: Sequence[int]) -> Iterator[str]:
    parts = [folded([cell], width) for cell, width in zip(cells, widths, strict=True)]
    for line in zip_longest(*parts, fillvalue=""):
        yield _GAP.join(_aligned(*each) for each in zip(line, lanes, widths, strict=True)).rstrip()


def _aligned(cell: str, lane: _Lane, width: int) -> str:
    space = " " * (width - _width(cell))
    return space + cell if lane.column.right else cell + space


def narrowed(
    rows: Iterable[Sequence[str]], columns: Sequence[Column], room: int, *, gap: int
) -> tuple[list[Column], list[tuple[str, ...]]]:
    """Return the columns and cells that fit side by side, one line for each row; names in the first shrink first."""
    table = list(rows)
    names, *others = [_Lane(column, tuple(row[place] for row in table)) for place, column in enumerate(columns)]
    tried = list(_reductions([_elided(names, max(_NARROWEST, room // 2)), *others]))
    left = next((each for each in tried if sum(lane.width + gap for lane in each) <= room), tried[-1])
    name_room = room - gap - sum(lane.width + gap for lane in left[1:])
    shown = [_elided(left[0], name_room), *left[1:]]
    return [lane.column for lane in shown], list(zip(*(lane.cells for lane in shown), strict=True))


def _elided(lane: _Lane, width: int) -> _Lane:
    return replace(lane, cells=tuple(elided(cell, max(width, _width(lane.column.title))) for cell in lane.cells))


def elided(name: str, width: int) -> str:
    """Return the end of a name, its most specific part, in at most `width` characters.

    >>> elided("/left/arm/joint_states", 18), elided("/joint_states", 8), elided("/imu", 8)
    ('…/arm/joint_states', '…_states', '/imu')
    """
    if _width(name) <= width:
        return name
    end = name[len(name) - max(1, width - 1) :]
    slash = end.find("/")
    return "…" + (end[slash:] if 0 <= slash < len(end) - 1 else end)


def folded(parts: Sequence[str], width: int, indent: str = "") -> list[str]:
    """Fold the parts of a line into lines of at most `width`, further ones indented.

    A short part stays whole; else its words do; else the pieces between slashes or commas.

    >>> folded(["depth 10,", "drop_oldest"], 12)
    ['depth 10,', 'drop_oldest']
    >>> folded(["  → /left_arm/joint_states"], 16)
    ['  → /left_arm/', '  joint_states']
    """
    whole = " ".join(parts)
    if _width(whole) <= width:
        return [whole]
    before = whole[: len(whole) - len(whole.lstrip())]
    room = max(1, width - len(before + indent))
    lines = [""]
    for part in parts:
        for word in [part.strip()] if 2 * _width(part) <= room else part.split():
            if lines[-1] and _width(lines[-1]) + 1 + _width(word) > room >= _width(word):
                lines.append("")
            _fill(lines, word, room)
    return [before + (indent if place else "") + line for place, line in enumerate(lines)]


def _fill(lines: list[str], word: str, room: int) -> None:
    """Append a word to the last line, and the rest that does not fit to further lines."""
    while True:
        space = " " if lines[-1] else ""
        left = room - _width(lines[-1]) - len(space)
        if _width(word) <= left:
            lines[-1] += space + word
            return
        cut = max(word.rfind(mark, 1, left) for mark in "/,") + 1 if left > 1 else 0
        if cut or not lines[-1]:
            cut = cut or max(1, left)
            lines[-1], word = lines[-1] + space + word[:cut], word[cut:]
        lines.append("")


def _width(text: str) -> int:
    """Return the width of a text in a terminal."""
    if text.isascii():
        return len(text)
    return sum(0 if combining(each) else 1 + (east_asian_width(each) in "WF") for each in text)
