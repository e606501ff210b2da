"""The extractive engine: a question and a selection → an answer of verbatim sentences, or a refusal."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from busflow_assistant.answer import Answer, AnswerScope, Citation, Reason
from busflow_assistant.code_lines import names
from busflow_assistant.compose import cited, composed
from busflow_assistant.matching import Matched, match
from busflow_assistant.orders import is_order
from busflow_assistant.passages import Extent, Page
from busflow_assistant.plain_text import read_text
from busflow_assistant.question import AskedQuestion, parts, understand
from busflow_assistant.rank import Ranked, rank
from busflow_assistant.refuse import NEARBY, by_certainty, refusal, sufficient
from busflow_assistant.search_index import SearchIndex
from busflow_assistant.selection import cut, locate

QUESTION_CHARACTERS = 2_000
"""The longest question; what is beyond is cut."""
SOME = 12
"""Characters of a sentence that make it selected."""
ELSEWHERE = "Not in your selection; the page says:"
"""The text before an answer from outside the selection."""


Reorder = Callable[[str, Sequence[Ranked]], list[Ranked]]
"""A function that reorders the units that may answer a question."""


@dataclass(frozen=True, slots=True)
class Grounds:
    """The text that a question is asked about."""

    index: SearchIndex
    selected: frozenset[int] | None = None
    """The numbers of the units that are selected; None without a selection."""
    reorder: Reorder | None = None

    @property
    def scope(self) -> range:
        """The numbers of all units."""
        return range(len(self.index.units))


class Engine:
    """Answers questions about pages from their text alone."""

    def __init__(self, pages: Iterable[Page], reorder: Reorder | None = None) -> None:
        """Create an engine for some pages; `reorder` may change the order of units, by their meaning for example."""
        known = tuple(pages)
        self._reorder = reorder
        self._book = SearchIndex(known)
        self._by_page = {page.name: SearchIndex([page]) for page in known}

    def ask(self, question: str, *, selection: str = "", page: str = "") -> Answer:
        """Answer a question about a selection, a page, or, without both, about all pages."""
        asked = understand(question[:QUESTION_CHARACTERS])
        selection = cut(selection).strip()
        grounds = self._grounds(selection, page)
        fault = self._fault(asked, selection, page)
        if fault is not None:
            return refusal(fault, asked, grounds.index, grounds.scope, ())
        ordered = is_order(asked.text)
        whole = None if ordered else _answered(asked, grounds)
        if whole is not None and whole.answered:
            return whole
        for part in parts(asked.text):
            if not is_order(part) and (answer := _answered(understand(part), grounds)).answered:
                return answer
        return whole or refusal(Reason.ORDER, asked, grounds.index, grounds.scope, ())

    def _fault(self, asked: AskedQuestion, selection: str, page: str) -> Reason | None:
        """Return the reason why there is nothing to look for, or nowhere to look."""
        if not asked.text.strip():
            return Reason.NO_QUESTION
        if page and page not in self._by_page and not selection:
            return Reason.UNKNOWN_PAGE
        return Reason.EMPTY if not self._book.units and not selection else None

    def _grounds(self, selection: str, page: str) -> Grounds:
        if not selection:
            index = self._by_page.get(page, self._book)
            return Grounds(index, None, self._reorder)
        known = page in self._by_page
        for name in [page] if known else [] if page else self._by_page:
            index = self._by_page[name]
            chosen = locate(selection, index.pages[name].source, known=known)
            if chosen is not None:
                return Grounds(index, _inside(index, chosen), self._reorder)
        pasted = SearchIndex([read_text("", selection)])
        return Grounds(pasted, frozenset(range(len(pasted.units))), self._reorder)


def _inside(index: SearchIndex, chosen: Extent) -> frozenset[int]:
    """Return the units that are selected, at least by half or by some words."""
    common = ((unit, unit.span.common(chosen)) for unit in index.units)
    return frozenset(unit.number for unit, size in common if size >= min(len(unit.span) / 2, SOME))


def _answered(asked: AskedQuestion, grounds: Grounds) -> Answer:
    """Return the selection's answer, else the page's, marked as such, else a refusal."""
    matched = match(asked, grounds.index)
    if grounds.selected is not None:
        ranked, citations = _cited(asked, matched, grounds, grounds.selected)
        if citations:
            return Answer(_text(citations), citations, AnswerScope.SELECTION)
        if len(grounds.selected) == len(grounds.scope):
            return refusal(_reason(ranked), asked, grounds.index, grounds.scope, ranked)
    ranked, citations = _cited(asked, matched, grounds, grounds.scope)
    if not citations:
        return refusal(_reason(ranked), asked, grounds.index, grounds.scope, ranked)
    text = _text(citations)
    return Answer(text if grounds.selected is None else f"{ELSEWHERE}\n{text}", citations, AnswerScope.PAGE)


def _cited(
    asked: AskedQuestion,
    matched: Sequence[Matched],
    grounds: Grounds,
    scope: range | frozenset[int],
) -> tuple[list[Ranked], tuple[Citation, ...]]:
    """Return the units of a scope, best first, and the citations of an answer if they have one."""
    index = grounds.index
    ranked = rank(asked, matched, index, scope)
    if grounds.reorder is not None:
        ranked = grounds.reorder(asked.text, ranked)
    ranked = by_certainty(asked, matched, ranked)
    if all_names := names(asked, matched, index, scope):
        return ranked, tuple(cited(1.0, group) for group in all_names)
    if ranked and sufficient(matched, ranked[0]):
        return ranked, composed(asked, index, ranked, scope)
    return ranked, ()


def _text(citations: Sequence[Citation]) -> str:
    return "\n".join(each.text for each in citations)


def _reason(ranked: Sequence[Ranked]) -> Reason:
    return Reason.NOT_SAID if ranked and ranked[0].support >= NEARBY else Reason.OFF_TOPIC
