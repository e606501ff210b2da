"""A question: its terms, its language, and what kind of answer it wants."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from busflow_assistant.answer_kinds import AnswerKind, answer_kinds
from busflow_assistant.lexicon import LANGUAGES, Language, general_words, language, stop_words
from busflow_assistant.words import raw_words, stem, terms_of


@dataclass(frozen=True, slots=True)
class Term:
    """A word of a question that a text may have."""

    word: str
    stems: tuple[str, ...]
    """The word's stem; of a word of another language those of its translations."""
    weight: float
    """How much it says about the topic: 1 for most, less for words of any subject, more for identifiers."""
    literal: bool = False
    """An identifier, a name with capitals, or a number: nothing else can stand for it."""


@dataclass(frozen=True, slots=True)
class AskedQuestion:
    """A question as it was asked, and as it is looked for."""

    text: str
    english: str
    """The question, with what is known of other languages in English."""
    spoken: str
    """The language: `english`, or one of `LANGUAGES`."""
    terms: tuple[Term, ...]
    wanted: frozenset[AnswerKind]
    heads: tuple[str, ...] = ()
    """The stems of the words that say what is asked for: `exit code` in "which exit code does it have"."""


GENERAL = 0.4
"""The weight of a word of any subject."""
ACTION = 0.6
"""The most that a verb weighs."""
LITERAL = 1.5
"""The weight of an identifier."""

_HEAD = re.compile(
    r"(?:what|which|how many|how much|name|list|all)"
    r"(?: (?:the|of|is|are|all|other|kinds?|sorts?|types?|a|an|your|possible))*(?P<words>(?: [\w+#-]+){1,3})"
)
_SUBJECTS = frozenset(
    [
        "i",
        "you",
        "we",
        "it",
        "they",
        "one",
        "to",
        "not",
        "must",
        "can",
        "should",
        "could",
        "will",
        "may",
        "does",
        "gets",
        "get",
        "got",
    ]
)
_GENERAL_STEMS = frozenset(map(stem, general_words()))
_IS = frozenset(["is", "are", "was", "were", "be", "been", "being"])
_CODE = re.compile(r"[_/@.:=()*~\d]|[a-z][A-Z]|^--|^[A-Z]{2,}")


def understand(text: str) -> AskedQuestion:
    """Return what a question asks for."""
    spoken = _language_of(text)
    known = None if spoken == "english" else language(spoken)
    english, found = (text, _terms(text)) if known is None else _translated(text, known)
    return AskedQuestion(text, english, spoken, tuple(found), answer_kinds(english), tuple(_heads(english)))


def _heads(english: str) -> Iterator[str]:
    found = _HEAD.search(" ".join(english.casefold().split()))
    for word in found["words"].split() if found else ():
        if word in stop_words():
            return
        if word not in general_words():
            yield stem(word)


def parts(text: str) -> list[str]:
    """Return the sentences of a question, if it has several; an answer to one of them is better than none.

    >>> parts("How many may wait? And put a link around it.")
    ['How many may wait?', 'And put a link around it.']
    """
    found = [each.strip() for each in re.split(r"(?<=[?!.;])\s+", text) if each.strip()]
    return found if len(found) > 1 else []


def _terms(text: str) -> list[Term]:
    found: dict[str, Term] = {}
    before = ""
    for written in _written(text):
        if (term := _term(written)) and term.word not in found:
            found[term.word] = replace(term, weight=min(term.weight, ACTION)) if _acts(before, term) else term
        before = written.casefold()
    return list(found.values())


def _acts(before: str, term: Term) -> bool:
    """Return whether a word is a verb or adverb, by the word before it; a page often has another one for the same."""
    passive = before in _IS and term.word.endswith("ed")
    return not term.literal and (before in _SUBJECTS or passive or (term.word.endswith("ly") and len(term.word) > 4))


def _written(text: str) -> Iterator[str]:
    """Yield the words as they are written, each with what makes it an identifier: `--for`, `@timer(1.0)`."""
    for chunk in text.split():
        bare = chunk.strip(".,;:!?¿¡\"'“”‘’()[]{}…")
        code = bool(_CODE.search(bare))
        for word in raw_words(bare):
            yield f"`{word}" if code and len(word) > 1 else word


def _term(written: str) -> Term | None:
    word, code = written.lstrip("`"), written.startswith("`")
    lower = word.casefold()
    if lower in stop_words() and not (code and len(lower) > 2):
        return None
    literal = code or bool(re.search(r"\d|_|\+|#", word))
    known = terms_of(word)
    if literal:
        return Term(lower, known[:1], LITERAL if not lower.isdigit() else 1.0, literal=True)
    if len(lower) == 1 and not lower.isdigit():
        return Term(lower, known, 0.6)
    general = lower in general_words() or known[0] in _GENERAL_STEMS
    return Term(lower, known[:1], GENERAL if general else 1.0)


def _language_of(text: str) -> str:
    """Return the language that has most of the function words; English where nothing speaks for another one."""
    found = [word.casefold() for word in raw_words(text)]
    english = sum(word in stop_words() for word in found)
    counts = {name: sum(word in language(name).stop_words for word in found) for name in LANGUAGES}
    best = max(counts, key=lambda name: counts[name])
    return best if counts[best] > english or "¿" in text else "english"


def _translated(text: str, known: Language) -> tuple[str, list[Term]]:
    found = list(_written(text))
    lower = [word.lstrip("`").casefold() for word in found]
    by_stem = {stem(phrase[0], known.name): gloss for phrase, gloss in known.english.items() if len(phrase) == 1}
    english: list[str] = []
    made: list[Term] = []
    at = 0
    while at < len(found):
        size = next((n for n in (3, 2, 1) if tuple(lower[at : at + n]) in known.english), 1)
        phrase = tuple(lower[at : at + size])
        gloss = known.english.get(phrase)
        if gloss is None and phrase[0] not in known.stop_words:
            gloss = by_stem.get(stem(phrase[0], known.name))
        if gloss is not None:
            english.append(gloss)
            made += _glossed(phrase, gloss)
        elif phrase[0] not in known.stop_words:
            english.append(lower[at])
            made += [term for term in (_term(found[at]),) if term]
        at += size
    return " ".join(english), made


def _glossed(phrase: tuple[str, ...], gloss: str) -> list[Term]:
    """Return one term for a word with its translations, any of which may be in the text."""
    words = [word for word in gloss.split() if word not in stop_words()]
    if not words:
        return []
    weight = max(GENERAL if word in general_words() else 1.0 for word in words)
    return [Term(" ".join(phrase), tuple(dict.fromkeys(map(stem, words))), weight)]
