"""What is still to be sent of an answer that a page follows: the whole if it has changed, or its new lines. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

_MOST_KNOWN = 5000
"""Lines that are remembered; a run keeps 1000 of each process."""


class Remaining(Protocol):
    """Part of an answer that one page does not have yet."""

    def of(self, found: Any) -> object | None:
        """Return what is to be sent of a newer answer; None if that is nothing."""
        ...


class Changed:
    """Whole answers, sent when they differ from the last one."""

    def __init__(self) -> None:
        self._last: object = None

    def of(self, found: Any) -> object | None:
        """Return the answer if it has changed."""
        if found == self._last:
            return None
        self._last = found
        return found


class NewLines:
    """Lines of the log, each sent once."""

    def __init__(self) -> None:
        self._known: dict[tuple[object, ...], None] = {}
        self._is_first = True

    def of(self, found: Mapping[str, Sequence[Mapping[str, Any]]]) -> object | None:
        """Return the answer with the new lines alone; the first one in any case."""
        lines = [line for line in found["lines"] if _identity(line) not in self._known]
        self._known |= {_identity(line): None for line in lines}
        for old in list(self._known)[:-_MOST_KNOWN]:
            del self._known[old]
        is_sent, self._is_first = bool(lines) or self._is_first, False
        return {**found, "lines": lines} if is_sent else None


def _identity(line: Mapping[str, Any]) -> tuple[object, ...]:
    return line["stamp_ns"], line["node"], line["text"]
