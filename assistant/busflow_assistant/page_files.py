"""Files and folders → pages: which files are pages, and why the others are not."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from busflow_assistant.markdown import read_page
from busflow_assistant.passages import Page

SUFFIXES = frozenset({".md", ".markdown", ".mdx"})


@dataclass(frozen=True, slots=True)
class ReadingLimits:
    """How much is read at most."""

    pages: int = 500
    page_bytes: int = 1_000_000
    total_bytes: int = 16_000_000


@dataclass(frozen=True, slots=True)
class FoundPages:
    """The pages of some files and folders."""

    pages: tuple[Page, ...]
    left_out: tuple[str, ...]
    """Each with the reason."""


Signature = tuple[tuple[str, int, int], ...]
"""Name, time of change and size of each file: what shows that one has changed."""


def signature(places: Iterable[str]) -> Signature:
    """Return a value that differs if a file has changed since."""
    found: list[tuple[str, int, int]] = []
    for name, path in _files(places):
        try:
            state = path.stat()
        except OSError:
            found.append((name, 0, -1))
        else:
            found.append((name, state.st_mtime_ns, state.st_size))
    return tuple(found)


def read_pages(places: Iterable[str], limits: ReadingLimits) -> FoundPages:
    """Return the pages in files and folders, in the order given, each folder's by name."""
    pages: dict[str, Page] = {}
    left_out: list[str] = []
    total = 0
    for name, path in _files(places):
        text = _text(path, limits.page_bytes)
        if isinstance(text, _Fault):
            left_out.append(f"{name}: {text.why}")
        elif name in pages:
            left_out.append(f"{name}: another page has this name; {path} is left out")
        elif len(pages) == limits.pages or total + len(text) > limits.total_bytes:
            left_out.append(f"{name}: beyond the limit of {limits.pages} pages and {limits.total_bytes} bytes")
        else:
            pages[name] = read_page(name, text)
            total += len(text)
    return FoundPages(tuple(pages.values()), tuple(left_out))


@dataclass(frozen=True, slots=True)
class _Fault:
    why: str


def _text(path: Path, most: int) -> str | _Fault:
    try:
        with path.open("rb") as file:
            data = file.read(most + 1)
    except OSError as error:
        return _Fault(error.strerror or "it cannot be read")
    if len(data) > most:
        return _Fault(f"it has more than {most} bytes")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        return _Fault(f"it is no UTF-8 at byte {error.start}")


def _files(places: Iterable[str]) -> Iterator[tuple[str, Path]]:
    """Yield each page's name and file: of a folder the path in it, of a file its own name."""
    for place in places:
        path = Path(place)
        if not path.is_dir():
            yield path.name, path
            continue
        root = path.resolve()
        for folder, folders, files in os.walk(root):
            folders[:] = sorted(each for each in folders if not each.startswith("."))
            for file in sorted(files):
                found = Path(folder, file)
                inside = not file.startswith(".") and found.suffix.lower() in SUFFIXES
                if inside and found.resolve().is_relative_to(root):
                    yield found.relative_to(root).as_posix(), found
