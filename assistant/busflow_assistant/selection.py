"""Where a selection lies in the source of its page, and what it is by itself where it lies nowhere."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections import defaultdict
from collections.abc import Sequence
from functools import lru_cache

from busflow_assistant.passages import Extent

MOST_BYTES = 20_000
"""The longest selection; what is beyond is cut."""

_RUN = 4
"""Words in a row by which a selection is found."""
_LEAST = 0.6
"""The share of a selection's words that a page has to have."""
_ENOUGH = 12
_CERTAIN = 7
"""Words in a row that are no accident, on any page and on the one that is open."""
_LINK = re.compile(r"(?<=\])\((?:[^()\s]|\([^()]*\))*\)|<!--.*?-->", re.DOTALL)
_WORD = re.compile(r"[^\W_]+")


def cut(selection: str) -> str:
    """Return the first 20 kB of a selection."""
    if len(selection) * 4 <= MOST_BYTES:
        return selection
    return selection.encode("utf-8", "replace")[:MOST_BYTES].decode("utf-8", "ignore")


def locate(selection: str, source: str, *, known: bool = False) -> Extent | None:
    """Return the part of a page's source that a reader selected, markup or not; None if it is not of that page.

    `known` says that the reader is on this page: then some words in a row are enough, and the rest is not the page's.

    >>> locate("one selects here", "Some *text* that **one** [selects](x.md) here.")
    Extent(start=19, end=45)
    """
    words = [match[0].casefold() for match in _WORD.finditer(_LINK.sub("", selection))]
    page = _words(source)
    run = min(_RUN, len(words))
    if not run:
        return None
    at = _places(source, run)
    hits = [place for start in range(len(words) - run + 1) for place in at.get(tuple(words[start : start + run]), ())]
    best = _densest(sorted(set(hits)), len(words))
    shared = len({index for place in best for index in range(place, place + run)})
    certain = _CERTAIN if known else max(_ENOUGH, len(words) // 3)
    if shared < _LEAST * len(words) and _longest(best) + run - 1 < certain:
        return None
    first, last = best[0], best[-1] + run - 1
    first, last = _grown(first, last, words, [word for word, _ in page])
    return Extent(page[first][1].start, page[last][1].end)


@lru_cache(maxsize=32)
def _words(source: str) -> list[tuple[str, Extent]]:
    """Return the words of a source as a reader sees it: without the targets of links."""
    shown = _LINK.sub(lambda match: " " * len(match[0]), source)
    return [(match[0].casefold(), Extent(*match.span())) for match in _WORD.finditer(shown)]


@lru_cache(maxsize=32)
def _places(source: str, run: int) -> dict[tuple[str, ...], list[int]]:
    words = [word for word, _ in _words(source)]
    found: defaultdict[tuple[str, ...], list[int]] = defaultdict(list)
    for start in range(len(words) - run + 1):
        found[tuple(words[start : start + run])].append(start)
    return found


def _densest(hits: Sequence[int], length: int) -> Sequence[int]:
    """Return the hits within the window, about as long as the selection, that has most of them."""
    best: Sequence[int] = ()
    for index, start in enumerate(hits):
        inside = hits[index : bisect_left(hits, start + length)]
        if len(inside) > len(best):
            best = inside
    return best


def _longest(hits: Sequence[int]) -> int:
    """How many hits follow each other without a gap, at most."""
    longest = length = 0
    for before, hit in zip((None, *hits), hits, strict=False):
        length = length + 1 if before is not None and hit == before + 1 else 1
        longest = max(longest, length)
    return longest


def _grown(first: int, last: int, words: Sequence[str], page: Sequence[str]) -> tuple[int, int]:
    """Return the window with the words at its ends that are the selection's, too few for a run of their own."""
    missing = len(words) - (last - first + 1)
    for _ in range(min(_RUN, max(0, missing))):
        if first and page[first - 1] == words[0]:
            return first - 1, last
        if last + 1 < len(page) and page[last + 1] == words[-1]:
            return first, last + 1
    return first, last
