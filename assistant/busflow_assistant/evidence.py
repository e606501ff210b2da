"""What a unit has of an answer: numbers, units, reasons, steps, definitions."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from itertools import pairwise

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
_AMOUNT = either(r"(?<![\w.])[-−±]?\d[\d.,_]*", rf"\b(?:{_COUNTED})\b", r"\b(?:unlimited|no limit)\b")
_DURATION = either(
    _QUANTITY,
    rf"\b(?:{_COUNTED}|one|an?|last|each|every|few|some)\s+(?:\w+\s+)?{_TIME}\b",
    r"\b(?:as long as|for ever|forever|at once|immediately|at most)\b",
    r"\b(?:seconds|minutes|hours|days)\b.{0,30}\d|\d.{0,30}\b(?:seconds|minutes|hours|days)\b",
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
_LIMIT = either(
    r"\b(?:at (?:most|least|once)|max\w*|min\w*|up to|limit\w*|than|only|no more|within|range|any number|unlimited)\b",
    r"\b(?:longest|largest)\b",
)
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
_VERDICT = either(r"\b(?:can|may|cannot|must|not|no|never|only|any|both|also|even|every|all|same)\b", r"n't\b")
_DENIAL = either(
    r"\b(?:not|no|never|nothing|none|nobody|cannot|without|nor|neither|only|except|refused|instead)\b", r"n't\b"
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
    AnswerKind.AMOUNT: lambda text: bool(_AMOUNT.search(text) or _DURATION.search(text)),
    AnswerKind.LIMIT: lambda text: bool(_LIMIT.search(text)),
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
    AnswerKind.LIMIT,
    AnswerKind.VERSION,
    AnswerKind.DEFAULT,
)
"""Kinds of answers that are no answer without a number or its like."""


def lacks(question: AskedQuestion, unit: Citable) -> AnswerKind | None:
    """Return what a unit needs to be an answer and does not have."""
    wanted = question.wanted
    text = unit.text + (" default" if "default" in unit.near and unit.passage.shape is PassageShape.TABLE else "")
    if AnswerKind.LIMIT in wanted:
        text = " ".join([text, *unit.passage.headings[-1:]])
    if (
        AnswerKind.COUNT in wanted
        and unit.passage.shape is PassageShape.CODE
        and not (_COLUMNS.search(text) or valued(question, unit))
    ):
        return AnswerKind.COUNT
    return next((kind for kind in _required(question) if not _HAS[kind](text)), None)


def _required(question: AskedQuestion) -> Iterator[AnswerKind]:
    """Return the kinds that an answer has to have; how much memory is an amount, and no count."""
    wanted = question.wanted - ({AnswerKind.COUNT} if AnswerKind.AMOUNT in question.wanted else set())
    return (kind for kind in _REQUIRED if kind in wanted)


def forms(question: AskedQuestion, text: str) -> tuple[int, int, int]:
    """Return how many of the wanted kinds of answers a text has, lacks though they need it, and has of the others."""
    needed = lacking = other = 0
    for kind in question.wanted & _HAS.keys():
        has = _HAS[kind](text)
        if kind not in _REQUIRED:
            other += has
        elif has:
            needed += 1
        else:
            lacking += 1
    return needed, lacking, other


def gives_reason(text: str) -> bool:
    """Return whether a text says why."""
    return bool(_STRONG_REASON.search(text))


def gives_verdict(text: str) -> bool:
    """Return whether a text allows, forbids or restricts something."""
    return bool(_VERDICT.search(text))


def denies(text: str) -> bool:
    """Return whether a text says what is not."""
    return bool(_DENIAL.search(text))


def emptiness(question: AskedQuestion, unit: Citable) -> float:
    """Return how little a unit says by itself: a heading, a table's head, a command, the question's own words."""
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


def items(text: str) -> int:
    """Return how many things a sentence or row enumerates."""
    return text.count(",") + len(re.findall(r"\b(?:and|or)\b", text)) + max(0, text.count("`") // 2 - 1)


def subject(question: AskedQuestion, unit: Citable) -> float:
    """Return how far a unit's first words are what a question is about, more where it says what that is or does."""
    start = _OPENING.sub("", unit.text[:100])
    topical = _topical(question)
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


def acts(question: AskedQuestion, unit: Citable) -> bool:
    """Return whether a verb follows what the question is about, near the start of a unit."""
    if unit.passage.shape is PassageShape.CODE:
        return False
    topical = _topical(question)
    words = re.findall(r"[\w-]+", unit.text[:160])[:8]
    named = [not topical.isdisjoint(terms_of(word)) for word in words]
    last = next((n for n, (one, two) in enumerate(pairwise(named)) if one and not two), None)
    return last is not None and bool(_VERB.fullmatch(words[last + 1]))


def _topical(question: AskedQuestion) -> frozenset[str]:
    """Return the stems of the words that say what a question is about."""
    return frozenset(one for term in question.terms if term.weight >= GENERAL + 0.1 for one in term.stems)


def valued(question: AskedQuestion, unit: Citable) -> float:
    """1 if a word that is asked for stands beside a number: `exit code 3`, `32 viewers`."""
    return float(bool(question.heads) and counted(unit.text, frozenset(question.heads[-1:])))


def counted(text: str, stems: frozenset[str]) -> bool:
    """Return whether one of some words stands beside a number: `exit code 3`, `32 viewers`, `queue of ten`."""
    words = raw_words(text)
    for n, word in enumerate(words):
        if terms_of(word)[0] in stems:
            behind = n + 3 if words[n + 1 : n + 2] == ["of"] else n + 2
            if any(NUMBER.fullmatch(each) for each in (*words[max(0, n - 2) : n], *words[n + 1 : behind])):
                return True
    return False
