"""The units of a scope, best first, and whole lists and tables beside them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice

from busflow_assistant.answer_kinds import AnswerKind
from busflow_assistant.features import Compared, Sought
from busflow_assistant.matching import Matched
from busflow_assistant.passages import Extent, PassageShape
from busflow_assistant.question import AskedQuestion
from busflow_assistant.search_index import Citable, SearchIndex

LONGEST = 2_500
"""Characters of the longest list or table that is cited as a whole."""
_WITH_TERMS = 120
"""Units that are compared, of those with a term of the question."""
_CANDIDATES = 200
"""The same with those beside them."""


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


def candidates(matched: Sequence[Matched], index: SearchIndex, scope: Container[int]) -> list[int]:
    """Return the units of a scope that have a term of the question, those with most of it first, then those beside."""
    weights: dict[int, float] = {}
    for each in matched:
        best: dict[int, float] = {}
        for variant, quality in each.variants.items():
            for number in index.postings[variant]:
                if number in scope and quality > best.get(number, 0.0):
                    best[number] = quality
        for number, quality in best.items():
            weights[number] = weights.get(number, 0.0) + each.weight * quality
    with_terms = sorted(weights, key=lambda number: -weights[number])[:_WITH_TERMS]
    return [*with_terms, *islice(_beside(with_terms, index, scope), _CANDIDATES - len(with_terms))]


def _beside(numbers: Sequence[int], index: SearchIndex, scope: Container[int]) -> Iterator[int]:
    """Yield the units beside others in one passage: a sentence that goes on need not have the topic's words again."""
    seen = set(numbers)
    for number in numbers:
        passage = index.units[number].passage
        for other in (number - 1, number + 1):
            if other in scope and other not in seen:
                unit = index.units[other]
                if unit.passage is passage and unit.may_answer:
                    seen.add(other)
                    yield other


def rank(question: AskedQuestion, matched: Sequence[Matched], index: SearchIndex, scope: Iterable[int]) -> list[Ranked]:
    """Return the units of a scope that may answer a question, the best first."""
    sought = Sought(question, matched, index)
    found = [_ranked(sought, unit) for unit in answers(question, matched, index, scope)]
    numbered = any(each.term.word.replace(".", "").isdigit() for each in matched)
    best = found if numbered else _without_repeats(found)
    return sorted(best, key=lambda each: (-each.score, each.unit.number))


def answers(
    question: AskedQuestion, matched: Sequence[Matched], index: SearchIndex, scope: Iterable[int]
) -> list[Citable]:
    """Return what may answer a question: units, and for a question that asks for several things whole lists."""
    inside = scope if isinstance(scope, range | set | frozenset) else set(scope)
    numbers = candidates(matched, index, inside)
    wholes = list(_wholes(index, numbers, inside)) if AnswerKind.LIST in question.wanted else []
    return [index.units[number] for number in numbers] + wholes


def _wholes(index: SearchIndex, numbers: Iterable[int], scope: Container[int]) -> Iterator[Citable]:
    """Yield the lists and tables of some units as wholes, as far as they are in the scope."""
    passages = {id(index.units[number].passage): index.units[number] for number in numbers}
    for unit in passages.values():
        units = units_of(index, unit, scope)
        if unit.passage.shape in {PassageShape.TABLE, PassageShape.LIST} and len(units) > 1:
            span = Extent(units[0].span.start, units[-1].span.end)
            if len(span) <= LONGEST:
                own = Counter[str]()
                for each in units:
                    own.update(each.own)
                head = frozenset(units[0].own) if unit.passage.shape is PassageShape.TABLE else frozenset[str]()
                yield replace(units[0], span=span, own=own, near=units[0].near | head, whole=True)


def units_of(index: SearchIndex, unit: Citable, scope: Container[int]) -> list[Citable]:
    """Return the units of a unit's passage, as far as they are in the scope."""
    first = unit.number - unit.passage.units.index(unit.span) if not unit.whole else unit.number
    return [index.units[n] for n in range(first, first + len(unit.passage.units)) if n in scope]


def _ranked(sought: Sought, unit: Citable) -> Ranked:
    compared = Compared(sought, unit)
    return Ranked(unit, compared.score, compared.support, compared.own)


def _without_repeats(found: Iterable[Ranked]) -> list[Ranked]:
    """Return one of the lines of code or output that differ only in numbers: the first, which is the usual case."""
    kept: dict[object, Ranked] = {}
    for each in sorted(found, key=lambda each: each.unit.number):
        words = frozenset(term for term in each.unit.own if not term[0].isdigit())
        repeated = each.unit.passage.shape is PassageShape.CODE and len(words) > 1
        key = (each.unit.page.name, words) if repeated else (each.unit.number, each.unit.whole)
        before = kept.setdefault(key, each)
        if each.score > before.score:
            kept[key] = replace(before, score=each.score)
    return list(kept.values())
