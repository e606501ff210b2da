"""XmlFile: the elements of an XML file with their places; what would read further files, or grow, is refused."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from busflow.errors import LaunchError, Place, Problem
from busflow.text import printable

MOST_BYTES = 4 << 20
"""The largest file that is read; a humanoid with all its sensors has some 100 kB."""
MOST_DEPTH = 32
"""The deepest nesting; a robot's file has six levels."""
_WIDEST = 200


@dataclass(frozen=True, slots=True)
class Element:
    """One element: its tag, its attributes, and what is in it."""

    tag: str
    attributes: Mapping[str, str]
    offset: int
    """The position of its `<`, in bytes."""
    children: list[Element] = field(default_factory=list["Element"])

    def all(self, tag: str) -> Iterator[Element]:
        """Yield the elements of a tag directly in this one."""
        return (each for each in self.children if each.tag == tag)

    def first(self, tag: str) -> Element | None:
        """Return the first element of a tag directly in this one."""
        return next(self.all(tag), None)

    def within(self) -> Iterator[Element]:
        """Yield this element and all that are in it, in the order of the file."""
        yield self
        for each in self.children:
            yield from each.within()


class XmlFile:
    """A file with the elements in it."""

    def __init__(self, path: Path) -> None:
        """Read a file.

        Raises:
            LaunchError: It cannot be read, or is no XML within the limits.
        """
        self.path: Path = path
        self._bytes = _content(path)
        self._lines = [0, *(match.end() for match in re.finditer(b"\n", self._bytes))]
        self.root: Element = self._parsed()

    @property
    def text(self) -> str:
        """The content of the file."""
        return self._bytes.decode()

    def place(self, element: Element, attribute: str | None = None) -> Place:
        """Return the place of an element's tag, or of the value of one of its attributes."""
        if attribute is not None and attribute in element.attributes:
            pattern = rb"\s%s\s*=\s*[\"']" % re.escape(attribute.encode())
            found = re.compile(pattern).search(self._bytes, element.offset)
            if found is not None:
                return self._place(found.end(), len(element.attributes[attribute]))
        return self._place(element.offset + 1, len(element.tag))

    def _place(self, offset: int, width: int = 1) -> Place:
        line = bisect_right(self._lines, offset)
        before = self._bytes[self._lines[line - 1] : offset].decode(errors="replace")
        return self._at(line, len(before) + 1, width)

    def _at(self, line: int, column: int, width: int = 1) -> Place:
        line = min(line, len(self._lines))
        start = self._lines[line - 1]
        end = self._lines[line] - 1 if line < len(self._lines) else len(self._bytes)
        excerpt = self._bytes[start:end].decode(errors="replace").rstrip("\r")
        return Place(str(self.path), line, column, max(1, min(width, _WIDEST)), excerpt)

    def _parsed(self) -> Element:
        parser = expat.ParserCreate("utf-8")
        top = Element("", {}, 0)
        stack = [top]

        def refuse(code: str, message: str, fix: str) -> LaunchError:
            place = self._at(parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)
            return LaunchError([Problem(code, message, fix, place)])

        def begin(tag: str, attributes: dict[str, str]) -> None:
            if len(stack) > MOST_DEPTH:
                raise refuse("too-deep", f"elements nest deeper than {MOST_DEPTH} levels", "a robot's file has six")
            element = Element(tag, attributes, parser.CurrentByteIndex)
            stack[-1].children.append(element)
            stack.append(element)

        def refuse_doctype(*_: object) -> None:
            message, fix = "a DOCTYPE may define entities, which read further files or grow without bound", "remove it"
            raise refuse("doctype", message, fix)

        parser.StartElementHandler = begin
        parser.EndElementHandler = lambda _tag: stack.pop()
        parser.StartDoctypeDeclHandler = refuse_doctype
        try:
            parser.Parse(self._bytes, True)
        except expat.ExpatError as error:
            raise LaunchError([self._syntax(error, stack)]) from None
        return top.children[0]

    def _syntax(self, error: expat.ExpatError, stack: list[Element]) -> Problem:
        """Return the problem of a file that is no XML, with the element that is still open there."""
        message, fix = f"this is no XML: {expat.ErrorString(error.code)}", None
        if len(stack) > 1:
            tag, line = printable(stack[-1].tag, limit=100), self.place(stack[-1]).line
            fix = f"the element {tag} of line {line} is still open here: </{tag}> ends it"
        return Problem("bad-xml", message, fix, self._at(error.lineno, error.offset + 1))


def _content(path: Path) -> bytes:
    """Return the bytes of a file in UTF-8.

    Raises:
        LaunchError: It cannot be read, or is too large, or is no UTF-8.
    """
    try:
        if not path.is_file():
            raise LaunchError([Problem("unreadable-file", f"there is no file {path}")])
        with path.open("rb") as file:
            found = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise LaunchError([Problem("unreadable-file", f"cannot read {path}: {error.strerror}")]) from None
    if len(found) > MOST_BYTES:
        message = f"{path} has more than {MOST_BYTES >> 20} MiB"
        raise LaunchError([Problem("too-large", message, "let meshes be files of their own", Place(str(path), 1, 1))])
    try:
        found.decode()
    except UnicodeDecodeError as error:
        line = found.count(b"\n", 0, error.start) + 1
        column = error.start - found.rfind(b"\n", 0, error.start)
        place = Place(str(path), line, column)
        raise LaunchError([Problem("not-utf-8", "this is not UTF-8", "save the file as UTF-8", place)]) from None
    return found
