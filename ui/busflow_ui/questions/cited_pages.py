"""CitedPages: which page of the assistant is which chapter of the book, and where a citation stands there. Pure.

Both read the same files, but may name them differently (`tutorial/lab1.md` and `lab1.md`), and one may have read a file
before it was changed. The text decides: a citation is only given a place where the chapter has its text.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol


class Chapters(Protocol):
    """Book that is shown."""

    def names(self) -> list[str]:
        """Return the names of its chapters."""
        ...

    def source(self, name: str) -> str:
        """Return the Markdown of one of them."""
        ...


class NoChapters:
    """Book of a page that shows none."""

    def names(self) -> list[str]:
        """Return nothing."""
        return []

    def source(self, name: str) -> str:  # noqa: ARG002  # of the interface
        """Return nothing."""
        return ""


class CitedPages:
    """The assistant's pages beside the book's."""

    def __init__(self, chapters: Chapters, sources: Mapping[str, str]) -> None:
        """Compare both.

        Args:
            chapters: the book's.
            sources: the Markdown of each page of the assistant.
        """
        self._chapters, self._sources = chapters, sources

    def page_of(self, chapter: str) -> str:
        """Return the assistant's name of a chapter: of the page with its text, else of its name; empty without one."""
        if chapter not in self._chapters.names():
            return ""
        source = self._chapters.source(chapter)
        if self._sources.get(chapter) == source:
            return chapter
        same = next((name for name, text in self._sources.items() if text == source), None)
        return same or (chapter if chapter in self._sources else "")

    def placed(self, citation: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return a citation with the chapter and the place where the book has it; -1 where it has not."""
        row = {word: citation[word] for word in ("page", "start", "end", "text", "score")}
        if not row["page"]:
            return row
        chapter = self._chapter_of(row["page"])
        if chapter is None:
            return {**row, "chapter": "", "start": -1, "end": -1}
        source, text = self._chapters.source(chapter), row["text"]
        start = row["start"]
        if source[start : row["end"]] != text:
            start = source.find(text)
        return {**row, "chapter": chapter, "start": start, "end": start + len(text) if start >= 0 else -1}

    def _chapter_of(self, page: str) -> str | None:
        names = self._chapters.names()
        if page in names:
            return page
        source = self._sources.get(page)
        return next((name for name in names if source is not None and self._chapters.source(name) == source), None)
