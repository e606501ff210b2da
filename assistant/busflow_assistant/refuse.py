"""When the text does not answer: what must be there, and the sentence that says what the text speaks of."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from busflow_assistant.answer import Answer, Reason
from busflow_assistant.answer_kinds import AnswerKind
from busflow_assistant.evidence import counted, lacks, valued
from busflow_assistant.lexicon import LANGUAGES, language
from busflow_assistant.markdown import title
from busflow_assistant.matching import Matched
from busflow_assistant.question import AskedQuestion
from busflow_assistant.rank import Ranked
from busflow_assistant.search_index import SearchIndex

LEAST_SCORE = 4.0
"""The least score of an answer, less what counts against it: chosen on the question sets that may be tuned on."""
LEAST_SCORE_BY_MEANING = 4.5
"""The same where a sentence model has its say, which also speaks for a unit that is only about the same thing."""
UNKNOWN = 5.0
"""How much a word of the topic that the text has not counts against an answer; a rare or literal one more."""
LACKING = 9.0
"""The same of a number, a time or a version that was asked for and is not there."""
UNCOUNTED = 12.0
"""The same of a number that counts something else."""
SURE_AMONG = 6
"""Units that are looked at for these."""
UNLIKE = 0.3
"""The similarity below which a unit speaks of something else, where its words leave room for doubt."""
UNSURE = 0.5
"""The support below which they do."""
NEARBY = 0.3
"""The least support of a passage whose heading a refusal names."""
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


def by_certainty(question: AskedQuestion, matched: Sequence[Matched], ranked: Sequence[Ranked]) -> list[Ranked]:
    """Return units in the order in which they are certain to say what was asked, with that as their score."""
    unsure = [replace(each, score=each.score - _missing(question, matched, each)) for each in ranked[:SURE_AMONG]]
    return sorted(unsure, key=lambda each: -each.score)


def sufficient(matched: Sequence[Matched], best: Ranked) -> bool:
    """Return whether the best unit says what was asked."""
    if best.similarity is not None and best.similarity < UNLIKE and best.support < UNSURE:
        return False
    unknown = sum(each.weight for each in matched if _is_topic(each) and not each.variants)
    least = LEAST_SCORE if best.similarity is None else LEAST_SCORE_BY_MEANING
    return best.score - UNKNOWN * unknown >= least


def _missing(question: AskedQuestion, matched: Sequence[Matched], each: Ranked) -> float:
    """How much it counts against a unit that a number or its like, which was asked for, is not in it."""
    lacking = LACKING * (lacks(question, each.unit) is not None)
    return lacking + UNCOUNTED * (AnswerKind.COUNT in question.wanted and not _counts(question, matched, each))


def refusal(
    reason: Reason, question: AskedQuestion, index: SearchIndex, scope: Iterable[int], ranked: Sequence[Ranked]
) -> Answer:
    """Return a refusal in words, which says what the text does speak of."""
    said = [language(question.spoken).refusal] if question.spoken in LANGUAGES else []
    titles = [f"“{title(page)}”" for page in index.pages.values() if page.name]
    topics = list(_topics(index, scope, ranked)) or titles[:1]
    speaks = f"It speaks of {_joined(topics)}." if topics else ""
    return Answer(" ".join([*said, _SAID[reason], *([speaks] if speaks else [])]), reason=reason)


def _is_topic(each: Matched) -> bool:
    return each.term.weight >= 0.6


def _counts(question: AskedQuestion, matched: Sequence[Matched], best: Ranked) -> bool:
    """Return whether a number of the unit is one of what was asked for, as far as its place shows."""
    if any(each.term.literal and each.best(best.unit.own) for each in matched) or valued(question, best.unit):
        return True
    topical = frozenset(variant for each in matched if _is_topic(each) for variant in each.variants)
    return counted(best.unit.text, topical)


def _topics(index: SearchIndex, scope: Iterable[int], ranked: Sequence[Ranked]) -> Iterator[str]:
    """Yield the headings nearest to the question, then the first ones of the text."""
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
    """Return a sentence's list.

    >>> _joined(["a"]), _joined(["a", "b", "c"])
    ('a', 'a, b and c')
    """
    return topics[0] if len(topics) == 1 else f"{', '.join(topics[:-1])} and {topics[-1]}"
