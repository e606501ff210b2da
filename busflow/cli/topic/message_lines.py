"""MessageLines: messages of one type from a stream, one YAML or JSON document a line."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import count
from typing import TYPE_CHECKING, BinaryIO

from busflow.cli.topic.typed_values import TypedValues
from busflow.errors import InvalidInput, LaunchError, Place, Problem
from busflow.launchfile.yaml.document import MAX_BYTES

if TYPE_CHECKING:
    from busflow.cli.terminal.field_paths import Shape
    from busflow.interfaces.encoding.foreign import ForeignType

_LABEL = "standard input"


class MessageLines:
    """The messages of a stream, read line by line as they are asked for; empty lines are left out."""

    def __init__(self, stream: BinaryIO, type_: ForeignType, shape: Shape | None) -> None:
        self._stream, self._type, self._shape = stream, type_, shape

    def __iter__(self) -> Iterator[TypedValues]:
        """Yield the values of each message until the end of the stream.

        Raises:
            InvalidInput: A line is no message of the type, or too long; its place is in the error.
        """
        for number in count(1):
            line = self._stream.readline(MAX_BYTES + 1)
            if not line:
                return
            if len(line) > MAX_BYTES:
                raise self._invalid(Problem("values", f"the line has more than {MAX_BYTES} bytes"), number)
            if line.strip():
                yield self._read(line.decode(errors="surrogateescape"), number)

    def _read(self, text: str, number: int) -> TypedValues:
        try:
            return TypedValues(text, self._type, self._shape)
        except InvalidInput as error:
            raise self._invalid(error.problem, number) from None
        except LaunchError as error:
            raise self._invalid(error.problems[0], number) from None

    def _invalid(self, problem: Problem, number: int) -> InvalidInput:
        """Return the error of a line, with its place in the stream and what to do."""
        place = replace(problem.place or Place("", 1, 1), file=_LABEL, line=number)
        rest = "correct the line, and send it and what follows again: the lines before it are published"
        return InvalidInput(replace(problem, place=place, fix=problem.fix or rest))
