"""When the text does not answer: what must be there, and the sentence that says what the text speaks of."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from busflow_assistant.answer import Answer, Reason
from busflow_assistant.answer_kinds import AnswerKind
from busflow_assistant.evidence import lacks, valued
from busflow_assistant.lexicon import LANGUAGES, language
from busflow_assistant.markdown import title
from busflow_assistant.matching import Matched
from busflow_assistant.question import AskedQuestion
from busflow_assistant.rank import Ranked
from busflow_assistant.search_index import SearchIndex

SELECTED = 0.3
"""The least support within a selection: the reader has pointed at it."""
ELSEWHERE = 0.42
"""The least support on a page."""
UNLIKE = 0.3
"""The similarity below which a unit speaks of something else, where its words leave room for doubt."""
UNSURE = 0.5
"""The support below which they do."""
NEARBY = 0.3
"""The least support of a passage whose heading a refusal names."""
UNASKED = 0.85
"""What support is worth where the word that was asked for is not there."""
_TOPICS = 3
_TOPIC_CHARACTERS = 80
_SAID = {
    Reason.NOT_SAID: "The text does not say that.",
    Reason.OFF_TOPIC: "The text is not about that.",
    Reason.ORDER: "That is no question about the text, and the assistant does nothing but answer from it.",
    Reason.EMPTY: "There is no text to answer from.",
    Reason.NO_QUESTION: "Ask a question about the text.",
    Reason.UNKNOWN_PAGE: "This page is not among those that the assistant has read.",
}


def sufficient(question: AskedQuestion, matched: Sequence[Matched], best: Ranked, *, selected: bool) -> bool:
    """Return whether the best unit says what was asked."""
    if best.similarity is not None and best.similarity < UNLIKE and best.support < UNSURE:
        return False
    if is_foreign(matched) or _asks_for_unknown(question, matched) or lacks(question, best.unit) is not None:
        return False
    if AnswerKind.DIFFERENCE in question.wanted and any(_is_topic(each) and not each.variants for each in matched):
        return False
    if AnswerKind.COUNT in question.wanted and not selected and not _counts(question, matched, best):
        return False
    support = best.support
    if question.heads and not _has(question.heads[-1], matched, best):
        if question.wanted & {AnswerKind.COUNT, AnswerKind.AMOUNT, AnswerKind.VERSION}:
            return False
        support *= UNASKED
    return support >= (SELECTED if selected else ELSEWHERE)


def refusal(
    reason: Reason, question: AskedQuestion, index: SearchIndex, scope: Iterable[int], ranked: Sequence[Ranked]
) -> Answer:
    """Return a refusal in words, which says what the text does speak of."""
    said = [language(question.spoken).refusal] if question.spoken in LANGUAGES else []
    titles = [f"“{title(page)}”" for page in index.pages.values() if page.name]
    topics = list(_topics(index, scope, ranked)) or titles[:1]
    speaks = f"It speaks of {_joined(topics)}." if topics else ""
    return Answer(" ".join([*said, _SAID[reason], *([speaks] if speaks else [])]), reason=reason)


def is_foreign(matched: Sequence[Matched]) -> bool:
    """Return whether a question is about things of which the text has no word, nor one that stands for it."""
    named = [each for each in matched if each.term.weight >= 1.0]
    unknown = [each for each in named if not each.variants]
    return len(unknown) > 1 or 2 * len(unknown) >= max(1, len(named)) or any(each.term.literal for each in unknown)


def _asks_for_unknown(question: AskedQuestion, matched: Sequence[Matched]) -> bool:
    """True if the first word of what is asked for is not in the text: `focal` of "which focal length"."""
    return (
        any(not each.variants and question.heads[0] in each.term.stems for each in matched) if question.heads else False
    )


def _is_topic(each: Matched) -> bool:
    return each.term.weight >= 0.6


def _counts(question: AskedQuestion, matched: Sequence[Matched], best: Ranked) -> bool:
    """True if a number of the unit is one of what was asked for, as far as its place shows."""
    literal = any(each.term.literal and each.best(best.unit.own) for each in matched)
    return literal or bool(valued(question, best.unit))


def _has(head: str, matched: Sequence[Matched], best: Ranked) -> bool:
    """True if a word that is asked for, or a synonym, stands in a unit or around it."""
    each = next((each for each in matched if head in each.term.stems), None)
    return each is None or any(each.best(terms) for terms in (best.unit.own, best.unit.near, best.unit.above))


def _topics(index: SearchIndex, scope: Iterable[int], ranked: Sequence[Ranked]) -> Iterator[str]:
    """The headings nearest to the question, then the first ones of the text."""
    near = [each.unit for each in ranked[:_TOPICS] if each.support >= NEARBY]
    units = [*near, *(index.units[number] for number in scope)]
    seen: set[str] = set()
    for unit in units:
        heading = next(iter(unit.passage.headings[1:2]), "")
        topic = heading.lstrip("0123456789. ")[:_TOPIC_CHARACTERS]
        if topic and topic not in seen:
            seen.add(topic)
            yield f"“{topic}”"
        if len(seen) == _TOPICS:
            return


def _joined(topics: Sequence[str]) -> str:
    """A sentence's list.

    >>> _joined(["a"]), _joined(["a", "b", "c"])
    ('a', 'a, b and c')
    """
    return topics[0] if len(topics) == 1 else f"{', '.join(topics[:-1])} and {topics[-1]}"
