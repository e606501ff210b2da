"""The last log lines and the last parameter changes of a run, kept for queries."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from busflow.log import LEVELS, LogRecord
from busflow.runner.rosout import line_text

if TYPE_CHECKING:
    from busflow.clock import Clock
    from busflow.node.parameter_store import ParameterStore, SetResult
    from busflow.node.parameters import Parameters


DEPTH = 1000


@dataclass(frozen=True, slots=True)
class LogLine:
    """One log line, with the fields of `/rosout`."""

    stamp_ns: int
    level: int
    """ROS 2's number of the level: 10 is debug, 50 critical."""
    node: str
    text: str


class LogBook:
    """The last log lines. Their values are stored as text, so they keep no objects alive and never change."""

    def __init__(self) -> None:
        self.written: int = 0
        """How many lines there were, those included that are no longer kept."""
        self._lines: deque[LogLine] = deque(maxlen=DEPTH)

    def write(self, record: LogRecord) -> None:
        """Keep a line; this is a sink of the run's log."""
        self.written += 1
        self._lines.append(LogLine(record.stamp_ns, LEVELS.get(record.level, 20), record.node, line_text(record)))

    def last(self, count: int, *, node: str | None = None, level: int = 0) -> list[LogLine]:
        """Return up to `count` lines, the oldest first, of one node or all, from a level on."""
        fit = [line for line in tuple(self._lines) if line.level >= level and node in (None, line.node)]
        return fit[-count:] if count > 0 else []


_KEPT = 1000


class ParameterLog:
    """The last parameter changes of a running graph; the oldest is dropped first."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._changes: deque[dict[str, Any]] = deque(maxlen=_KEPT)
        self._last = 0

    def follow(self, store: ParameterStore) -> None:
        """Record the changes of a node's parameters from now on."""

        def keep(_old: Parameters, result: SetResult) -> None:
            for change in result.changed:
                self._last += 1
                values = {"name": change.name, "old": change.old, "new": change.new}
                place = {"sequence": self._last, "stamp_ns": self._clock.now().nanoseconds, "node": store.node}
                self._changes.append(place | values)

        store.on_change.append(keep)

    def since(self, sequence: int | None) -> dict[str, Any]:
        """Return `{last, changes}`: the changes after this number, all known ones for 0, none for None.

        A gap between the number and the first change says how many were forgotten.
        """
        changes = [] if sequence is None else [each for each in self._changes if each["sequence"] > sequence]
        return {"last": self._last, "changes": changes}
