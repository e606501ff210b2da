"""BookSite: the files of a book by the paths of its addresses, as the server of the page answers them."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import PurePosixPath
from urllib.parse import quote, unquote

from busflow.errors import InvalidInput
from busflow_ui.book.book import Book
from busflow_ui.book.folder import IMAGES, read
from busflow_ui.book.page_html import SERVED, chapter_page

_HTML = "text/html; charset=utf-8"
_SCRIPT = "text/javascript; charset=utf-8"


@dataclass(frozen=True, slots=True)
class BookAnswer:
    """Content of a path, or the path where it is."""

    kind: str
    body: bytes
    moved: str | None = None


class BookSite:
    """Pages, images and search of one book."""

    def __init__(self, book: Book) -> None:
        self.book = book

    def answer(self, path: str) -> BookAnswer | None:
        """Return the content of a path in the book, such as `lab1.html`; None where the book has none."""
        name = unquote(path)
        with suppress(InvalidInput):  # the folder is being written: the pages known so far stay
            self.book.look()
        if not name:
            return BookAnswer(_HTML, b"", moved=quote(self.book.entries()[0].address))
        if name == "search.js":
            return BookAnswer(_SCRIPT, self.book.search_script().encode())
        if name in self.book.files.images:
            body = read(self.book.files.images[name])
            return None if body is None else BookAnswer(IMAGES[PurePosixPath(name).suffix.lower()], body)
        entries = self.book.entries()
        entry = next((each for each in entries if each.address == name), None)
        if entry is None:
            return None
        return BookAnswer(_HTML, chapter_page(self.book, entries, entry, frame=SERVED).encode())
