"""Recorded ticks of timers: the clock that replays them, and the ticks that are still to come.

A recording holds each tick of a timer in its place between the messages. A timer of the replay is due on its own grid,
which begins in the replay. If the recorded tick has the same period and is close to that time, the timer ticks at the
recorded place; otherwise it ticks when it is due. So a timer with a new period keeps that period in a replay, and with
the old period its ticks and the messages come in the recorded order.

A recording of hours holds millions of ticks. Only those up to the next tick of the slowest timer are in memory.
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
    """Simulated time on which timers tick as recorded."""

    def __init__(self, loop: VirtualLoop, started_ns: int, *, slack_ns: int) -> None:
        """Set the time to that at which the recorded run began.

        Args:
            loop: The loop whose virtual time this clock shows.
            started_ns: The time at which the recorded run began, by its own clock.
            slack_ns: The greatest distance of a recorded tick from the timer's own grid: real timers are late, and the
                run began a little before its nodes did.
        """
        super().__init__(epoch_ns=started_ns, loop=loop)
        self._virtual, self._slack_ns = loop, slack_ns
        self._coming: ComingTicks | None = None
        self._waiting: dict[tuple[str, str], asyncio.TimerHandle] = {}
        """By node and timer, the call that waits for the timer's next recorded tick."""
        self.unmet: int = 0
        """The number of recorded ticks for which no timer waited."""

    def expect(self, coming: ComingTicks) -> None:
        """Take the recorded ticks that will come; without them every timer ticks on its own grid."""
        self._coming = coming

    def call_at(self, deadline_ns: int, callback: Callable[[], object]) -> asyncio.TimerHandle:
        """Have the loop call back at the deadline; for a timer, at its next recorded tick if that is due then."""
        timer: Any = getattr(callback, "__self__", None)
        if isinstance(timer, Timer) and self._is_recorded(timer, deadline_ns):
            handle = asyncio.TimerHandle(deadline_ns / 1e9, callback, (), self._virtual)
            self._waiting[timer.node, timer.name] = handle
            return handle
        return super().call_at(deadline_ns, callback)

    def tick(self, tick: Tick) -> None:
        """Call the timer that waits for this recorded tick; all events recorded before it have been replayed."""
        if self._coming is not None:
            self._coming.come(tick)
        handle = self._waiting.pop((tick.node, tick.timer), None)
        if handle is None or handle.cancelled():
            self.unmet += 1
        else:
            self._virtual.call_soon(handle._run)  # noqa: SLF001 - a handle has no other way to be called

    def _is_recorded(self, timer: Timer, deadline_ns: int) -> bool:
        """Return whether the timer's next recorded tick has its period and is within the slack of the deadline."""
        if self._coming is None:
            return False
        due_ns = self.now().nanoseconds + deadline_ns - self.monotonic_ns()
        tick = self._coming.next((timer.node, timer.name), due_ns + self._slack_ns)
        return tick is not None and tick.period_s == timer.period_s and abs(tick.time_ns - due_ns) <= self._slack_ns


Key = tuple[str, str]
"""The names of a node and its timer."""


class ComingTicks:
    """The ticks of some nodes that are still to come, in the recorded order."""

    def __init__(self, bag: Bag, nodes: Collection[str], counts: Mapping[Key, int], *, in_order: bool) -> None:
        """Begin with the first tick of a recording.

        Args:
            bag: The recording, which is read a second time, in step with the first.
            nodes: The nodes whose ticks are wanted.
            counts: The number of ticks of each timer: after a timer's last tick no further one is looked for.
            in_order: True if no tick has an earlier time than one before it. Then a tick that was read shows that all
                ticks with earlier times were read too.
        """
        self.held: int = 0
        """The number of ticks in memory: they have been read and are still to come."""
        self._ticks = _ticks(bag, nodes)
        self._unread = Counter(counts)
        """The number of ticks that have not been read, by timer."""
        self._in_order = in_order
        self._ahead: defaultdict[Key, deque[Tick]] = defaultdict(deque)
        self._reached_ns = 0
        """The time of the last tick that was read."""

    def next(self, key: Key, until_ns: int) -> Tick | None:
        """Return a timer's next tick; None if it has none left, or if times are in order and none comes until then."""
        ahead = self._ahead[key]
        while not ahead and self._unread[key] > 0 and not (self._in_order and self._reached_ns > until_ns):
            if not self._read():
                break
        return ahead[0] if ahead else None

    def come(self, tick: Tick) -> None:
        """Remove this tick, the next of all in the recorded order: it has come."""
        ahead = self._ahead[tick.node, tick.timer]
        if ahead or self._read():
            ahead.popleft()
            self.held -= 1

    def close(self) -> None:
        """Stop reading the recording."""
        self._ticks.close()

    def _read(self) -> bool:
        """Read one more tick into memory; return False at the end of the recording."""
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
