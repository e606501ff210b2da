"""Recorded ticks of timers: the clock that replays them, and the ticks that are still to come.

A recording holds each tick of a timer in its place between the messages. A tick that is due on the timer's own grid, by
the period that it had, comes at that place; any other comes on the grid. So a node that ticks at another rate than
before does so when it is replayed, and one that does not meets its messages in the recorded order.

A recording of hours holds millions of ticks. Only those up to the next one of the slowest timer are in memory.
"""

from __future__ import annotations

import asyncio
from collections import Counter, defaultdict, deque
from collections.abc import Callable, Collection, Generator, Mapping
from typing import TYPE_CHECKING, Any

from busflow.bus.timer import Timer
from busflow.clock import SimClock
from busflow.recording.recorder.ticks import TICKS, Tick
from busflow.recording.replay.history import tick_of
from busflow.runner.loops.virtual import VirtualLoop

if TYPE_CHECKING:
    from busflow.recording.bag.bag import Bag


class ReplayClock(SimClock):
    """Simulated time that leads the timers of some nodes."""

    def __init__(self, loop: VirtualLoop, started_ns: int, *, slack_ns: int) -> None:
        """The time of a recording that was begun at a moment of its clock.

        Args:
            loop: Whose time it is.
            started_ns: When the recorded run began.
            slack_ns: How far a recorded tick may be from the timer's own grid: real timers are late, and the run
                began a little before its nodes did.
        """
        super().__init__(epoch_ns=started_ns, loop=loop)
        self._virtual, self._slack_ns = loop, slack_ns
        self._coming: ComingTicks | None = None
        self._waiting: dict[tuple[str, str], asyncio.TimerHandle] = {}
        self.unmet: int = 0
        """Recorded ticks for which no timer waited."""

    def expect(self, coming: ComingTicks) -> None:
        """Know what will come."""
        self._coming = coming

    def call_at(self, deadline_ns: int, callback: Callable[[], object]) -> asyncio.TimerHandle:
        """Have the loop call back at the deadline; a timer, at its next recorded tick if that is the one."""
        timer: Any = getattr(callback, "__self__", None)
        if isinstance(timer, Timer) and self._is_recorded(timer, deadline_ns):
            handle = asyncio.TimerHandle(deadline_ns / 1e9, callback, (), self._virtual)
            self._waiting[timer.node, timer.name] = handle
            return handle
        return super().call_at(deadline_ns, callback)

    def tick(self, tick: Tick) -> None:
        """Let a timer tick that waits for this; called when all that was recorded before has happened."""
        if self._coming is not None:
            self._coming.come(tick)
        handle = self._waiting.pop((tick.node, tick.timer), None)
        if handle is None or handle.cancelled():
            self.unmet += 1
        else:
            self._virtual.call_soon(handle._run)  # noqa: SLF001 - a handle has no other way to be called

    def _is_recorded(self, timer: Timer, deadline_ns: int) -> bool:
        """True if a timer that is due now ticked in the recording."""
        if self._coming is None:
            return False
        due_ns = self.now().nanoseconds + deadline_ns - self.monotonic_ns()
        tick = self._coming.next((timer.node, timer.name), due_ns + self._slack_ns)
        return tick is not None and tick.period_s == timer.period_s and abs(tick.time_ns - due_ns) <= self._slack_ns


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
            in_order: Whether their times never step back: then the time of one shows that all earlier ones were read.
        """
        self.held: int = 0
        """The number of known ticks that are yet to come."""
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
