"""Board: a page of memory that both processes see, on which the receiver notes what arrives."""

from __future__ import annotations

import mmap
import os
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks.crossing import FLOOD, HELLO

_GREETED, _FLOODED, _DONE, _RECEIVER, _PACED = range(5)
_CPU_CLOCK = 2
"""Linux's word for the CPU time of a whole process, in the number of a clock."""
_MOST = 4096
"""How many arrivals are noted with their times."""


class Board:
    """Both processes map the same file."""

    def __init__(self, file: Path) -> None:
        if not file.exists():
            file.write_bytes(bytes(8 * (_PACED + 1 + 2 * _MOST)))
        with file.open("r+b") as opened:
            self._words = memoryview(mmap.mmap(opened.fileno(), 0)).cast("q")

    def taker(self) -> Callable[[int], None]:
        """A function that notes a message by its first byte, as cheaply as can be."""
        words, now = self._words, time.perf_counter_ns
        words[_RECEIVER] = os.getpid()
        first = _PACED + 1

        def take(number: int) -> None:
            if number == FLOOD:
                words[_FLOODED] += 1
            elif number == HELLO:
                words[_GREETED] += 1
            else:
                at = words[_PACED]
                if at < _MOST:
                    words[first + at] = now()
                    words[first + _MOST + at] = number
                    words[_PACED] = at + 1

        return take

    @property
    def greeted(self) -> int:
        """How many of the first messages have arrived."""
        return self._words[_GREETED]

    @property
    def flooded(self) -> int:
        """How many messages of the flood have arrived."""
        return self._words[_FLOODED]

    def cpu_s(self) -> float:
        """The CPU time that this process and the receiver's have taken so far."""
        return time.process_time() + cpu_s(self._words[_RECEIVER])

    @property
    def paced(self) -> list[tuple[int, int]]:
        """When each of the paced messages arrived, and its number."""
        first, count = _PACED + 1, self._words[_PACED]
        times = self._words[first : first + count].tolist()
        return list(zip(times, self._words[first + _MOST : first + _MOST + count].tolist(), strict=True))

    @property
    def done(self) -> bool:
        """Whether the sender has ended."""
        return self._words[_DONE] > 0

    def finish(self) -> None:
        """Have the receiver end."""
        self._words[_DONE] = 1


def cpu_s(pid: int) -> float:
    """The CPU time that a process has taken so far; Linux has a clock for each."""
    return time.clock_gettime((~pid << 3) | _CPU_CLOCK)
