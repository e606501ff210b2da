"""Terms of a question → terms of an index: the same stem, a synonym, a related form, a slip of the keyboard."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache

from busflow_assistant.lexicon import synonyms
from busflow_assistant.question import AskedQuestion, Term
from busflow_assistant.search_index import SearchIndex
from busflow_assistant.words import stem

SYNONYM = 0.7
RELATED = 0.65
SLIP = 0.8


@dataclass(frozen=True, slots=True)
class Matched:
    """A term of a question, with what may stand for it in the index."""

    term: Term
    variants: Mapping[str, float]
    """Term of the index → how well it stands for the question's, up to 1; the best first."""
    rarity: float
    """The inverse document frequency of the term with its variants, from 0 to 1."""

    @property
    def weight(self) -> float:
        """How much the term counts: a word that stands everywhere half as much as one that stands nowhere."""
        return self.term.weight * (0.4 + 0.6 * self.rarity)

    def best(self, terms: Mapping[str, int] | frozenset[str]) -> float:
        """Return how well some terms of a text have this one."""
        for variant, quality in self.variants.items():
            if variant in terms:
                return quality
        return 0.0


def match(question: AskedQuestion, index: SearchIndex) -> tuple[Matched, ...]:
    """Return each term of a question with its variants in an index; a term that the index lacks has none."""
    return tuple(_matched(term, index) for term in question.terms)


def _matched(term: Term, index: SearchIndex) -> Matched:
    variants: dict[str, float] = {}
    for one in term.stems:
        for variant, quality in _variants(term, one, index):
            if variant in index.postings:
                variants[variant] = max(quality, variants.get(variant, 0.0))
    if not variants:
        variants = dict.fromkeys(_compounds(term, index), RELATED)
    if not variants and (slip := _slip(term, index)):
        variants[slip] = SLIP
    close = [variant for variant, quality in variants.items() if quality >= 0.8] or list(variants)
    rarity = min((index.rarity(variant) for variant in close), default=1.0)
    best_first = dict(sorted(variants.items(), key=lambda each: -each[1]))
    return Matched(term, best_first, rarity)


def _variants(term: Term, one: str, index: SearchIndex) -> Iterator[tuple[str, float]]:
    yield one, 1.0
    if term.literal:
        if one.replace(".", "").isdigit():
            yield (one.removesuffix(".0") if one.endswith(".0") else f"{one}.0"), 0.95
        return
    for other in _synonym_stems().get(one, ()):
        yield other, SYNONYM
    if len(one) >= 5:
        for other in index.by_prefix.get(one[:4], ()):
            if other != one and _related(one, other):
                yield other, RELATED


@cache
def _synonym_stems() -> Mapping[str, frozenset[str]]:
    found: dict[str, set[str]] = {}
    for word, others in synonyms().items():
        found.setdefault(stem(word), set()).update(map(stem, others))
    return {word: frozenset(others - {word}) for word, others in found.items()}


def _related(one: str, other: str) -> bool:
    """Return whether two stems are of one family: `communic` and `communicat`, `processor` and `process`."""
    shorter, longer = sorted((one, other), key=len)
    return (
        len(shorter) >= 5 and longer.startswith(shorter[: max(5, len(shorter) - 1)]) and len(longer) - len(shorter) <= 4
    )


def _compounds(term: Term, index: SearchIndex) -> Iterator[str]:
    """Yield the terms of the index that end with a term or begin with it: `cpython` has `python`."""
    one = term.stems[0]
    if len(one) >= 5 and not term.literal:
        yield from (other for other in index.postings if other.endswith(one) or other.startswith(one))


def _slip(term: Term, index: SearchIndex) -> str | None:
    """Return the term of the index that was meant by a mistyped one."""
    one = term.stems[0]
    allowed = 0 if len(one) < 6 or term.literal or not one.isalpha() else 1 if len(one) < 9 else 2
    if not allowed:
        return None
    near = [other for other in index.postings if other[0] == one[0] and abs(len(other) - len(one)) <= allowed]
    found = [(distance(one, other), other) for other in near if other.isalpha()]
    least = min(found, default=(allowed + 1, ""))
    return least[1] if least[0] <= allowed else None


def distance(one: str, other: str) -> int:
    """Return how many letters were added, left out, changed or swapped.

    >>> distance("receive", "recieve"), distance("program", "programm")
    (1, 1)
    """
    before: list[int] = []
    row = list(range(len(other) + 1))
    for i, letter in enumerate(one, 1):
        before, last, row = row, before, [i]
        for j, wanted in enumerate(other, 1):
            cost = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (letter != wanted))
            if i > 1 and j > 1 and letter == other[j - 2] and one[i - 2] == wanted:
                cost = min(cost, last[j - 2] + 1)
            row.append(cost)
    return row[-1]
