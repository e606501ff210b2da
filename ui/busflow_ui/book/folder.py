"""Files of a book: which pages and images there are. Nothing else of the disk has a name here.

A page's name is its path in the folder, or the name of a file that was named alone: the names that the assistant's
`page_index` gives them too.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from busflow.errors import InvalidInput, Problem

PAGES = frozenset({".md", ".markdown"})
IMAGES: Mapping[str, str] = {
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".jpeg": "image/jpeg",
    ".gif": "image/gif",
    ".webp": "image/webp",
    ".avif": "image/avif",
    ".svg": "image/svg+xml",
}
_MOST_FILES = 2000
MOST_PAGE = 1_000_000
"""Largest page in bytes, as of the assistant."""
_MOST_IMAGE = 20_000_000


@dataclass(frozen=True, slots=True)
class BookFiles:
    """Pages and images by their names, in the order of the folders."""

    pages: Mapping[str, Path]
    images: Mapping[str, Path]


def find(places: Iterable[Path]) -> BookFiles:
    """Return the files of folders, and files that are named alone with the images beside them.

    Raises:
        InvalidInput: A place is neither, two pages have one name, or there is no page.
    """
    pages: dict[str, Path] = {}
    images: dict[str, Path] = {}
    named = list(places)
    for place in named:
        for name, path in _files(place):
            kind = pages if path.suffix.lower() in PAGES else images
            if kind is pages and pages.get(name, path) != path:
                message = f"two pages of the book are named {name}: {pages[name]} and {path}"
                raise InvalidInput(Problem("book-page", message, "name the folder above both"))
            kind.setdefault(name, path)
    if not pages:
        message = f"there is no page in {', '.join(map(str, named))}"
        raise InvalidInput(Problem("book-page", message, "name a folder with Markdown files (*.md), or such a file"))
    return BookFiles(pages, images)


def _files(place: Path) -> Iterator[tuple[str, Path]]:
    root = (place if place.is_dir() else place.parent).resolve()
    if not place.is_dir():
        if not place.is_file() or place.suffix.lower() not in PAGES:
            raise InvalidInput(
                Problem("book-page", f"{place} is neither a folder nor a Markdown file", "name one of them")
            )
        yield place.name, root / place.name
    count = 0
    for folder, folders, names in os.walk(root):
        folders[:] = sorted(each for each in folders if not each.startswith("."))
        for name in sorted(names):
            path = Path(folder, name)
            kinds = PAGES | IMAGES.keys() if place.is_dir() else IMAGES.keys()
            if name.startswith(".") or path.suffix.lower() not in kinds or not _is_inside(path, root):
                continue
            count += 1
            if count > _MOST_FILES:
                fix = "name a folder below it, or single files"
                raise InvalidInput(Problem("book-page", f"{place} has more than {_MOST_FILES} pages and images", fix))
            yield path.relative_to(root).as_posix(), path


def _is_inside(path: Path, root: Path) -> bool:
    """Return whether a file, with its links followed, is one of the folder."""
    real = path.resolve()
    return real.is_file() and real.is_relative_to(root)


def read(path: Path, *, most: int = _MOST_IMAGE) -> bytes | None:
    """Return a file's content; None where it is gone, or too large."""
    try:
        with path.open("rb") as file:
            data = file.read(most + 1)
    except OSError:
        return None
    return data if len(data) <= most else None
