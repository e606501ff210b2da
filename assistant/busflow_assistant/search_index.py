"""An index of pages: which unit has which term, and what stands around it."""

from __future__ import annotations

import math
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from busflow_assistant.markdown import plain
from busflow_assistant.passages import Extent, Page, Passage, PassageShape
from busflow_assistant.words import terms

_HEAD = re.compile(r"\$ |(?:class|def|async def) ")
_NEAR = 8
"""Units of a list or paragraph on each side that count as near."""


@dataclass(slots=True, eq=False)
class Citable:
    """What an answer may cite by itself, with the terms in it and around it."""

    number: int
    page: Page
    passage: Passage
    span: Extent
    own: Counter[str]
    near: frozenset[str]
    """Terms of the sentences, items or lines beside it, and of what leads up to its passage."""
    above: frozenset[str]
    """Terms of the headings above it."""
    length: int = field(default=0)

    @property
    def text(self) -> str:
        """The unit, verbatim."""
        return self.page.text(self.span)


class SearchIndex:
    """Pages, ready to be searched."""

    def __init__(self, pages: Iterable[Page]) -> None:
        self.pages: dict[str, Page] = {page.name: page for page in pages}
        self.units: list[Citable] = []
        self.of_page: dict[str, range] = {}
        self.postings: defaultdict[str, list[int]] = defaultdict(list)
        """Term → the numbers of the units that have it, in order."""
        for page in self.pages.values():
            first = len(self.units)
            self._add(page)
            self.of_page[page.name] = range(first, len(self.units))
        self.mean_length: float = sum(unit.length for unit in self.units) / max(1, len(self.units))

    @cached_property
    def by_prefix(self) -> dict[str, list[str]]:
        """The terms by their first four letters."""
        found: defaultdict[str, list[str]] = defaultdict(list)
        for term in self.postings:
            if len(term) >= 4 and not term[0].isdigit():
                found[term[:4]].append(term)
        return dict(found)

    def rarity(self, term: str) -> float:
        """Return the inverse document frequency of a term over units, from 0 to 1."""
        had, of = len(self.postings.get(term, ())), len(self.units)
        return math.log(1 + (of - had + 0.5) / (had + 0.5)) / math.log(1 + (of + 0.5) / 0.5)

    def _add(self, page: Page) -> None:
        lead: frozenset[str] = frozenset()
        for passage in page.passages:
            above = frozenset(term for heading in passage.headings for term in terms(heading))
            own = [Counter(terms(plain(page.text(span)))) for span in passage.units]
            for position, (span, counted) in enumerate(zip(passage.units, own, strict=True)):
                near = _around(own, position, passage, page) | lead
                unit = Citable(len(self.units), page, passage, span, counted, near, above, counted.total())
                self.units.append(unit)
                for term in counted if _says_something(unit) else ():
                    self.postings[term].append(unit.number)
            lead = _lead(own, passage, lead)


def _says_something(unit: Citable) -> bool:
    """True if a unit may be an answer: no heading, and no question that the page asks itself."""
    return unit.passage.shape is not PassageShape.HEADING and not unit.text.rstrip("*_\"'”)").endswith("?")


def _around(own: Sequence[Counter[str]], position: int, passage: Passage, page: Page) -> frozenset[str]:
    if passage.shape in {PassageShape.PROSE, PassageShape.LIST}:
        around = range(max(0, position - _NEAR), min(len(own), position + _NEAR + 1))
        return frozenset(term for index in around if index != position for term in own[index])
    around = {*range(max(0, position - 2), min(len(own), position + 3)), 0, *_holders(passage, position, page)}
    return frozenset(term for index in around - {position} for term in own[index])


def _holders(passage: Passage, position: int, page: Page) -> Iterator[int]:
    """The lines that a line of code belongs to: those before it with less indentation, the command or class above."""
    if passage.shape is not PassageShape.CODE:
        return
    indent = _column(page, passage.units[position])
    head = False
    for index in range(position - 1, -1, -1):
        extent = passage.units[index]
        if (before := _column(page, extent)) < indent:
            indent = before
            yield index
        if not head and (head := bool(_HEAD.match(page.source, extent.start))):
            yield index


def _column(page: Page, extent: Extent) -> int:
    return extent.start - page.source.rfind("\n", 0, extent.start) - 1


def _lead(own: Sequence[Counter[str]], passage: Passage, before: frozenset[str]) -> frozenset[str]:
    """What leads up to the passage that follows: the last sentences of prose, and the first line of what came since."""
    if passage.shape is PassageShape.HEADING:
        return frozenset()
    if passage.shape is PassageShape.PROSE:
        return frozenset(term for counted in own[-3:] for term in counted)
    return before | frozenset(own[0])


def indent(unit: Citable) -> int:
    """Return how many characters stand before a unit on its line."""
    return _column(unit.page, unit.span)
