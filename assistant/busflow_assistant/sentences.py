"""Where a sentence of prose ends."""

from __future__ import annotations

import re

from busflow_assistant.passages import Extent

_END = re.compile(
    r"(?<![.!?…])[.!?…]++[)\"'”’*_`\]]*+"
    r"(?=\s+[\"'“‘(*_\[]*(?:[A-Z0-9/~@$<`-]|[a-z]+[_(./]))"  # what begins the next one: no word in lower case
)
_SHORT = re.compile(r"(?:\b(?:e\.g|i\.e|etc|cf|vs|approx|No|Fig|Dr|Mr|Ms|St)|\b[A-Z])\.$")
"""What a full stop does not end: an abbreviation, an initial."""


def sentences(source: str, span: Extent) -> tuple[Extent, ...]:
    """Return the sentences of a part of a text, without the spaces around them.

    >>> [len(each) for each in sentences("One, e.g. this. `two` ends. Three", Extent(0, 33))]
    [15, 11, 5]
    """
    found: list[Extent] = []
    start = span.start
    for match in _END.finditer(source, span.start, span.end):
        if _SHORT.search(source, start, match.end()) or _inside_code(source[start : match.end()]):
            continue
        found.append(Extent(start, match.end()))
        start = match.end()
    found.append(Extent(start, span.end))
    return tuple(each for raw in found if (each := stripped(source, raw)))


def stripped(source: str, span: Extent) -> Extent:
    """Return a span without the white space at its ends."""
    text = source[span.start : span.end]
    start = span.start + len(text) - len(text.lstrip())
    return Extent(start, max(start, span.start + len(text.rstrip())))


def _inside_code(text: str) -> bool:
    return text.count("`") % 2 == 1
