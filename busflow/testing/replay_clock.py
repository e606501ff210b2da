"""ReplayClock: the time of a recording, in which a timer ticks where it ticked when it was recorded.

A recording holds each tick of a timer in its place between the messages. A tick that is due on the timer's own grid, by
the period that it had, comes at that place; any other comes on the grid. So a node that ticks at another rate than
before does so when it is replayed, and one that does not meets its messages in the recorded order.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from busflow.clock import SimClock
from busflow.recording.ticks import Tick
from busflow.testing.loop import VirtualLoop
from busflow.timers import Timer


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
        self._coming: dict[tuple[str, str], deque[Tick]] = {}
        self._waiting: dict[tuple[str, str], asyncio.TimerHandle] = {}
        self.unmet = 0
        """Recorded ticks for which no timer waited."""

    def expect(self, ticks: Mapping[tuple[str, str], deque[Tick]]) -> None:
        """Know what will come, by node and timer."""
        self._coming = dict(ticks)

    def call_at(self, deadline_ns: int, callback: Callable[[], object]) -> asyncio.TimerHandle:
        """Have the loop call back at the deadline; a timer, at its next recorded tick if that is the one."""
        timer: Any = getattr(callback, "__self__", None)
        if isinstance(timer, Timer):
            key = timer.node, timer.name
            coming = self._coming.get(key)
            if coming and self._is_due(coming[0], timer, deadline_ns):
                handle = asyncio.TimerHandle(deadline_ns / 1e9, callback, (), self._virtual)
                self._waiting[key] = handle
                return handle
        return super().call_at(deadline_ns, callback)

    def tick(self, tick: Tick) -> None:
        """Let a timer tick that waits for this; called when all that was recorded before has happened."""
        key = tick.node, tick.timer
        coming = self._coming.get(key)
        if coming and coming[0] == tick:
            coming.popleft()
        handle = self._waiting.pop(key, None)
        if handle is None or handle.cancelled():
            self.unmet += 1
        else:
            self._virtual.call_soon(handle._run)  # noqa: SLF001 - a handle has no other way to be called

    def _is_due(self, tick: Tick, timer: Timer, deadline_ns: int) -> bool:
        due_ns = self.now().nanoseconds + deadline_ns - self.monotonic_ns()
        return tick.period_s == timer.period_s and abs(tick.time_ns - due_ns) <= self._slack_ns
