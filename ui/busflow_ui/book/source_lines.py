"""SourceLines: the lines of a page's Markdown, and where the content of a block stands in them. Pure.

Offsets count characters of the file as it is: the assistant cites by them.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

_LINE_END = re.compile(r"\r\n|\n|\r")


@dataclass(frozen=True, slots=True)
class SourceRun:
    """Characters of a block's content that stand in a row in the source."""

    at: int
    """Where it begins in the content."""
    start: int
    """Where it begins in the source."""
    length: int


class SourceLines:
    """Lines of one page."""

    def __init__(self, source: str) -> None:
        ends = [match.span() for match in _LINE_END.finditer(source)]
        self.source = source
        self._starts: Sequence[int] = [0, *(end for _, end in ends)]
        self._texts: Sequence[str] = [
            source[start:end]
            for start, end in zip(self._starts, [*(start for start, _ in ends), len(source)], strict=True)
        ]

    def extent(self, lines: Sequence[int]) -> tuple[int, int]:
        """Return where some lines, from the first until before the last, begin and end."""
        first, last = lines
        last = min(last, len(self._starts))
        return self._starts[first], self._starts[last - 1] + len(self._texts[last - 1]) if last else 0

    def ending(self, content: str, first: int) -> list[SourceRun]:
        """Return where content stands whose lines end lines of the source: before them are only marks and spaces."""
        found: list[SourceRun] = []
        at = 0
        for number, line in enumerate(content.split("\n"), first):
            if number < len(self._texts):
                text, wanted = self._texts[number].rstrip(), line.rstrip()
                if wanted and text.endswith(wanted):
                    found.append(SourceRun(at, self._starts[number] + len(text) - len(wanted), len(line)))
            at += len(line) + 1
        return found

    def inside(self, content: str, line: int, cursor: int = 0, *, is_last: bool = False) -> tuple[list[SourceRun], int]:
        r"""Return where content stands within one line from a column on, and the column behind it.

        A table writes `\|` for a bar. `is_last` asks for the last place: a heading's marks may hold its text.
        """
        text = self._texts[line] if line < len(self._texts) else ""
        written = content
        column = text.rfind(written) if is_last else text.find(written, cursor)
        if column < 0:
            written = content.replace("|", "\\|")
            column = text.find(written, cursor)
        if column < 0 or not content:
            return [], cursor
        start = self._starts[line] + column
        parts = content.split("|") if written != content else [content]
        found: list[SourceRun] = []
        at = 0
        for bars, part in enumerate(parts):
            length = len(part) + (bars > 0)
            found.append(SourceRun(at, start + at + bars, length))
            at += length
        return found, column + len(written)


def place(runs: Sequence[SourceRun], at: int) -> int | None:
    """Return where a character of the content stands in the source; None where that is not known."""
    return next((run.start + at - run.at for run in runs if run.at <= at < run.at + run.length), None)
