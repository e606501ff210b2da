"""ReplayClock: the time of a recording, in which a timer ticks where it ticked when it was recorded.

A recording holds each tick of a timer in its place between the messages. A tick that is due on the timer's own grid, by
the period that it had, comes at that place; any other comes on the grid. So a node that ticks at another rate than
before does so when it is replayed, and one that does not meets its messages in the recorded order.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from busflow.bus.timer import Timer
from busflow.clock import SimClock
from busflow.recording.recorder.ticks import Tick
from busflow.runner.loops.virtual import VirtualLoop

if TYPE_CHECKING:
    from busflow.recording.replay.ticks import ComingTicks


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
        self.unmet = 0
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
        """Whether a timer ticked when it is due now."""
        if self._coming is None:
            return False
        due_ns = self.now().nanoseconds + deadline_ns - self.monotonic_ns()
        tick = self._coming.next((timer.node, timer.name), due_ns + self._slack_ns)
        return tick is not None and tick.period_s == timer.period_s and abs(tick.time_ns - due_ns) <= self._slack_ns
