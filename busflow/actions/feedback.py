"""FeedbackQueue: the feedback on one goal of a client, until a task reads it."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Iterable
from typing import Any

from busflow import timeouts
from busflow.clock import NS_PER_S, Clock

DEPTH = 10
"""The default number of feedback messages that wait for the task that reads them."""


class FeedbackQueue:
    """A bounded queue of feedback, which knows whether more is to come after the result."""

    def __init__(self, depth: int, clock: Clock) -> None:
        self.items: deque[Any] = deque(maxlen=depth)
        """The feedback that waits."""
        self.waiting: list[asyncio.Future[None]] = []
        """One future for each task that waits for more."""
        self._clock = clock
        self._come = 0
        """The number of feedback messages that have come."""
        self._expected = 0
        self._patience: asyncio.TimerHandle | None = None
        """The limit of the wait for what was published before the result; None if nothing is waited for."""

    @property
    def is_late(self) -> bool:
        """True if feedback from before the result is still to come."""
        return self._patience is not None

    def push(self, feedback: Any) -> bool:
        """Add feedback, and return True if that drops the oldest."""
        full = len(self.items) == self.items.maxlen
        self.items.append(feedback)
        self._come += 1
        if self.is_late:
            self.expect(self._expected)
        wake(self.waiting)
        return full

    def expect(self, count: int) -> None:
        """Wait until as many have come as were published before the result, or no more comes for a while."""
        self.end()
        if count > self._come:
            self._expected = count
            patience_ns = round(timeouts.current.late_feedback * NS_PER_S)
            self._patience = self._clock.call_at(self._clock.monotonic_ns() + patience_ns, self.end)

    def end(self) -> None:
        """Expect no more: all has come, the time is over, or the block of the goal was left."""
        if self._patience is not None:
            self._patience.cancel()
            self._patience = None
            wake(self.waiting)


def wake(waiting: Iterable[asyncio.Future[None]]) -> None:
    """Wake the tasks that wait by these futures."""
    for each in waiting:
        if not each.done():
            each.set_result(None)
