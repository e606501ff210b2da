"""Book: chapters in their order, each rendered when it is first asked for, and again when its file changes."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import unescape
from pathlib import Path, PurePosixPath
from posixpath import normpath, relpath
from urllib.parse import quote, unquote, urlsplit

from busflow_ui.book.folder import MOST_PAGE, PAGES, BookFiles, find, read
from busflow_ui.book.rendering import Chapter, rendered

_FIRST = ("README", "index")
"""Pages that begin their folder, and state the order of the others by their links."""
_TAG = re.compile(r"<[^>]*>")
_SECTION = re.compile(r'<h[1-6][^>]*\bid="([^"]*)"[^>]*>(.*?)</h[1-6]>', re.DOTALL)
_MOST_SECTION = 4000
"""Characters of a section that the search knows."""


@dataclass(frozen=True, slots=True)
class ListedChapter:
    """Chapter in the list of chapters."""

    name: str
    """Its file's, such as `parts/lab1.md`."""
    address: str
    """Its page's, such as `parts/lab1.html`."""
    title: str


@dataclass(frozen=True, slots=True)
class _Read:
    stamp: tuple[int, int]
    chapter: Chapter
    source: str


class _ChapterLinks:
    """The links of one chapter: those into the book and those to other sites; all others are left out."""

    def __init__(self, name: str, files: BookFiles) -> None:
        self._folder, self._files = str(PurePosixPath(name).parent), files

    def link(self, address: str) -> str | None:
        """Return the address in the book or of another site; None where it leads out of the book."""
        parts = urlsplit(address)
        if parts.scheme or parts.netloc:
            return address if parts.scheme in {"http", "https", "mailto"} else None
        if not parts.path:
            return f"#{parts.fragment}"
        target = self._target(parts.path)
        fragment = f"#{parts.fragment}" if parts.fragment else ""
        if target in self._files.pages:
            return f"{self._relative(address_of(target))}{fragment}"
        return self._relative(target) if target in self._files.images else None

    def image(self, address: str) -> str | None:
        """Return the address of an image of the book; None for any other."""
        parts = urlsplit(address)
        target = self._target(parts.path)
        return None if parts.scheme or parts.netloc or target not in self._files.images else self._relative(target)

    def _target(self, path: str) -> str:
        return normpath(f"{self._folder}/{unquote(path)}")

    def _relative(self, target: str) -> str:
        return quote(relpath(target, self._folder))


class Book:
    """Pages of some folders and files, as they are on the disk now."""

    def __init__(self, places: Sequence[Path]) -> None:
        """Find the pages.

        Raises:
            InvalidInput: There is none, or two have one name.
        """
        self._places = list(places)
        self._read: dict[str, _Read] = {}
        self.files: BookFiles = find(places)

    def look(self) -> None:
        """Find the pages anew; where there is none any more the last ones stay."""
        self.files = find(self._places)

    @property
    def title(self) -> str:
        """The title of the page that begins the book, else the folder's name."""
        first = next(filter(_is_opening, self.files.pages), None)
        return self._title(first) if first else self._places[0].resolve().name

    def entries(self) -> list[ListedChapter]:
        """Return the chapters in their order: README.md or index.md states it by its links, then come the others."""
        names = list(self.files.pages)
        openings = sorted(filter(_is_opening, names), key=lambda name: name.count("/"))
        ordered = dict.fromkeys(each for opening in openings for each in (opening, *self._linked(opening)))
        ordered |= dict.fromkeys(names)
        return [ListedChapter(name, address_of(name), self._title(name)) for name in ordered]

    def names(self) -> list[str]:
        """Return the names of the chapters' files."""
        return list(self.files.pages)

    def chapter(self, name: str) -> Chapter:
        """Return a chapter; an empty one where its file is gone, too large or no UTF-8."""
        return self._now(name).chapter

    def source(self, name: str) -> str:
        """Return a chapter's Markdown, to which the places in it count."""
        return self._now(name).source

    def faults(self) -> list[str]:
        """Return what is wrong in the pages, each with its file."""
        return [
            f"{self.files.pages[name]}: {fault}" for name in self.files.pages for fault in self.chapter(name).faults
        ]

    def search_script(self) -> str:
        """Return the text of every section as a script, which also a page without a server can load."""
        sections = [section for entry in self.entries() for section in self._sections(entry)]
        return f"globalThis.busflowBook = {json.dumps(sections, ensure_ascii=True)};\n"

    def _sections(self, entry: ListedChapter) -> Iterator[dict[str, str]]:
        parts = _SECTION.split(self.chapter(entry.name).html)
        anchors = [("", entry.title), *zip(parts[1::3], parts[2::3], strict=True)]
        for (anchor, heading), body in zip(anchors, parts[::3], strict=True):
            text = _shown(body)[:_MOST_SECTION]
            if text or anchor:
                address = f"{quote(entry.address)}#{anchor}" if anchor else quote(entry.address)
                yield {"address": address, "chapter": entry.title, "heading": _shown(heading), "text": text}

    def _linked(self, opening: str) -> Iterator[str]:
        folder = str(PurePosixPath(opening).parent)
        for address in self.chapter(opening).links:
            target = normpath(f"{folder}/{unquote(urlsplit(address).path)}")
            if target in self.files.pages:
                yield target

    def _title(self, name: str) -> str:
        headings = self.chapter(name).headings
        return headings[0].text if headings and headings[0].text else PurePosixPath(name).stem

    def _now(self, name: str) -> _Read:
        path = self.files.pages[name]
        try:
            state = path.stat()
            stamp = (state.st_mtime_ns, state.st_size)
        except OSError:
            stamp = (0, -1)
        known = self._read.get(name)
        if known is None or known.stamp != stamp:
            source = _text(read(path, most=MOST_PAGE))
            known = self._read[name] = _Read(stamp, rendered(source, _ChapterLinks(name, self.files)), source)
        return known


def _is_opening(name: str) -> bool:
    return PurePosixPath(name).stem in _FIRST


def address_of(name: str) -> str:
    """Return the address of a chapter's page in the book.

    >>> address_of("parts/lab1.md")
    'parts/lab1.html'
    """
    return f"{name[: -len(PurePosixPath(name).suffix)]}.html" if PurePosixPath(name).suffix.lower() in PAGES else name


def _text(data: bytes | None) -> str:
    if data is None:
        return "This page cannot be read: it is gone, or larger than 1 MB."
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        return f"This page cannot be read: it is no UTF-8 at byte {error.start}."


def _shown(html: str) -> str:
    """Return what a reader sees of HTML, on one line."""
    return " ".join(unescape(_TAG.sub("", html)).split())
