"""`ComingTicks`: the recorded ticks of timers that are still to come, read no further ahead than somebody has to know.

A recording of hours holds millions of them. What is held are those up to the next one of the slowest timer.
"""

from __future__ import annotations

from collections import Counter, defaultdict, deque
from collections.abc import Collection, Generator, Mapping
from typing import TYPE_CHECKING

from busflow.recording.recorder.ticks import TICKS, Tick
from busflow.recording.replay.history import tick_of

if TYPE_CHECKING:
    from busflow.recording.bag.bag import Bag

Key = tuple[str, str]
"""A node and its timer."""


class ComingTicks:
    """The ticks of some nodes, in the recorded order."""

    def __init__(self, bag: Bag, nodes: Collection[str], counts: Mapping[Key, int], *, in_order: bool) -> None:
        """The ticks of a recording from its beginning on.

        Args:
            bag: The recording, which is read a second time, in step with the first.
            nodes: Whose ticks are wanted.
            counts: How many ticks of each timer there are, so that none is looked for after the last.
            in_order: Whether their times never step back: then the time of one tells that all earlier ones were read.
        """
        self.held = 0
        """How many are known and have yet to come."""
        self._ticks = _ticks(bag, nodes)
        self._unread = Counter(counts)
        self._in_order = in_order
        self._ahead: defaultdict[Key, deque[Tick]] = defaultdict(deque)
        self._reached_ns = 0

    def next(self, key: Key, until_ns: int) -> Tick | None:
        """The next tick of a timer; None where there is none until this moment, or none at all."""
        ahead = self._ahead[key]
        while not ahead and self._unread[key] > 0 and not (self._in_order and self._reached_ns > until_ns):
            if not self._read():
                break
        return ahead[0] if ahead else None

    def come(self, tick: Tick) -> None:
        """This tick, the next of all in the recorded order, has come."""
        ahead = self._ahead[tick.node, tick.timer]
        if ahead or self._read():
            ahead.popleft()
            self.held -= 1

    def close(self) -> None:
        """Let go of the file."""
        self._ticks.close()

    def _read(self) -> bool:
        tick = next(self._ticks, None)
        if tick is None:
            return False
        key = tick.node, tick.timer
        self._ahead[key].append(tick)
        self._unread[key] -= 1
        self._reached_ns = tick.time_ns
        self.held += 1
        return True


def _ticks(bag: Bag, nodes: Collection[str]) -> Generator[Tick]:
    for entry in bag.entries([TICKS]):
        tick = tick_of(entry)
        if tick is not None and tick.node in nodes:
            yield tick
