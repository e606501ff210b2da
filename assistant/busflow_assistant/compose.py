"""The units of an answer, as citations: a list as a whole, else sentences with those that belong to them."""

from __future__ import annotations

import re
from collections.abc import Container, Iterator, Sequence
from itertools import takewhile

from busflow_assistant.answer import Citation
from busflow_assistant.answer_kinds import AnswerKind
from busflow_assistant.code_lines import alike, body
from busflow_assistant.passages import Extent, PassageShape
from busflow_assistant.question import AskedQuestion
from busflow_assistant.rank import LONGEST, Ranked, units_of
from busflow_assistant.search_index import Citable, SearchIndex, indent

MOST = 3
"""Citations of an answer."""
CLOSE = 4.0
"""How much lower the score of a further citation may be than the best one's."""
WORDS = 45
"""Words of a citation up to which the sentences beside it belong to it: a sentence by itself is often no answer."""
LED_TO = 800
"""Characters of the longest list or block of code that is cited with the sentence that leads to it."""
_REFERS = re.compile(
    r"^\W*(?:It|Its|They|Their|Them|This|That|These|Those|Such|So|Then|Otherwise|Both|Here|Therefore|One)\b"
    r"|^The (?:method|other)\b"
    r"|\b(?:is|are) then\b"
)
"""How a sentence begins that goes on with what the one before says."""


def composed(
    question: AskedQuestion, index: SearchIndex, ranked: Sequence[Ranked], scope: Container[int]
) -> tuple[Citation, ...]:
    """Return the citations of an answer, the best first."""
    least = ranked[0].score - CLOSE
    groups: list[tuple[float, Sequence[Citable]]] = []
    for each, group in _groups(question, index, ranked, scope):
        if len(groups) == MOST or each.score < least:
            break
        if not any(unit in other for _, other in groups for unit in group):
            groups.append((each.score, group))
    return tuple(cited(score, group) for score, group in groups)


def _groups(
    question: AskedQuestion, index: SearchIndex, ranked: Sequence[Ranked], scope: Container[int]
) -> Iterator[tuple[Ranked, Sequence[Citable]]]:
    """Yield the units of each citation that there may be, the best first."""
    best = ranked[0]
    if AnswerKind.LIST in question.wanted and best.unit.passage.shape is PassageShape.CODE:
        lines = alike(best, question, ranked)
        if lines[-1].span.end - lines[0].span.start <= LONGEST:
            yield best, lines
    for each in ranked:
        if each.unit.whole:
            yield each, _led_to(index, units_of(index, each.unit, scope), scope)
        else:
            yield each, _leads_on(question, index, _with_neighbours(each.unit, question, index, scope), scope)


def _led_to(index: SearchIndex, units: list[Citable], scope: Container[int]) -> list[Citable]:
    """Return a list with the sentence that leads to it."""
    before = units[0].number - 1
    if before in scope and index.units[before].text.endswith(":") and index.units[before].page is units[0].page:
        return [index.units[before], *units]
    return units


def _leads_on(
    question: AskedQuestion, index: SearchIndex, group: list[Citable], scope: Container[int]
) -> list[Citable]:
    """Sentences with the short list or code that they lead to."""
    if below := _below(index, group[-1], scope):
        return [*group, *below]
    after = group[-1].number + 1
    if after not in scope or index.units[after].page is not group[-1].page:
        return group
    units = units_of(index, index.units[after], scope)
    shape, size = units[0].passage.shape, units[-1].span.end - units[0].span.start
    if units[0].passage is group[-1].passage or size > LED_TO or group[-1].passage.shape is not PassageShape.PROSE:
        return group
    leads = group[-1].text.endswith(":") and shape is not PassageShape.PROSE
    lists = AnswerKind.LIST in question.wanted and shape in {PassageShape.LIST, PassageShape.TABLE}
    return [*group, *units] if (leads or lists) and shape is not PassageShape.HEADING else group


def _below(index: SearchIndex, item: Citable, scope: Container[int]) -> list[Citable]:
    """Return the items below one that leads to them."""
    if item.passage.shape is not PassageShape.LIST or not item.text.endswith(":"):
        return []
    after = (unit for unit in units_of(index, item, scope) if unit.number > item.number)
    found = list(takewhile(lambda unit: indent(unit) > indent(item), after))
    return found if found and found[-1].span.end - item.span.start <= LED_TO else []


def _with_neighbours(
    unit: Citable, question: AskedQuestion, index: SearchIndex, scope: Container[int]
) -> list[Citable]:
    """Return a sentence with the one before that it refers to, and those beside it as long as all are few words."""
    if unit.passage.shape is PassageShape.CODE:
        return [unit, *body(index, unit, command=AnswerKind.METHOD not in question.wanted)]
    group = [unit]
    if unit.passage.shape is PassageShape.TABLE:
        return group
    before, after = unit.number - 1, unit.number + 1
    if before in scope and _goes_on(index, before, unit.number) and _REFERS.search(unit.text):
        group.insert(0, index.units[before])
    if after in scope and _goes_on(index, unit.number, after) and _few([*group, index.units[after]]):
        group.append(index.units[after])
    first = group[0].number
    if first - 1 in scope and _goes_on(index, first - 1, first) and _few([index.units[first - 1], *group]):
        group.insert(0, index.units[first - 1])
    return group


def _few(group: Sequence[Citable]) -> bool:
    return sum(len(each.text.split()) for each in group) <= WORDS


def _goes_on(index: SearchIndex, one: int, two: int) -> bool:
    """Return whether two units are sentences of one paragraph or item."""
    if not 0 <= one < two < len(index.units):
        return False
    first, second = index.units[one], index.units[two]
    return first.passage is second.passage and not first.page.source[first.span.end : second.span.start].strip()


def cited(score: float, group: Sequence[Citable]) -> Citation:
    """Return the citation of units of one passage, from the first to the last."""
    page, span = group[0].page, Extent(group[0].span.start, group[-1].span.end)
    return Citation(page.name, span, page.text(span), round(score, 3))
