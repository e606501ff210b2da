"""Words of a text and of identifiers, by their stems."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import lru_cache
from typing import Any, Protocol, cast

import snowballstemmer  # pyright: ignore[reportMissingTypeStubs]  # it has none

from busflow_assistant.lexicon import irregular_forms


class _Stemmer(Protocol):
    def stemWord(self, word: str) -> str: ...  # noqa: N802  # the library's name


_WORD = re.compile(r"[A-Za-z](?:\+\+|#)(?!\w)|\d+(?:\.\d+)+|\w+")
_PART = re.compile(r"[A-Z]+(?![a-zà-ÿ])|[A-Z]?[^\W\dA-Z_]+|\d+")
_STEMMERS = {
    name: cast("_Stemmer", cast("Any", snowballstemmer).stemmer(name)) for name in ("english", "german", "spanish")
}


def raw_words(text: str) -> list[str]:
    """Return the words of a text as they are written; an identifier is one.

    >>> raw_words("Is `rate_hz:=50` at 10.5, C++?")
    ['Is', 'rate_hz', '50', 'at', '10.5', 'C++']
    """
    return _WORD.findall(text)


@lru_cache(maxsize=65536)
def stem(word: str, language: str = "english") -> str:
    """Return what a word has in common with its other forms.

    >>> stem("Publishes"), stem("written"), stem("10")
    ('publish', 'write', '10')
    """
    word = word.casefold()
    if language == "english":
        word = irregular_forms().get(word, word)
        if word.endswith("ly") and len(word) > 5:
            word = word.removesuffix("ly")  # slowly, directly
    return _STEMMERS[language].stemWord(word)


@lru_cache(maxsize=65536)
def terms_of(word: str) -> tuple[str, ...]:
    """Return what a word is found by: its stem, and of an identifier also the stems of its parts.

    >>> terms_of("sensor_processor"), terms_of("JointState"), terms_of("50ms")
    (('sensor_processor', 'sensor', 'processor'), ('jointstate', 'joint', 'state'), ('50ms', '50', 'ms'))
    """
    parts = _PART.findall(word)
    if len(parts) < 2 or not (word.isascii() and re.fullmatch(r"\w+", word)) or parts[-1].isupper() > ("_" in word):
        return (stem(word),)
    return (word.casefold(), *map(stem, parts))


def terms(text: str) -> Iterator[str]:
    """Return the terms of all words of a text."""
    for word in raw_words(text):
        yield from terms_of(word)
