"""What a unit has of an answer: numbers, units, reasons, steps, definitions."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from busflow_assistant.answer_kinds import AnswerKind
from busflow_assistant.passages import PassageShape
from busflow_assistant.patterns import either
from busflow_assistant.question import GENERAL, AskedQuestion
from busflow_assistant.search_index import Citable
from busflow_assistant.words import raw_words, terms_of

_COUNTED = (
    "two|three|four|five|six|seven|eight|nine|ten|eleven|twelve|twenty|thirty|fifty|hundreds?|thousands?|million|half"
    "|once|twice|dozen|both"
)
_TIME = "(?:ns|[µu]s|ms|s|min|minutes?|h|hours?|days?|weeks?|months?|years?|seconds?|milliseconds?|secs?|moment)"
_QUANTITY = rf"(?<![\w.])\d[\d.,]*\s*{_TIME}\b"
NUMBER = either(r"(?<![\w.])[-−±]?\d[\d.,_]*", rf"\b(?:{_COUNTED}|one|no)\b")
_DURATION = either(
    _QUANTITY,
    rf"\b(?:{_COUNTED}|one|an?|last|each|every|few|some)\s+(?:\w+\s+)?{_TIME}\b",
    r"\b(?:as long as|for ever|forever|at once|immediately|at most)\b",
)
_RATE = either(
    r"\d\s*k?hz\b",
    r"\bhz\b",
    r"\btimes (?:a|per|each)\b",
    rf"\b(?:every|each|per|once an?) (?:\w+ )?{_TIME}\b",
    rf"\b(?:once|twice) an? {_TIME}\b",
    r"(?:create_timer|@timer)\((?:[^()]*\W)?\d",
    _QUANTITY,
    r"/s\b",
)
_COUNT = either(
    r"(?<![\w./:\[-])\d[\d,]*(?![\w./:-])(?!\.\d)",
    rf"\b(?:{_COUNTED}|none|any number|as many|no more than one|one \w+ at a time|unlimited)\b",
)
_MEASURE = either(_QUANTITY, r"(?<![\w.])\d[\d.,]*\s*(?:k?hz|%|[kmg]i?b|bytes|rad|m)\b")
"""A number that measures and does not count."""
_COLUMNS = re.compile(r"\S {2,}\S")
_VERSION = either(r"\bv?\d+\.\d+", r"\bversions?\b", r"\b\d+ or (?:newer|later)\b")
_DEFAULT = either(
    r"\bdefaults?\b",
    r"\bunless\b",
    r"=\s*\S",
    r"\bwithout (?:one|it|a)\b",
    r"\bif (?:not|none)\b",
    r"\b(?:otherwise|initially)\b",
)
_REASON = either(r"\b(?:because|since|so|therefore|why|as|for|worse|otherwise|else)\b", ":")
_STRONG_REASON = either(
    r"\b(?:because|therefore|would)\b", r"\bso that\b", r", so\b", r"\b(?:that|which) is why\b", r"\bfor the reason\b"
)
_STEPS = (
    "Use|Call|Write|Run|Set|Add|Give|Put|Start|Open|Press|Rename|Install|Make|Let|Turn|Say|Name|Ask|Create|Declare|Begin"
    "|Leave|Take|Copy|Try|Change|Define|Configure|Enter|Type|Click|Select|Prefer"
)
_METHOD = re.compile(
    rf"\$ \w|--\w|:=|`[^`]*[(.=: ][^`]*`|\bpip install\b|^(?:[-*] )?[\"'`*]*(?:{_STEPS})\b|\bby\b|\bwith\b",
)
_VERB = re.compile(r"is|are|means?|stands?|(?!as$|its$|this$|has$)[a-z]+[^s\W]s")
"""A word that may be a verb, as far as an ending shows."""
_POSSESSIVE = re.compile(r"\W*(?:Its|Their) ")
_SPOKEN = re.compile(r"\"\"\"|\'\'\'|#|//|\w+: [A-Z]")
"""A line of code that is prose: a docstring, a comment, a data sheet's title."""
CODE_SAYS_LITTLE = 0.6
_OPENING = re.compile(r"^[\s|*`#>@\"'$-]*(?:(?:an?|the|this|each|every|its)\s+)?", re.IGNORECASE)

_HAS: Mapping[AnswerKind, Callable[[str], bool]] = {
    AnswerKind.RATE: lambda text: bool(_RATE.search(text)),
    AnswerKind.DURATION: lambda text: bool(_DURATION.search(text)),
    AnswerKind.COUNT: lambda text: bool(_COUNT.search(_MEASURE.sub(" ", text))),
    AnswerKind.AMOUNT: lambda text: bool(NUMBER.search(text)),
    AnswerKind.VERSION: lambda text: bool(_VERSION.search(text)),
    AnswerKind.DEFAULT: lambda text: bool(_DEFAULT.search(text)),
    AnswerKind.REASON: lambda text: bool(_REASON.search(text)),
    AnswerKind.METHOD: lambda text: bool(_METHOD.search(text)),
}
_REQUIRED = (
    AnswerKind.RATE,
    AnswerKind.DURATION,
    AnswerKind.COUNT,
    AnswerKind.AMOUNT,
    AnswerKind.VERSION,
    AnswerKind.DEFAULT,
)
"""Kinds of answers that are no answer without a number or its like."""


