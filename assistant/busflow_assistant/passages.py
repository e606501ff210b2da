"""Pages as the assistant reads them: a source, its passages, and the units that an answer may cite."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum


class PassageShape(StrEnum):
    """The form of a passage on its page."""

    HEADING = "heading"
    PROSE = "prose"
    LIST = "list"
    TABLE = "table"
    CODE = "code"


@dataclass(frozen=True, slots=True)
class Extent:
    """A part of a page's source, in characters; the end is not part of it."""

    start: int
    end: int

    def __len__(self) -> int:
        return self.end - self.start

    def common(self, other: Extent) -> int:
        """Return how many characters both have."""
        return max(0, min(self.end, other.end) - max(self.start, other.start))


@dataclass(frozen=True, slots=True)
class Passage:
    """A paragraph, list, table or block of code, with the headings above it."""

    shape: PassageShape
    span: Extent
    units: tuple[Extent, ...]
    """What may be cited by itself: sentences, items, rows, lines."""
    headings: tuple[str, ...] = ()
    """From the page's title down."""


@dataclass(frozen=True, slots=True)
class Page:
    """A page's source and its passages, in order."""

    name: str
    source: str
    passages: tuple[Passage, ...] = field(default=(), repr=False)

    def text(self, span: Extent) -> str:
        """Return a part of the source, verbatim."""
        return self.source[span.start : span.end]
