"""The parser of definition files: text to `TypeDefinition`, every mistake with its line and column.

It bounds what it reads: the bytes of a text, the characters of a line, the declarations of a part, the problems kept.
"""

from __future__ import annotations

from busflow.definitions.comments import CommentBlocks, joined
from busflow.definitions.declarations import Declarations
from busflow.definitions.definition import Kind, MessageDefinition, TypeDefinition, kind_of
from busflow.definitions.lines import Line, Word, split
from busflow.errors import InvalidDefinition, Place, Problem
from busflow.text import UNSAFE, counted

MAX_BYTES = 1 << 20
"""The most bytes of one text; the longest that ROS 2's packages have are 40 KiB."""
MAX_LINE = 10_000
"""The most characters of a line."""
_MAX_PROBLEMS = 20


def read_bytes(name: str, content: bytes, file: str) -> TypeDefinition:
    """Parse the content of a file; see `read_text`."""
    if len(content) > MAX_BYTES:
        message = f"a definition has at most {MAX_BYTES} bytes; this file has more"
        raise InvalidDefinition([Problem("too-large", message, None, Place(file, 1, 1))])
    try:
        return read_text(name, content.decode("utf-8-sig"), file)
    except UnicodeDecodeError as error:
        start, line = content[: error.start].rpartition(b"\n")[2], content.count(b"\n", 0, error.start) + 1
        place = Place(file, line, len(start.decode("utf-8-sig", "replace")) + 1)
        problem = Problem("not-utf-8", f"this is no UTF-8: {error.reason}", "save the file as UTF-8", place)
    raise InvalidDefinition([problem])


def read_text(
    name: str, text: str, file: str, *, kind: Kind | None = None, first_line: int = 1, lenient: bool = False
) -> TypeDefinition:
    """Parse what a file defines.

    Args:
        name: The full name of the type.
        text: The content.
        file: The file, for errors.
        kind: What the text defines; by default the middle part of the name says it.
        first_line: The number of the text's first line.
        lenient: True for what others have recorded: any name is taken, and values are not checked.

    Raises:
        InvalidDefinition: It has mistakes; all are listed.
    """
    reader = _Reader(name, kind or kind_of(name) or Kind.MESSAGE, file, lenient=lenient)
    for number, line in enumerate(text.split("\n"), start=first_line):
        reader.read(number, line.removesuffix("\r"))
        if len(reader.problems) >= _MAX_PROBLEMS:
            break
    else:
        definition = reader.finish()
        if not reader.problems:
            return definition
    raise InvalidDefinition(reader.problems)


class _Reader:
    """The lines of one file so far, and the problems found in them."""

    def __init__(self, name: str, kind: Kind, file: str, *, lenient: bool) -> None:
        self.problems: list[Problem] = []
        self._name, self._kind, self._file, self._lenient = name, kind, file, lenient
        self._comment = ""
        self._parts: list[MessageDefinition] = []
        self._heading = ""
        """The comment of the part that is read."""
        self._declared = self._declarations()
        self._pending = CommentBlocks()

    def read(self, number: int, text: str) -> None:
        """Read one line."""
        if len(text) > MAX_LINE:
            message = f"a line has at most {MAX_LINE} characters; this one has {len(text)}"
            self._report("too-long", message, Line(number, ""), Word("", 0), "write it on several lines")
            return
        line = split(number, text)
        unsafe = UNSAFE.search(text.replace("\t", " "))
        if unsafe is not None and not self._lenient:
            message = f"{unsafe[0]!a} is no character of a definition"
            self._report("control-character", message, line, Word(unsafe[0], unsafe.start()), "leave it out")
        elif line.is_separator:
            self._separate(line)
        elif line.type is not None:
            self._declare(line)
        elif line.comment is None:
            self._end_block()
        elif not (line.is_indented and self._declared.goes_on(line.comment)):
            self._pending.add(line.comment)

    def finish(self) -> TypeDefinition:
        """Return the definition; it is of no use where there are problems."""
        self._end_part()
        suffixes = self._kind.parts
        if len(self._parts) < len(suffixes):
            found = counted(len(self._parts), "part")
            message = f"{self._kind.phrase} has {len(suffixes)} parts, a line --- between them; this file has {found}"
            self._report("missing-part", message, Line(1, ""), Word("", 0), "write a line --- between two parts")
        return TypeDefinition(self._name, self._kind, self._comment, tuple(self._parts))

    def _separate(self, line: Line) -> None:
        self._end_part()
        word = Word(line.text.rstrip(), 0)
        if len(self._parts) == len(self._kind.parts):
            message = f"{self._kind.phrase} has {counted(len(self._parts), 'part')}; here begins one more"
            self._report("too-many-parts", message, line, word, "leave this line out")
        elif word.text != "---":
            self._report("invalid-separator", "the line between two parts is ---", line, word, "write ---")

    def _end_part(self) -> None:
        if self._kind is Kind.MESSAGE and not self._comment:
            self._head(self._declared.take_only_comment())
        self._head(self._pending.take())  # a comment at the end belongs to no declaration
        if len(self._parts) < len(self._kind.parts):
            name = f"{self._name}{self._kind.parts[len(self._parts)]}"
            self._parts.append(MessageDefinition(name, self._heading, *self._declared.finish()))
        self._heading, self._declared = "", self._declarations()

    def _declare(self, line: Line) -> None:
        self._declared.add(line, self._pending.take())

    def _end_block(self) -> None:
        """End a block of comments: above all declarations it is about the file, then about the part."""
        self._declared.end_comment()
        taken = self._comment if self._kind is Kind.MESSAGE else self._heading
        if self._declared.is_empty and not taken:
            self._head(self._pending.take())
        self._pending.end_block()

    def _head(self, comment: str) -> None:
        """Add a comment to the file's, or to the part's where the file has one."""
        if self._kind is Kind.MESSAGE or not (self._parts or self._comment):
            self._comment = joined(self._comment, comment)
        else:
            self._heading = joined(self._heading, comment)

    def _declarations(self) -> Declarations:
        package = self._name.partition("/")[0]
        return Declarations(package, self._report, self._file, lenient=self._lenient)

    def _report(self, code: str, message: str, line: Line, word: Word, fix: str | None = None) -> None:
        place = Place(self._file, line.number, word.column + 1, max(1, len(word.text)), line.text)
        self.problems.append(Problem(code, message, fix, place))
