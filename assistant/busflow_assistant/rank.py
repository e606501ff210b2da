"""The units of a scope, best first: BM25F over a unit, its neighbours and its headings, and the form of an answer."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from busflow_assistant.answer_kinds import AnswerKind
from busflow_assistant.evidence import fitness
from busflow_assistant.matching import Matched
from busflow_assistant.passages import PassageShape
from busflow_assistant.question import AskedQuestion
from busflow_assistant.search_index import Citable, SearchIndex

K1 = 0.4
B = 0.3
NEAR = 0.33
ABOVE = 0.3
FORM = 0.3
"""How much the form of an answer counts beside the terms."""
ASKED = 1.3
"""How much more a word counts that says what is asked for."""
TOGETHER = 0.05
CODE = 0.12
"""What a line of code loses beside prose, where no code is asked for."""


@dataclass(frozen=True, slots=True)
class Ranked:
    """A unit with its score, and how much of the question it has."""

    unit: Citable
    score: float
    support: float
    """The share of the question's weight that the unit and what stands around it have, up to 1."""
    own: float
    """The share that the unit has by itself."""
    similarity: float | None = None
    """How close its meaning is to the question's, up to 1, where a model says so."""


def candidates(matched: Sequence[Matched], index: SearchIndex, scope: Iterable[int], most: int = 300) -> list[int]:
    """Return the units of a scope that have a term of the question, those with most of it first."""
    weights: dict[int, float] = {}
    inside = scope if isinstance(scope, range | set | frozenset) else set(scope)
    for each in matched:
        best: dict[int, float] = {}
        for variant, quality in each.variants.items():
            for number in index.postings[variant]:
                if number in inside and quality > best.get(number, 0.0):
                    best[number] = quality
        for number, quality in best.items():
            weights[number] = weights.get(number, 0.0) + each.weight * quality
    return sorted(weights, key=lambda number: -weights[number])[:most]


def rank(question: AskedQuestion, matched: Sequence[Matched], index: SearchIndex, scope: Iterable[int]) -> list[Ranked]:
    """Return the units of a scope that may answer a question, the best first."""
    asked = set(question.heads)
    weights = [each.weight * (ASKED if asked & set(each.term.stems) else 1.0) for each in matched]
    joined = _joined(matched, index)
    numbers = candidates(matched, index, scope)
    found = [
        _ranked(question, matched, weights, joined, unit=index.units[number], mean=index.mean_length)
        for number in numbers
    ]
    numbered = any(each.term.word.replace(".", "").isdigit() for each in matched)
    best = found if numbered else _without_repeats(found)
    return sorted(best, key=lambda each: (-each.score, each.unit.number))


def _without_repeats(found: Iterable[Ranked]) -> list[Ranked]:
    """One of the lines of code or output that differ only in numbers: the first, which is the usual case."""
    kept: dict[object, Ranked] = {}
    for each in sorted(found, key=lambda each: each.unit.number):
        words = frozenset(term for term in each.unit.own if not term[0].isdigit())
        repeated = each.unit.passage.shape is PassageShape.CODE and len(words) > 1
        key = (each.unit.page.name, words) if repeated else each.unit.number
        before = kept.setdefault(key, each)
        if each.score > before.score:
            kept[key] = replace(before, score=each.score)
    return list(kept.values())


def _ranked(
    question: AskedQuestion,
    matched: Sequence[Matched],
    weights: Sequence[float],
    joined: frozenset[str],
    *,
    unit: Citable,
    mean: float,
) -> Ranked:
    norm = 1 - B + B * unit.length / max(1.0, mean)
    score = own_share = support = 0.0
    for each, weight in zip(matched, weights, strict=True):
        own, near, above = each.best(unit.own), each.best(unit.near), each.best(unit.above)
        frequency = own / norm + NEAR * near + ABOVE * above
        score += weight * frequency * (K1 + 1) / (K1 + frequency)
        own_share += weight * own
        support += weight * max(own, 0.85 * near, 0.7 * above)
    total = sum(weights) or 1.0
    together = 0.0 if joined.isdisjoint(unit.own) else TOGETHER
    score = score / total + FORM * fitness(question, unit) + together
    if unit.passage.shape is PassageShape.CODE and AnswerKind.METHOD not in question.wanted:
        score -= CODE
    return Ranked(unit, score, support / total, own_share / total)


def _joined(matched: Sequence[Matched], index: SearchIndex) -> frozenset[str]:
    """The identifiers that two words in a row of the question make: `sensor_processor` of "sensor processor"."""
    return frozenset(
        name
        for one, two in pairwise(matched)
        for first in (one.term.word, *one.variants)
        for second in (two.term.word, *two.variants)
        if (name := f"{first}_{second}") in index.postings
    )
