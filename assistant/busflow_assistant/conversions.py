"""Pages and answers ↔ the messages that carry them."""

from __future__ import annotations

from busflow_assistant.answer import Citation
from busflow_assistant.markdown import title
from busflow_assistant.messages import CitedText, IndexedPage, IndexedPassage
from busflow_assistant.passages import Extent, Page, Passage, PassageShape

_SHAPES = {shape.value: shape for shape in PassageShape}


def page_to_message(page: Page) -> IndexedPage:
    """Return the message of a page."""
    passages = [_passage_to_message(each) for each in page.passages]
    return IndexedPage(name=page.name, title=title(page), source=page.source, passages=passages)


def page_from_message(message: IndexedPage) -> Page:
    """Return the page of a message; what lies outside its source is left out."""
    size = len(message.source)
    passages = (_passage_from_message(each, size) for each in message.passages)
    return Page(message.name, message.source, tuple(each for each in passages if each.units))


def citation_to_message(citation: Citation) -> CitedText:
    """Return the message of a citation."""
    extent = citation.span
    return CitedText(page=citation.page, start=extent.start, end=extent.end, text=citation.text, score=citation.score)


def _passage_to_message(passage: Passage) -> IndexedPassage:
    return IndexedPassage(
        shape=passage.shape.value,
        headings=passage.headings,
        start=passage.span.start,
        end=passage.span.end,
        starts=[each.start for each in passage.units],
        ends=[each.end for each in passage.units],
    )


def _passage_from_message(message: IndexedPassage, size: int) -> Passage:
    shape = _SHAPES.get(message.shape, PassageShape.PROSE)
    pairs = zip(message.starts.tolist(), message.ends.tolist(), strict=False)
    units = tuple(Extent(start, end) for start, end in pairs if start < end <= size)
    return Passage(shape, Extent(min(message.start, size), min(message.end, size)), units, tuple(message.headings))
