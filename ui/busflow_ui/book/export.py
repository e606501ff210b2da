"""Export of a book: a static site with the pages, their images, the search, and no script that asks a server."""

from __future__ import annotations

import shutil
from html import escape
from pathlib import Path
from urllib.parse import quote

from busflow.errors import InvalidInput, Problem
from busflow_ui.book.book import Book
from busflow_ui.book.folder import read
from busflow_ui.book.page_html import STATIC, chapter_page

_ASSETS = ("book_static.js", "book.css", "icon.svg", "licences.json")
_MARK = "_book"
"""The folder of scripts and styles, by which an older export is recognized."""


def export(book: Book, page_folder: Path, target: Path) -> int:
    """Write a book as a site into a folder; return the number of pages.

    An older export is written over; files of chapters that are gone stay.

    Raises:
        InvalidInput: The folder has other things in it, or cannot be written to.
    """
    try:
        if target.exists() and (not target.is_dir() or (any(target.iterdir()) and not (target / _MARK).is_dir())):
            message = f"{target} is there already, and is no export of a book"
            raise InvalidInput(Problem("book-export", message, "name a folder that is new or empty"))
        return _write(book, page_folder, target)
    except OSError as error:
        message = f"the book cannot be written to {target}: {error.strerror or error}"
        raise InvalidInput(Problem("book-export", message, "name a folder that you may write to")) from None


def _write(book: Book, page_folder: Path, target: Path) -> int:
    (target / _MARK).mkdir(parents=True, exist_ok=True)
    for name in _ASSETS:
        shutil.copyfile(page_folder / name, target / _MARK / name)
    (target / "search.js").write_text(book.search_script(), "utf-8")
    entries = book.entries()
    for entry in entries:
        file = target / entry.address
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(chapter_page(book, entries, entry, frame=STATIC), "utf-8")
    for name, path in book.files.images.items():
        body = read(path)
        if body is not None:
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            (target / name).write_bytes(body)
    if entries[0].address != "index.html" and "index.html" not in {each.address for each in entries}:
        (target / "index.html").write_text(_leading_to(entries[0].address), "utf-8")
    return len(entries)


def _leading_to(address: str) -> str:
    url = escape(quote(address))
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>Book</title>'
        f'<meta http-equiv="refresh" content="0; url={url}"></head><body><a href="{url}">The book</a></body></html>\n'
    )
