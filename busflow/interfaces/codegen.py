"""FunctionSource: the one place where busflow writes a function as text and has Python compile it.

Encoding an Imu takes half the time when its fields are named in the code instead of being looked up in a table, and
messages are encoded thousands of times a second; the standard library's dataclasses are made in the same way. No text
from outside reaches the compiler: the lines are made of templates in this package, of numbers, of names counted up
here, and of the field names of a message class, which are checked to be plain words. What a line uses is given to it;
it can name nothing else, not even Python's built-in functions. A description that a peer sent is never compiled.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Generator
from contextlib import contextmanager
from keyword import iskeyword
from typing import Any

from busflow.errors import InvalidDeclaration

MOST_LOOPS = 19
"""The most loops within each other. Python 3.11 takes 20 blocks, and the body of a function is in a `try`."""
_WORD = re.compile(r"[a-z][a-z0-9_]*")


class FunctionSource:
    """A function under construction: its lines, and the objects that they use."""

    def __init__(self) -> None:
        self._lines: list[str] = []
        self._given: dict[str, Any] = {"__builtins__": {}, "__name__": __name__}
        self._names: dict[int, str] = {}
        self._count = 0
        self._depth = 1
        self._loops = 0

    def add(self, *lines: str) -> None:
        """Append lines at the present indentation."""
        self._lines += ["    " * self._depth + line for line in lines]

    def indent(self, by: int) -> None:
        """Indent the next lines, or, with a negative number, the reverse."""
        self._depth += by

    @contextmanager
    def loop(self, head: str) -> Generator[None]:
        """Append the head of a loop, e.g. "for item in items:"; its body is appended within.

        Raises:
            InvalidDeclaration: `MOST_LOOPS` loops surround it already.
        """
        if self._loops == MOST_LOOPS:
            raise InvalidDeclaration(f"sequences of messages lie more than {MOST_LOOPS} deep within each other")
        self.add(head)
        self._loops, self._depth = self._loops + 1, self._depth + 1
        yield
        self._loops, self._depth = self._loops - 1, self._depth - 1

    def new(self, prefix: str) -> str:
        """Return an unused name."""
        self._count += 1
        return f"{prefix}{self._count}"

    def give(self, value: Any) -> str:
        """Return a name by which the lines can use `value`."""
        if id(value) not in self._names:
            self._names[id(value)] = name = self.new("_given")
            self._given[name] = value  # and so it lives as long as its id is remembered
        return self._names[id(value)]

    def function(self, parameter: str) -> Callable[[Any], Any]:
        """Compile the lines as the body of a function with one parameter."""
        text = "\n".join([f"def function({parameter}):", *self._lines])
        exec(text, self._given)  # noqa: S102 - see above
        return self._given["function"]


def word(name: str) -> str:
    """Return a field's name if it may stand in generated code.

    Raises:
        InvalidDeclaration: The name is no plain word.
    """
    if not _WORD.fullmatch(name) or iskeyword(name):
        raise InvalidDeclaration(f"{name!r} names no field: write lower-case letters, digits and underscores")
    return name
