"""Features of a unit as the answer to a question, in numbers, and the weight of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from operator import mul
from typing import NamedTuple

from busflow_assistant.answer_kinds import AnswerKind
from busflow_assistant.evidence import acts, denies, emptiness, forms, gives_reason, gives_verdict, items, subject
from busflow_assistant.lexicon import tiny_words
from busflow_assistant.matching import Matched
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
    literal: float
    """Its identifiers and numbers of the question."""
    covered: float
    """Words of a topic that it, a unit beside it or the heading next above it has."""
    near: float
    """Words that stand beside the unit alone."""
    before: float
    """Words that the unit before it has alone."""
    title: float
    """Words that the heading next above it has alone."""
    key: float
    """Words that it begins with and is about."""
    together: float
    """Words in a row that stand close to each other in it."""
    asked: float
    """1 if it has a word that says what is asked for."""
    needed: float
    """Kinds of answers that need a number or its like, which it has."""
    lacking: float
    """Those that it lacks."""
    other: float
    """Other kinds of answers that it has the form of."""
    subject: float
    acts: float
    """1 if it says what the topic is or does, where that is asked for."""
    items: float
    reason: float
    verdict: float
    """1 if it allows, forbids or restricts, and the question can be answered by yes or no."""
    denies: float
    """1 if it says what is not, and the question asks for that."""
    empty: float


WEIGHTS = Features(
    own=2.73,
    every=1.77,
    runs=9.62,
    literal=-2.49,
    covered=3.88,
    near=1.25,
    before=3.05,
    title=4.54,
    key=2.27,
    together=1.66,
    asked=1.35,
    needed=2.22,
    lacking=-0.71,
    other=1.08,
    subject=1.36,
    acts=1.73,
    items=1.19,
    reason=2.36,
    verdict=1.74,
    denies=1.28,
    empty=-1.93,
)
"""How much each counts: fitted to the questions that the tests may tune on by `assistant/tools/fit_weights.py`."""


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


class Compared:
    """A unit beside a question: what it, and what stands around it, has of each of the question's terms."""

    def __init__(self, sought: Sought, unit: Citable) -> None:
        self.unit = unit
        self._sought = sought
        self._own = [each.best(unit.own) for each in sought.matched]
        self._near = [each.best(unit.near) for each in sought.matched]
        self._title = [each.best(unit.title) for each in sought.matched]

    @property
    def own(self) -> float:
        """The share of the question that the unit has by itself."""
        return self._share(self._own)

    @property
    def support(self) -> float:
        """The share that it and what stands around it have."""
        above = [each.best(self.unit.above) for each in self._sought.matched]
        around = zip(self._own, self._near, above, strict=True)
        return self._share([max(own, 0.85 * near, 0.7 * over) for own, near, over in around])

    @property
    def score(self) -> float:
        """How much speaks for the unit."""
        return sum(weight * value for weight, value in zip(WEIGHTS, self.features, strict=True))

    @property
    def features(self) -> Features:
        """What it has of the question."""
        unit, text = self.unit, self.unit.text
        question, words, runs = self._sought.question, self._sought.words, self._sought.runs
        wanted = question.wanted
        needed, lacking, other = forms(question, text)
        about = bool(wanted & {AnswerKind.DEFINITION, AnswerKind.FUNCTION})
        around = zip(self._own, self._near, self._title, strict=True)
        return Features(
            own=self.own,
            every=sum(share for word, share in words.items() if word in unit.own),
            runs=sum(share for run, share in runs.items() if run in unit.letters),
            literal=self._literal(),
            covered=self._share([max(values) for values in around]),
            near=self._added(self._near),
            before=sum(share for word, share in words.items() if word in unit.before and word not in unit.own),
            title=self._added(self._title),
            key=self._share([each.best(unit.key) for each in self._sought.matched]) if unit.key else 0.0,
            together=self._together(),
            asked=any(head in unit.own for head in question.heads),
            needed=needed,
            lacking=lacking,
            other=other,
            subject=subject(question, unit) if about else 0.0,
            acts=about and acts(question, unit),
            items=min(1.0, items(text) / 3) if AnswerKind.LIST in wanted else 0.0,
            reason=AnswerKind.REASON in wanted and gives_reason(text),
            verdict=AnswerKind.YES_OR_NO in wanted and gives_verdict(text),
            denies=AnswerKind.NEGATION in wanted and denies(text),
            empty=emptiness(question, unit),
        )

    def _share(self, values: Sequence[float]) -> float:
        """Return the share of the question, from a value from 0 to 1 for each of its terms."""
        return sum(map(mul, self._sought.weights, values))

    def _added(self, values: Sequence[float]) -> float:
        """Return the share that something around the unit has, and the unit has not."""
        return self._share([(1 - own) * value for own, value in zip(self._own, values, strict=True)])

    def _literal(self) -> float:
        matched = zip(self._own, self._sought.matched, strict=True)
        return self._share([own if each.term.literal else 0.0 for own, each in matched])

    def _together(self) -> float:
        stems = self.unit.stems
        at = [[n for n, one in enumerate(stems) if one in each.variants] for each in self._sought.matched]
        found = [min((abs(a - b) for a in one for b in two), default=CLOSE + 1) <= CLOSE for one, two in pairwise(at)]
        return sum(found) / max(1, len(found))


def _shares(values: Mapping[str, float]) -> Mapping[str, float]:
    total = sum(values.values()) or 1.0
    return {name: value / total for name, value in values.items()}
