"""An index of pages: which unit has which term, and what stands around it."""

from __future__ import annotations

import math
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from busflow_assistant.markdown import plain
from busflow_assistant.passages import Extent, Page, Passage, PassageShape
from busflow_assistant.words import raw_words, stem, terms, terms_of

_HEAD = re.compile(r"\$ |(?:class|def|async def) ")
_KEY = re.compile(r"\s*(?:[-*+]\s+|\d+[.)]\s+)?(?:\*\*(?P<bold>.+?)\*\*|`(?P<name>[^`]+)`)", re.DOTALL)
_KINDS = (
    (re.compile(r"(?<![\w-])--[a-z]"), ("option", "flag")),
    (re.compile(r"\b[A-Z][A-Z0-9]*(?:_[A-Z0-9]+)+\b(?!\()"), ("environment", "variable")),
    (re.compile(r"\b[\w-]+\.(?:yaml|yml|py|md|json|mcap|pem|key|csv|urdf|msg|srv|txt|toml)\b"), ("file",)),
    (re.compile(r"^\$ \S|`(?:busflow|ros2|pip|python) \w"), ("command",)),
    (
        re.compile(r"\b[A-Z]\w*(?:Error|Failed|Exception|Timeout|Rejected|Aborted|Unavailable)\b"),
        ("error", "exception"),
    ),
)
"""What names are, by their form: a text need not say that `--rate` is an option."""
_OTHER = re.compile(r"[^a-z0-9]+")
_RUN = 4
"""Letters of a run."""
_NEAR = 8
"""Units of a list or paragraph on each side that count as near."""


@dataclass(eq=False)
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
    before: frozenset[str] = frozenset()
    """Terms of the unit before it in its passage."""
    whole: bool = False
    """A whole list or table, whose units are citable by themselves too."""

    @property
    def text(self) -> str:
        """The unit, verbatim."""
        return self.page.text(self.span)

    @cached_property
    def may_answer(self) -> bool:
        """Whether it is no heading, and no question that the page asks itself."""
        return self.passage.shape is not PassageShape.HEADING and not self.text.rstrip("*_\"'”)").endswith("?")

    @cached_property
    def letters(self) -> str:
        """The unit in small letters and digits, with single spaces between words and around all."""
        return letters(plain(self.text))

    @cached_property
    def stems(self) -> tuple[str, ...]:
        """Its words in order, by their stems."""
        return tuple(terms_of(word)[0] for word in raw_words(plain(self.text)))

    @cached_property
    def key(self) -> frozenset[str]:
        """Terms of what it begins with and is about: a row's first cell, what is bold, a name in code."""
        if self.passage.shape is PassageShape.TABLE:
            return frozenset(terms(plain(self.text.strip("| ").split("|")[0])))
        found = _KEY.match(self.text)
        return frozenset(terms(found["bold"] or found["name"])) if found else frozenset()

    @cached_property
    def title(self) -> frozenset[str]:
        """Terms of the heading next above it."""
        return frozenset(terms(self.passage.headings[-1])) if self.passage.headings else frozenset()


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
        self._having_run = Counter(run for unit in self.units for run in set(runs_of(unit.letters)))

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
        return _rarity(len(self.postings.get(term, ())), len(self.units))

    def rarity_of_run(self, run: str) -> float:
        """Return the same of a run of letters."""
        return _rarity(self._having_run[run], len(self.units))

    def _add(self, page: Page) -> None:
        lead: frozenset[str] = frozenset()
        for passage in page.passages:
            above = frozenset(term for heading in passage.headings for term in terms(heading))
            own = [Counter([*terms(plain(text)), *_kinds(text)]) for text in map(page.text, passage.units)]
            for position, (span, counted) in enumerate(zip(passage.units, own, strict=True)):
                near = _around(own, position, passage, page) | lead
                before = frozenset(own[position - 1]) if position else frozenset[str]()
                unit = Citable(len(self.units), page, passage, span, counted, near, above, before)
                self.units.append(unit)
                for term in counted if unit.may_answer else ():
                    self.postings[term].append(unit.number)
            lead = _lead(own, passage, lead)


def letters(text: str) -> str:
    """Return a text as runs of letters are looked for in it.

    >>> letters("The `rate_hz`, Hz")
    ' the rate hz hz '
    """
    return f" {_OTHER.sub(' ', text.casefold()).strip()} "


def runs_of(text: str) -> Iterator[str]:
    """Return the runs of letters of a text, as `letters` gives it.

    >>> list(runs_of(" hz of "))
    [' hz ', 'hz o', 'z of', ' of ']
    """
    return (text[at : at + _RUN] for at in range(len(text) - _RUN + 1))


def _kinds(text: str) -> Iterator[str]:
    """Return the terms of what the names of a text are."""
    return (stem(word) for form, words in _KINDS if form.search(text) for word in words)


def _rarity(had: int, of: int) -> float:
    return math.log(1 + (of - had + 0.5) / (had + 0.5)) / math.log(1 + (of + 0.5) / 0.5)


def _around(own: Sequence[Counter[str]], position: int, passage: Passage, page: Page) -> frozenset[str]:
    if passage.shape in {PassageShape.PROSE, PassageShape.LIST}:
        around = range(max(0, position - _NEAR), min(len(own), position + _NEAR + 1))
        return frozenset(term for index in around if index != position for term in own[index])
    around = {*range(max(0, position - 2), min(len(own), position + 3)), 0, *_holders(passage, position, page)}
    return frozenset(term for index in around - {position} for term in own[index])


def _holders(passage: Passage, position: int, page: Page) -> Iterator[int]:
    """Yield the lines that a line of code belongs to: less indented ones before it, the command or class above."""
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
