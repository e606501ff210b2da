"""Whether a text supports a sentence that a model wrote: its numbers, names, negations and words."""

from __future__ import annotations

import re
from collections.abc import Iterator
from enum import StrEnum

from busflow_assistant.lexicon import general_words, stop_words
from busflow_assistant.passages import Extent
from busflow_assistant.sentences import sentences
from busflow_assistant.words import raw_words, stem, terms, terms_of

LEAST_WORDS = 0.75
"""The share of a sentence's words of content that the text has to have."""
_COUNTED = ("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
_NUMBERS: dict[str, str] = {word: str(number) for number, word in enumerate(_COUNTED)} | {
    "twenty": "20",
    "thirty": "30",
    "fifty": "50",
    "hundred": "100",
    "thousand": "1000",
}
_UNITS = {
    form: forms.split()[0]
    for forms in (
        "hz hertz",
        "khz kilohertz",
        "s sec secs second seconds",
        "ms millisecond milliseconds",
        "min minute minutes",
        "h hour hours",
        "d day days",
        "m meter meters metre metres",
        "rad radian radians",
        "kb kilobyte kilobytes",
        "mb megabyte megabytes",
        "mib mebibyte",
        "kib kibibyte",
        "gb gigabyte gigabytes",
        "% percent",
        "v volt volts",
        "kg kilogram kilograms",
    )
    for form in forms.split()
}
_NUMBER = re.compile(rf"(?<![\w.])(-?\d+(?:[.,]\d+)*|{'|'.join(_NUMBERS)})(?:[ -]?([A-Za-z]+|%))?(?!\w)", re.IGNORECASE)
_NEGATION = re.compile(
    r"\b(?:not|no|never|none|nothing|nobody|neither|nor|cannot|without|except)\b|n['’]t\b", re.IGNORECASE
)
_NAME = re.compile(r"[_/@:=]|\w\.\w|--\w|[a-z][A-Z]|^[A-Z]{2,}|\d")


class Unsupported(StrEnum):
    """What a sentence has that the text has not."""

    NUMBER = "number"
    NAME = "name"
    NEGATION = "negation"
    WORDS = "words"
    NOTHING = "nothing"
    """It says nothing that could be checked."""


def unsupported(sentence: str, text: str) -> Unsupported | None:
    """Return what a text does not support in a sentence; None if it supports all.

    >>> unsupported("It runs at 30 Hz.", "A pump runs at 20 Hz.")
    <Unsupported.NUMBER: 'number'>
    """
    if not _numbers(sentence) <= _numbers(text):
        return Unsupported.NUMBER
    known = text.casefold()
    if any(name.casefold() not in known for name in _names(sentence)):
        return Unsupported.NAME
    content = list(_content(sentence))
    if not content and not _numbers(sentence):
        return Unsupported.NOTHING
    had = frozenset(terms(text))
    if sum(word in had for word in content) < LEAST_WORDS * len(content):
        return Unsupported.WORDS
    return Unsupported.NEGATION if _negated(sentence) != _negated(_nearest(content, text)) else None


def _numbers(text: str) -> frozenset[tuple[str, str]]:
    """Return each number with its unit, and by itself where the unit is none."""
    found: set[tuple[str, str]] = set()
    for number, word in _NUMBER.findall(text):
        value = _NUMBERS.get(number.casefold()) or number.replace(",", "")
        value = value.rstrip("0").rstrip(".") if "." in value else value
        found.add((value, _UNITS.get(word.casefold(), "")))
        found.add((value, ""))
    return frozenset(found)


def _names(sentence: str) -> Iterator[str]:
    """Identifiers, and words with a capital that does not begin the sentence."""
    for position, chunk in enumerate(sentence.split()):
        bare = chunk.strip(".,;:!?\"'“”‘’()[]{}`*")
        if not bare or bare.casefold() in _NUMBERS or re.fullmatch(r"[-\d.,]+[A-Za-z%]*", bare):
            continue
        if _NAME.search(bare) or (position and bare[0].isupper() and bare.casefold() not in stop_words()):
            yield bare


def _content(sentence: str) -> Iterator[str]:
    for word in raw_words(sentence):
        lower = word.casefold()
        checked_elsewhere = lower in _NUMBERS or lower in _UNITS or lower[0].isdigit()
        if lower not in stop_words() and lower not in general_words() and not checked_elsewhere:
            yield terms_of(word)[0]


def _nearest(content: list[str], text: str) -> str:
    """Return the sentence of the text that has most of some words."""
    found = [text[each.start : each.end] for each in sentences(text, Extent(0, len(text)))] or [text]
    wanted = frozenset(map(stem, content))
    return max(found, key=lambda each: len(wanted & frozenset(terms(each))))


def _negated(sentence: str) -> bool:
    return len(_NEGATION.findall(sentence)) % 2 == 1
