"""Carried: counts of what a bridge has carried, and the log lines that it writes about its neighbours."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field

_MOST_LINES = 100
"""Different lines about neighbours that are logged; the others are counted."""


@dataclass(slots=True)
class Carried:
    """Counts of messages and calls, and of what could not be carried."""

    log: Callable[[str], None]
    """Writes a line of the log, as a warning."""
    into_run: int = 0
    out_of_run: int = 0
    calls: int = 0
    dropped: int = 0
    """Messages that were lost here: the other side was too slow."""
    faults: int = 0
    """Messages, names and types of neighbours that were not valid."""
    _lines: set[str] = field(default_factory=set[str])
    _counting: threading.Lock = field(default_factory=threading.Lock)

    def fault(self, line: str) -> None:
        """Count a fault, and log its line once."""
        with self._counting:
            self.faults += 1
        self.warn(line)

    def warn(self, line: str) -> None:
        """Log a line, unless it stands in the log already, or too many do."""
        with self._counting:
            is_new = line not in self._lines and len(self._lines) < _MOST_LINES
            if is_new:
                self._lines.add(line)
        if is_new:
            self.log(line)

    def __str__(self) -> str:
        text = f"{self.out_of_run} messages carried to DDS, {self.into_run} from DDS, {self.calls} calls"
        text += f"; {self.dropped} dropped" if self.dropped else ""
        return text + (f"; {self.faults} faults of neighbours" if self.faults else "")
