"""The data files of the assistant: words without a topic, synonyms of the field, other languages."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType

LANGUAGES = ("german", "spanish")
"""Languages of questions beside English, by the stemmer's name."""


@dataclass(frozen=True, slots=True)
class Language:
    """What is known of a language: its function words, and what others are in English."""

    name: str
    refusal: str
    """A sentence that says that the text has no answer."""
    stop_words: frozenset[str]
    english: Mapping[tuple[str, ...], str]
    """A word, or a phrase of several, → English words."""


@cache
def stop_words() -> frozenset[str]:
    """Return the English words that carry no topic."""
    return frozenset(word for line in _lines("stop_words") for word in line.split())


@cache
def tiny_words() -> frozenset[str]:
    """Return those of them that say nothing even beside others."""
    return frozenset(word for line in _lines("tiny_words") for word in line.split())


@cache
def general_words() -> frozenset[str]:
    """Return the English words that any subject uses."""
    return frozenset(word for line in _lines("general_words") for word in line.split())


@cache
def irregular_forms() -> Mapping[str, str]:
    """Return irregular forms, each with its word."""
    groups = [line.split() for line in _lines("irregular")]
    return MappingProxyType({form: first for first, *forms in groups for form in forms})


@cache
def synonyms() -> Mapping[str, frozenset[str]]:
    """Return each word of the field with the others that may stand for it."""
    found: defaultdict[str, set[str]] = defaultdict(set)
    for line in _lines("synonyms"):
        group = line.split()
        for word in group:
            found[word].update(each for each in group if each != word)
    return MappingProxyType({word: frozenset(others) for word, others in found.items()})


@cache
def language(name: str) -> Language:
    """Return a language of `LANGUAGES`."""
    refusal = ""
    stop: set[str] = set()
    english: dict[tuple[str, ...], str] = {}
    for line in _lines(name):
        word, _, rest = line.partition(" ")
        if word == "refusal":
            refusal = rest
        elif word == "stop":
            stop.update(rest.split())
        else:
            english[tuple(word.split("_"))] = rest
    return Language(name, refusal, frozenset(stop), MappingProxyType(english))


def _lines(name: str) -> Iterator[str]:
    text = resources.files("busflow_assistant").joinpath(f"data/{name}.txt").read_text(encoding="utf-8")
    return (line for line in text.splitlines() if line and not line.startswith("#"))
