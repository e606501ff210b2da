"""What speaks for a unit as the answer to a question, in numbers, and how much each of them counts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from math import log
from typing import NamedTuple

from busflow_assistant.answer_kinds import AnswerKind
from busflow_assistant.evidence import emptiness, forms, gives_reason, items, subject, valued
from busflow_assistant.lexicon import tiny_words
from busflow_assistant.matching import Matched
from busflow_assistant.passages import PassageShape
from busflow_assistant.question import AskedQuestion
from busflow_assistant.search_index import Citable, SearchIndex, letters, runs_of
from busflow_assistant.words import raw_words, terms_of

ASKED = 1.3
"""How much more a word counts that says what is asked for."""
CLOSE = 3
"""The distance of two words that belong together."""


class Features(NamedTuple):
    """What a unit has of a question; all shares are of the question, from 0 to 1."""

    own: float
    """Its words of a topic, or what stands for them."""
    every: float
    """All its words, the rare ones most."""
    runs: float
    """Its runs of four letters: compounds, slips and other forms of a word have most of them in common."""
    exact: float
    """Its words of a topic as they are written."""
    near: float
    """Words that stand beside the unit alone."""
    before: float
    """Words that the unit before it has alone."""
    title: float
    """Words that the heading next above it has alone."""
    above: float
    """Words that any heading above it has alone."""
    key: float
    """Words that it begins with and is about."""
    together: float
    """Words in a row that stand close to each other in it."""
    named: float
    """1 if it has an identifier that two words of the question make."""
    asked: float
    """1 if it has a word that says what is asked for."""
    needed: float
    """Kinds of answers that need a number or its like, which it has."""
    lacking: float
    """Those that it lacks."""
    other: float
    """Other kinds of answers that it has the form of."""
    subject: float
    valued: float
    items: float
    reason: float
    empty: float
    length: float
    in_code: float
    """1 for a line of code where none is asked for."""
    in_table: float
    in_list: float
    whole: float
    """1 for a whole list or table."""
    titled: float
    """1 for one whose head, or what leads to it, says what is asked for."""


WEIGHTS = Features(
    own=5.61,
    every=1.96,
    runs=9.46,
    exact=1.00,
    near=3.41,
    before=4.05,
    title=4.29,
    above=2.77,
    key=1.43,
    together=1.94,
    named=1.07,
    asked=0.85,
    needed=1.68,
    lacking=-0.62,
    other=0.70,
    subject=2.03,
    valued=0.53,
    items=1.06,
    reason=2.65,
    empty=-1.05,
    length=-0.17,
    in_code=-0.68,
    in_table=0.05,
    in_list=-0.00,
    whole=0.01,
    titled=1.05,
)
"""How much each counts: fitted to the questions that the tests may tune on by `benchmarks/assistant_weights.py`."""


class Sought:
    """A question in an index, ready to be compared with many units."""

    def __init__(self, question: AskedQuestion, matched: Sequence[Matched], index: SearchIndex) -> None:
        self.question = question
        self.matched = matched
        asked = set(question.heads)
        weights = [each.weight * (ASKED if asked & set(each.term.stems) else 1.0) for each in matched]
        total = sum(weights) or 1.0
        self.weights = [weight / total for weight in weights]
        self._index = index

    @cached_property
    def words(self) -> Mapping[str, float]:
        """Each word by its stem, with its share of the rarity of all."""
        stems = {terms_of(word)[0] for word in raw_words(self.question.english) if word.casefold() not in tiny_words()}
        return _shares({one: self._index.rarity(one) for one in stems})

    @cached_property
    def runs(self) -> Mapping[str, float]:
        """Each run of letters, with its share of the rarity of all."""
        asked = set(runs_of(letters(self.question.english)))
        return _shares({run: self._index.rarity_of_run(run) ** 2 for run in asked})

    @cached_property
    def names(self) -> frozenset[str]:
        """The identifiers that two words in a row make: `sensor_processor` of "sensor processor"."""
        return frozenset(
            name
            for one, two in pairwise(self.matched)
            for first in (one.term.word, *one.variants)
            for second in (two.term.word, *two.variants)
            if (name := f"{first}_{second}") in self._index.postings
        )

    def share(self, terms: frozenset[str]) -> float:
        """Return the share of the question that some terms have."""
        return sum(weight * each.best(terms) for weight, each in zip(self.weights, self.matched, strict=True))

    def support(self, unit: Citable) -> float:
        """Return the share of the question that a unit and what stands around it have."""
        return sum(
            weight * max(each.best(unit.own), 0.85 * each.best(unit.near), 0.7 * each.best(unit.above))
            for weight, each in zip(self.weights, self.matched, strict=True)
        )

    def features(self, unit: Citable) -> Features:
        """Return what a unit has of the question."""
        question, text, shape = self.question, unit.text, unit.passage.shape
        own = [each.best(unit.own) for each in self.matched]
        needed, lacking, other = forms(question, text)
        every = sum(share for word, share in self.words.items() if word in unit.own)
        about = question.wanted & {AnswerKind.DEFINITION, AnswerKind.FUNCTION}
        return Features(
            own=sum(weight * value for weight, value in zip(self.weights, own, strict=True)),
            every=every,
            runs=sum(share for run, share in self.runs.items() if run in unit.letters),
            exact=self._exact(unit),
            near=self._added(own, unit.near),
            before=sum(share for word, share in self.words.items() if word in unit.before and word not in unit.own),
            title=self._added(own, unit.title),
            above=self._added(own, unit.above),
            key=self.share(unit.key),
            together=self._together(unit),
            named=not self.names.isdisjoint(unit.own),
            asked=any(head in unit.own for head in question.heads),
            needed=needed,
            lacking=lacking,
            other=other,
            subject=subject(question, unit) if about else 0.0,
            valued=valued(question, unit),
            items=min(1.0, items(text) / 3) if AnswerKind.LIST in question.wanted else 0.0,
            reason=AnswerKind.REASON in question.wanted and gives_reason(text),
            empty=emptiness(question, unit),
            length=log(1 + unit.length),
            in_code=shape is PassageShape.CODE and AnswerKind.METHOD not in question.wanted,
            in_table=shape is PassageShape.TABLE,
            in_list=shape is PassageShape.LIST,
            whole=unit.whole,
            titled=unit.whole and not unit.near.isdisjoint(question.heads),
        )

    def score(self, unit: Citable) -> float:
        """Return how much speaks for a unit."""
        return sum(weight * value for weight, value in zip(WEIGHTS, self.features(unit), strict=True))

    def _added(self, own: Sequence[float], terms: frozenset[str]) -> float:
        """The share that some terms have and a unit has not."""
        return sum(
            weight * (1 - had) * each.best(terms)
            for weight, had, each in zip(self.weights, own, self.matched, strict=True)
        )

    def _exact(self, unit: Citable) -> float:
        written = unit.letters.split()
        return sum(weight for weight, each in zip(self.weights, self.matched, strict=True) if each.term.word in written)

    def _together(self, unit: Citable) -> float:
        at = [[n for n, one in enumerate(unit.stems) if one in each.variants] for each in self.matched]
        found = [min((abs(a - b) for a in one for b in two), default=CLOSE + 1) <= CLOSE for one, two in pairwise(at)]
        return sum(found) / max(1, len(found))


def _shares(values: Mapping[str, float]) -> Mapping[str, float]:
    total = sum(values.values()) or 1.0
    return {name: value / total for name, value in values.items()}
