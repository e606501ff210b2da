"""The last lines of a run's log, kept as text for whoever asks."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from busflow.log import LEVELS, LogRecord
from busflow.runner.rosout import line_text

DEPTH = 1000


@dataclass(frozen=True, slots=True)
class LogLine:
    """One line, as `/rosout` has it."""

    stamp_ns: int
    level: int
    """As ROS 2 numbers it: 10 is debug, 50 critical."""
    node: str
    text: str


class LogBook:
    """Keeps the last lines; the values in them are text, so that nothing large is kept alive and nothing changes."""

    def __init__(self) -> None:
        self.written = 0
        """How many lines there were, those included that are no longer kept."""
        self._lines: deque[LogLine] = deque(maxlen=DEPTH)

    def write(self, record: LogRecord) -> None:
        """Keep a line; a sink of the run's log."""
        self.written += 1
        self._lines.append(LogLine(record.stamp_ns, LEVELS.get(record.level, 20), record.node, line_text(record)))

    def last(self, count: int, *, node: str | None = None, level: int = 0) -> list[LogLine]:
        """Up to `count` lines, the oldest first: of one node, from a level on."""
        fit = [line for line in tuple(self._lines) if line.level >= level and node in (None, line.node)]
        return fit[-count:] if count > 0 else []
