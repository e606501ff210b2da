"""Markdown → passages, with every span in the source as it is."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from itertools import pairwise

from markdown_it import MarkdownIt
from markdown_it.token import Token

from busflow_assistant.passages import Extent, Page, Passage, PassageShape
from busflow_assistant.sentences import sentences, stripped

_PARSER = MarkdownIt("commonmark").enable("table")
_MARKER = re.compile(r"[ \t>]*(?:[-*+]|\d{1,9}[.)])[ \t]+(?:\[[ xX]\][ \t]+)?|[ \t>]+")
_RULE = re.compile(r"[\s|:-]+")
_FENCE = re.compile(r"[ \t>]*(?:`{3,}|~{3,})")
_FRONT_MATTER = re.compile(r"\A---[ \t]*\r?\n(?:.*\r?\n)*?---[ \t]*(?:\r?\n|\Z)")
"""What a site's generator reads, and no reader: title, tags and the like."""
_COMMENT = re.compile(r"<!--.*?(?:-->|\Z)", re.DOTALL)


def read_page(name: str, source: str) -> Page:
    """Return a page of Markdown with its passages."""
    return Page(name, source, tuple(_Reader(source).passages()))


def title(page: Page) -> str:
    """Return the first heading of a page, or its name."""
    first = next((each for each in page.passages if each.shape is PassageShape.HEADING), None)
    return plain(page.text(first.span)) if first else page.name


def plain(text: str) -> str:
    r"""Return Markdown as a reader sees it, on one line.

    >>> plain("## A **bold** [link](x.md)\n| `a` | b |")
    'A bold link a b'
    """
    text = _COMMENT.sub(" ", text)
    text = re.sub(r"!?\[([^\[\]]*)\]\((?:[^()\s]|\([^()]*\))*\)", r"\1", text)
    text = re.sub(r"(?m)^\s*(?:#{1,6}\s+|```.*$|~~~.*$|>\s?)|[`|]|\*\*", " ", text)
    return " ".join(text.split())


class _Reader:
    def __init__(self, source: str) -> None:
        self._source = source
        self._lines = [0, *(match.end() for match in re.finditer(r"\r\n|\n|\r", source)), len(source)]
        self._headings: list[tuple[int, str]] = []

    def passages(self) -> Iterator[Passage]:
        tokens = _PARSER.parse(_FRONT_MATTER.sub(lambda found: re.sub(r"[^\r\n]", " ", found[0]), self._source))
        at = 0
        while at < len(tokens):
            token = tokens[at]
            end = _end_of(tokens, at)
            if token.map is not None and (passage := self._passage(token, tokens[at:end])):
                yield passage
                at = end
            else:
                at += 1  # a quotation, whose parts are passages, or nothing to read

    def _passage(self, token: Token, inside: Sequence[Token]) -> Passage | None:
        span = stripped(self._source, self._span(token))
        match token.type:
            case "heading_open":
                level, text = int(token.tag[1:]), plain(inside[1].content)
                self._headings = [each for each in self._headings if each[0] < level]
                passage = self._made(PassageShape.HEADING, span, (span,))
                self._headings.append((level, text))
                return passage
            case "paragraph_open":
                span = self._without_marker(span)
                return self._made(PassageShape.PROSE, span, sentences(self._source, span))
            case "bullet_list_open" | "ordered_list_open":
                return self._made(PassageShape.LIST, span, tuple(self._items(inside)))
            case "table_open":
                return self._made(PassageShape.TABLE, span, tuple(self._rows(span)))
            case "fence" | "code_block":
                return self._made(PassageShape.CODE, span, tuple(self._code(span)))
            case _:
                return None

    def _made(self, shape: PassageShape, span: Extent, units: tuple[Extent, ...]) -> Passage | None:
        return Passage(shape, span, units, tuple(text for _, text in self._headings)) if units else None

    def _items(self, inside: Sequence[Token]) -> Iterator[Extent]:
        """Yield the sentences of each paragraph in a list, and the lines of code in it."""
        for token in inside:
            span = stripped(self._source, self._span(token)) if token.map else Extent(0, 0)
            if token.type == "paragraph_open":
                yield from sentences(self._source, self._without_marker(span))
            elif token.type in {"fence", "code_block"}:
                yield from self._code(span)

    def _rows(self, span: Extent) -> Iterator[Extent]:
        """Yield the rows of a table but the line below its head."""
        for line in self._lines_of(span):
            if not _RULE.fullmatch(self._source, line.start, line.end):
                yield line

    def _code(self, span: Extent) -> Iterator[Extent]:
        for line in self._lines_of(span):
            if not _FENCE.match(self._source, line.start, line.end):
                yield line

    def _lines_of(self, span: Extent) -> Iterator[Extent]:
        first = bisect_right(self._lines, span.start) - 1
        for start, end in pairwise(self._lines[first:]):
            if start >= span.end:
                return
            if line := stripped(self._source, Extent(max(start, span.start), min(end, span.end))):
                yield line

    def _without_marker(self, span: Extent) -> Extent:
        """Return a paragraph without the bullet, number or quotation mark before it."""
        while marker := _MARKER.match(self._source, span.start, span.end):
            span = Extent(marker.end(), span.end)
        return span

    def _span(self, token: Token) -> Extent:
        first, last = token.map or (0, 0)
        return Extent(self._lines[first], self._lines[min(last, len(self._lines) - 1)])


def _end_of(tokens: Sequence[Token], at: int) -> int:
    """Return the index behind a block and all in it."""
    if tokens[at].nesting != 1:
        return at + 1
    level = tokens[at].level
    return next(i for i in range(at + 1, len(tokens)) if tokens[i].level == level and tokens[i].nesting == -1) + 1