def lacks(question: AskedQuestion, unit: Citable) -> AnswerKind | None:
    """Return what a unit needs to be an answer and does not have."""
    wanted = question.wanted - ({AnswerKind.COUNT} if AnswerKind.DURATION in question.wanted else set())
    text = unit.text + (" default" if "default" in unit.near and unit.passage.shape is PassageShape.TABLE else "")
    if (
        AnswerKind.COUNT in wanted
        and unit.passage.shape is PassageShape.CODE
        and not (_COLUMNS.search(text) or valued(question, unit))
    ):
        return AnswerKind.COUNT
    return next((kind for kind in _REQUIRED if kind in wanted and not _HAS[kind](text)), None)


def fitness(question: AskedQuestion, unit: Citable) -> float:
    """Return how well a unit has the form of an answer, from about −0.5 to 1."""
    text = unit.text
    value = 0.0
    for kind in question.wanted & _HAS.keys():
        value += 0.3 if _HAS[kind](text) else -0.7 if kind in _REQUIRED else -0.05
    if AnswerKind.REASON in question.wanted and _STRONG_REASON.search(text):
        value += 0.3
    if question.wanted & {AnswerKind.DEFINITION, AnswerKind.FUNCTION}:
        value += _subject(question, unit)
    if question.wanted & {AnswerKind.COUNT, AnswerKind.AMOUNT, AnswerKind.DEFAULT} or re.search(
        r"\b(?:what|which) ", question.english, re.IGNORECASE
    ):
        value += 0.25 * valued(question, unit)
    if AnswerKind.LIST in question.wanted:
        value += 0.3 * min(1.0, _items(text) / 3)
    if text.endswith(":") and unit.passage.shape is PassageShape.PROSE and AnswerKind.METHOD not in question.wanted:
        value -= 0.1
    return value - _empty(question, unit)


def _empty(question: AskedQuestion, unit: Citable) -> float:
    """What a unit loses that says nothing by itself: a heading, a table's head, a command, the question's own words."""
    asked = {one for term in question.terms for one in (term.word, *term.stems)}
    lost = (
        0.6
        if unit.passage.shape is PassageShape.HEADING
        or (unit.passage.shape is PassageShape.TABLE and unit.span == unit.passage.units[0])
        else 0.0
    )
    if not unit.own.keys() - asked:
        lost += 0.6
    if (
        unit.passage.shape is PassageShape.CODE
        and unit.text.startswith(("$ ", "from ", "import "))
        and AnswerKind.METHOD not in question.wanted
    ):
        lost += 0.4
    elif unit.text.startswith(("from ", "import ")):
        lost += 0.3
    return lost + (0.15 if unit.text.startswith("(") else 0.0)


def _items(text: str) -> int:
    """How many things a sentence or row enumerates."""
    return text.count(",") + len(re.findall(r"\b(?:and|or)\b", text)) + max(0, text.count("`") // 2 - 1)


def _subject(question: AskedQuestion, unit: Citable) -> float:
    """A bonus for a unit whose first words are what the question is about, more where it says what that is or does."""
    start = _OPENING.sub("", unit.text[:100])
    topical = {one for term in question.terms if term.weight >= GENERAL + 0.1 for one in term.stems}
    words = re.findall(r"\w+", start)[:4]
    named = [n for n, word in enumerate(words) if topical & {*terms_of(word)}]
    if unit.passage.shape is PassageShape.CODE:
        return 0.0 if _SPOKEN.match(unit.text) else -CODE_SAYS_LITTLE
    if not named or named[0] > 2:
        return 0.0
    found = topical & {term for word in words for term in terms_of(word)}
    share = len(found) / max(1, len(topical))
    if unit.passage.shape is PassageShape.TABLE:
        return 0.4 * share + 0.2 if named[0] == 0 else 0.2 * share
    is_subject = named[0] <= 1 and not _POSSESSIVE.match(unit.text)
    says = any(_VERB.fullmatch(word) for word in re.findall(r"[^\s`*|]+", start)[1:4])
    return 0.4 * share + (0.4 if is_subject and says else 0.1)


def valued(question: AskedQuestion, unit: Citable) -> float:
    """1 if a word that is asked for stands beside a number: `exit code 3`, `32 viewers`."""
    if not question.heads:
        return 0.0
    words = raw_words(unit.text)
    stems = [{terms_of(word)[0]} for word in words]
    for n, found in enumerate(stems):
        if question.heads[-1] in found:
            beside = words[max(0, n - 2) : n] + words[n + 1 : n + 2]
            if any(NUMBER.fullmatch(word) for word in beside):
                return 1.0
    return 0.0
