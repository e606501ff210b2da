"""The kinds of answers that questions want, and the words by which a question shows it."""

from __future__ import annotations

import re
from enum import StrEnum

from busflow_assistant.patterns import either


class AnswerKind(StrEnum):
    """A kind of answer."""

    RATE = "rate"
    DURATION = "duration"
    COUNT = "count"
    AMOUNT = "amount"
    LIMIT = "limit"
    VERSION = "version"
    DEFAULT = "default"
    LIST = "list"
    DEFINITION = "definition"
    FUNCTION = "function"
    REASON = "reason"
    METHOD = "method"
    DIFFERENCE = "difference"
    YES_OR_NO = "yes or no"
    NEGATION = "negation"


_SIZES = "big|large|high|tall|wide|fast|far|deep|small|much|heavy"
_QUANTITIES = (
    "mass|weight|length|height|width|depth|radius|diameter|distance|range|speed|velocity|voltage|current|power|torque|force"
    "|temperature|price|cost|resolution|bandwidth|latency|percentage|size|capacity|angle"
)
_TIMES = "seconds|minutes|hours|days|ms|milliseconds"
_SHOWN_BY = {
    AnswerKind.RATE: either(
        r"\bhow (often|frequently)\b",
        r"\b(rate|frequency|hz|hertz)\b",
        r"\bhow many times (per|a|each)\b",
        r"\b(which|what) period\b",
    ),
    AnswerKind.DURATION: either(
        r"\bhow (long|late|soon|quickly)\b",
        rf"\b(in|how many) ({_TIMES})\b",
        rf"\bafter (how many|what) (time|{_TIMES})\b",
        r"\bhow much time\b",
    ),
    AnswerKind.COUNT: either(r"\bhow (many|much)\b", r"(^|\b(the|what|which|m(ax|in)\w*|highest|lowest) )number of\b"),
    AnswerKind.AMOUNT: either(
        rf"\bhow ({_SIZES})\b",
        rf"\b(?:what|which|what's)(?: \w+)*? (?:{_QUANTITIES})\b",
        r"\b(maxim(?:um|al)|minim(?:um|al)|biggest|largest|smallest|highest|lowest|max|min)\b",
    ),
    AnswerKind.LIMIT: either(r"\bat (?:most|once)\b", r"\bmax(?:im\w+)?\b", r"\blimits?\b"),
    AnswerKind.VERSION: either(r"\b(which|what) release\b", r"\bversion\b"),
    AnswerKind.DEFAULT: either(r"\bdefaults?\b", r"\bby itself\b", r"\bunless\b", r"\bif (i|you) (give|say|set) no\b"),
    AnswerKind.REASON: either(r"\bwhy\b", r"\breason\b", r"\bwhat for\b", r"\bhow come\b"),
    AnswerKind.METHOD: either(
        rf"^how (?!often|frequently|long|late|soon|many|{_SIZES})",
        r"\bhow (do|can|could|would|should|must|to|i|you|we|is it possible)\b",
        r"\bway to\b",
        r"\bwhat (must|do|should) (i|you|we)\b",
        r"\b(which|what) (command|option|flag|key|line)\b",
    ),
    AnswerKind.DEFINITION: either(
        r"\bwhat( exactly)? (is|are|was)\b",
        r"\bwhat'?s\b",
        r"\b(stands?|stand) for\b",
        r"\bwhat stands\b",
        r"\bmean(s|ing)?\b",
        r"\bdefin",
        r"\bexplain\b",
    ),
    AnswerKind.FUNCTION: either(
        r"\bwhat (does|do|did)\b", r"\b(does|do) what\b", r"\bpurpose\b", r"\b(good|used) for\b", r"\brole of\b"
    ),
    AnswerKind.DIFFERENCE: either(r"\bdiffer", r"\bcompared? (to|with)\b", r"\bversus\b", r"\bvs\b"),
    AnswerKind.YES_OR_NO: either(
        r"^\W*(?:is|are|was|were|do|does|did|has|have|can|could|may|must|should|will|would)\b"
    ),
    AnswerKind.NEGATION: either(r"\b(?:not|no|never|nothing|without|cannot)\b", r"n't\b"),
}
_VERBS = "is|are|was|were|be|do|does|did|has|have|had|can|could|may|must|should|will|would|happens?|of|in|on|the|a"
_LIST = either(
    r"^(please )?(list|name|enumerate|give me (a list|all))\b",
    rf"\b(what|which)( (?!({_VERBS})\b)\w+){{0,2}} (\w*[^\Wsui]s|people|criteria)\b(?! (is|the|does)\b)",
    r"\bwhat (are|were) (the |all )?(\w+ ){0,2}?\w*[^\Wsui]s\b",
    r"\ball (the|of|its)\b",
    r"\bin (which|what) cases\b",
    r"\bas what\b",
    r"\bwhat can be\b",
    r"\bwhich (of|\d+|things)\b",
)
_NO_LIST = either(r"\b(what|which) (does|is|was|has|happens|means|process|class|this|status|progress|s)\b")
_EXPLICIT = either(r"\bhow (often|long|frequently)\b")


def answer_kinds(question: str) -> frozenset[AnswerKind]:
    """Return the kinds of answers that an English question may want.

    >>> sorted(answer_kinds("How often is it published, and which topics are there?"))
    [<AnswerKind.LIST: 'list'>, <AnswerKind.RATE: 'rate'>]
    """
    text = re.sub(r"\s+", " ", question.casefold().replace("’", "'")).strip()
    wanted = {kind for kind, pattern in _SHOWN_BY.items() if pattern.search(text)}
    if _LIST.search(text) and not _NO_LIST.search(text):
        wanted.add(AnswerKind.LIST)
    if AnswerKind.DURATION in wanted:
        wanted -= {AnswerKind.COUNT}  # how much time, how many seconds
    if AnswerKind.METHOD in wanted and not _EXPLICIT.search(text):
        wanted -= {AnswerKind.RATE, AnswerKind.DURATION, AnswerKind.AMOUNT}  # how to set a rate asks for no rate
    return frozenset(wanted)
