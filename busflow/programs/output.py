"""Output: the lines that a program prints, in the log; of a flood only some, and the number of the others."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from busflow.clock import perf_counter

if TYPE_CHECKING:
    from busflow.log import Logger

LINES_PER_SECOND = 1000
"""The most lines of a program that the log takes in a second."""
_HELD_UP = 10
"""Multiple of that rate above which reading pauses and so holds up the program; else it would take a whole core."""


class Output:
    """Writes a program's lines to the log, in the thread that reads them."""

    def __init__(self, log: Logger, ready: str | None, on_ready: Callable[[], None]) -> None:
        """Begin without lines; `on_ready` is called with each line that has the text `ready`."""
        self.lines: int = 0
        """The number of lines so far."""
        self.left_out: int = 0
        """The number of those that are not in the log."""
        self._log, self._ready, self._on_ready = log, ready, on_ready
        self._since_s = perf_counter()
        self._in_second = 0
        """The number of lines since then."""
        self._wait = threading.Event()
        self._early: list[str] | None = []
        """Lines from before `begin`; None after it."""

    def begin(self) -> None:
        """Log from now on, now that the log says that the program is started; first what it has printed already."""
        early, self._early = self._early or (), None
        for line in early:
            self._take(line)

    def write(self, line: str) -> None:
        """Log a line, unless too many have come in this second."""
        self._begin_second()
        self.lines += 1
        self._in_second += 1
        is_logged = self._in_second <= LINES_PER_SECOND
        self.left_out += not is_logged
        if is_logged and self._early is not None:
            self._early.append(line)
        else:
            self._take(line, is_logged=is_logged)
        if self._in_second > LINES_PER_SECOND * _HELD_UP:
            self._wait.wait(max(0.0, self._since_s + 1.0 - perf_counter()))

    def _take(self, line: str, *, is_logged: bool = True) -> None:
        if is_logged:
            self._log.info(line.rstrip("\r"))
        if self._ready is not None and self._ready in line:
            self._on_ready()  # after the line is in the log, before what follows from it

    def finish(self) -> None:
        """Say what was left out last; another life of the program may follow."""
        self.begin()
        self._report_flood()
        self._in_second, self._early = 0, []

    def _begin_second(self) -> None:
        now_s = perf_counter()
        if now_s - self._since_s >= 1.0:
            self._report_flood()
            self._since_s, self._in_second = now_s, 0

    def _report_flood(self) -> None:
        if (more := self._in_second - LINES_PER_SECOND) > 0:
            text = f"lines left out: it prints more than {LINES_PER_SECOND} in a second"
            self._log.warning(f"{more} {text}")
