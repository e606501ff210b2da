"""The whole HTML page of a chapter: the text, all chapters, the contents of this one, the one before and the next."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from posixpath import relpath
from urllib.parse import quote

from busflow_ui.book.book import Book, ListedChapter
from busflow_ui.book.rendering import Heading

_CONTENTS = range(2, 4)
"""Levels of the headings in the contents of a page."""


@dataclass(frozen=True, slots=True)
class PageFrame:
    """Where the pages of a book stand among the files that they need."""

    assets: str
    """The folder of the scripts and styles, as seen from the book's first folder, such as `../`."""
    script: str
    """The tag that loads the book's script; `{assets}` is the folder above."""
    is_live: bool
    """Whether a server is behind it."""


SERVED = PageFrame("../", '<script type="module" src="{assets}book.js"></script>', is_live=True)
STATIC = PageFrame("_book/", '<script src="{assets}book_static.js" defer></script>', is_live=False)


def chapter_page(book: Book, entries: Sequence[ListedChapter], entry: ListedChapter, *, frame: PageFrame) -> str:
    """Return the page of a chapter among all `entries` of its book, which ask the disk about each file."""
    chapter = book.chapter(entry.name)
    root = "../" * entry.address.count("/")
    assets = f"{root}{frame.assets}"
    title = escape(entry.title if entry.title == book.title else f"{entry.title} – {book.title}")
    kind = "live" if frame.is_live else "static"
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{title}</title>
<link rel="icon" href="{assets}icon.svg">
<link rel="stylesheet" href="{assets}book.css">
{frame.script.format(assets=assets)}
</head>
<body class="book" data-root="{root}" data-kind="{kind}">
<a class="book-skip" href="#text">Skip to the text</a>
<header class="book-head">
<a class="book-title" href="{root}{quote(entries[0].address)}">{escape(book.title)}</a>
<div class="book-tools"></div>
{f'<a class="book-panels" href="{assets}">Running graph</a>' if frame.is_live else ""}
</header>
<div class="book-body">
<nav class="book-chapters" aria-label="Chapters"><ol>
{"".join(_chapters(entries, entry))}</ol></nav>
<main class="book-text" id="text" tabindex="-1" data-page="{escape(entry.name)}" data-title="{escape(entry.title)}">
<article>
{chapter.html}</article>
{_turn(entries, entry)}
</main>
<aside class="book-contents">{_contents(chapter.headings)}</aside>
</div>
</body>
</html>
"""


def _chapters(entries: Sequence[ListedChapter], now: ListedChapter) -> Iterator[str]:
    for each in entries:
        current = ' aria-current="page"' if each == now else ""
        yield f'<li><a href="{_address(each, now)}"{current}>{escape(each.title)}</a></li>\n'


def _contents(headings: Sequence[Heading]) -> str:
    shown = [each for each in headings if each.level in _CONTENTS]
    if not shown:
        return ""
    lines = (
        f'<li class="level-{each.level}"><a href="#{escape(each.anchor)}">{escape(each.text)}</a></li>\n'
        for each in shown
    )
    return f'<nav aria-label="On this page"><h2>On this page</h2><ol>\n{"".join(lines)}</ol></nav>'


def _turn(entries: Sequence[ListedChapter], now: ListedChapter) -> str:
    at = entries.index(now)
    links: list[str] = []
    if at:
        links.append(f'<a rel="prev" href="{_address(entries[at - 1], now)}">{escape(entries[at - 1].title)}</a>')
    if at + 1 < len(entries):
        links.append(f'<a rel="next" href="{_address(entries[at + 1], now)}">{escape(entries[at + 1].title)}</a>')
    return f'<nav class="book-turn" aria-label="Previous and next chapter">{"".join(links)}</nav>' if links else ""


def _address(entry: ListedChapter, now: ListedChapter) -> str:
    return quote(relpath(entry.address, now.address.rpartition("/")[0] or "."))
