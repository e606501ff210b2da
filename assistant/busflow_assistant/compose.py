"""The units of an answer, as citations: a list as a whole, else sentences with those that belong to them."""

from __future__ import annotations

import re
from collections.abc import Container, Iterator, Mapping, Sequence

from busflow_assistant.answer import Citation
from busflow_assistant.answer_kinds import AnswerKind
from busflow_assistant.matching import Matched
from busflow_assistant.passages import Extent, PassageShape
from busflow_assistant.question import AskedQuestion
from busflow_assistant.rank import Ranked
from busflow_assistant.read import LONGEST, alike, body, lists
from busflow_assistant.search_index import Citable, SearchIndex

MOST = 3
"""Citations of an answer."""
CLOSE = 0.75
"""The least score of a further citation, as a share of the best one's."""
COMPLEMENT = 0.4
"""The same of a citation that has a part of the question which those before have not."""
GOOD_PART = 0.2
SURE = 0.65
"""How well a term has to be matched to count as answered."""
RELATED = 0.55
"""The least score of a sentence that is cited with the one before it, as a share of that one's."""
_REFERS = re.compile(
    r"^\W*(?:It|Its|They|Their|Them|This|That|These|Those|Such|So|Then|Otherwise|Both|Here|Therefore|One)\b"
    r"|^The (?:method|other)\b"
    r"|\b(?:is|are) then\b"
)
"""How a sentence begins that goes on with what the one before says."""
_CONTINUES = {AnswerKind.REASON, AnswerKind.METHOD, AnswerKind.FUNCTION, AnswerKind.DIFFERENCE}


def composed(
    question: AskedQuestion,
    matched: Sequence[Matched],
    index: SearchIndex,
    ranked: Sequence[Ranked],
    scope: Container[int],
) -> tuple[Citation, ...]:
    """Return the citations of an answer, the best first."""
    groups: list[tuple[float, Sequence[Citable]]] = []
    covered: frozenset[str] = frozenset()
    for score, group in _groups(question, matched, index, ranked, scope):
        if len(groups) == MOST or (groups and score < COMPLEMENT * groups[0][0]):
            break
        words = _covers(matched, group)
        close = not groups or score >= CLOSE * groups[0][0] or _adds(matched, words - covered)
        if close and not any(unit in other for _, other in groups for unit in group):
            groups.append((score, group))
            covered |= words
    return tuple(cited(score, group) for score, group in groups)


def _covers(matched: Sequence[Matched], group: Sequence[Citable]) -> frozenset[str]:
    """The words of the question that some units have."""
    return frozenset(each.term.word for each in matched if any(each.best(unit.own) >= SURE for unit in group))


def _adds(matched: Sequence[Matched], words: frozenset[str]) -> bool:
    """True if words that the citations before do not have are a good part of the question."""
    total = sum(each.weight for each in matched) or 1.0
    return (
        sum(each.weight for each in matched if each.term.word in words and each.term.weight >= 0.6) / total >= GOOD_PART
    )


def _groups(
    question: AskedQuestion,
    matched: Sequence[Matched],
    index: SearchIndex,
    ranked: Sequence[Ranked],
    scope: Container[int],
) -> Iterator[tuple[float, Sequence[Citable]]]:
    whole = lists(question, matched, index, ranked, scope) if AnswerKind.LIST in question.wanted else []
    best = ranked[0]
    if whole and whole[0].score >= best.score:
        yield whole[0].score, whole[0].units
    elif AnswerKind.LIST in question.wanted and best.unit.passage.shape is PassageShape.CODE:
        lines = alike(best, question, ranked)
        if lines[-1].span.end - lines[0].span.start <= LONGEST:
            yield best.score, lines
    scores = {each.unit.number: each.score for each in ranked}
    for each in ranked:
        yield each.score, _with_neighbours(each.unit, question, index, scores, scope)


def _with_neighbours(
    unit: Citable, question: AskedQuestion, index: SearchIndex, scores: Mapping[int, float], scope: Container[int]
) -> list[Citable]:
    """A sentence with the one before that it refers to, and the one after that goes on with it."""
    group = [unit]
    if unit.passage.shape is PassageShape.CODE:
        return [unit, *body(index, unit, command=AnswerKind.METHOD not in question.wanted)]
    if unit.passage.shape is PassageShape.TABLE:
        return group
    before, after = unit.number - 1, unit.number + 1
    if before in scope and _goes_on(index, before, unit.number) and _REFERS.search(unit.text):
        group.insert(0, index.units[before])
    if after in scope and _goes_on(index, unit.number, after):
        follows = index.units[after]
        related = scores.get(after, 0.0) >= RELATED * scores.get(unit.number, 1.0)
        if _REFERS.match(follows.text) or related or question.wanted & _CONTINUES:
            group.append(follows)
    return group


def _goes_on(index: SearchIndex, one: int, two: int) -> bool:
    """True if two units are sentences of one paragraph or item."""
    if not 0 <= one < two < len(index.units):
        return False
    first, second = index.units[one], index.units[two]
    return first.passage is second.passage and not first.page.source[first.span.end : second.span.start].strip()


def cited(score: float, group: Sequence[Citable]) -> Citation:
    """Return the citation of units of one passage, from the first to the last."""
    page, span = group[0].page, Extent(group[0].span.start, group[-1].span.end)
    return Citation(page.name, span, page.text(span), round(score, 3))
