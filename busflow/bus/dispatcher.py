"""Dispatcher: delivers queued messages to handlers, fairly, on one event loop.

Theory of operation. A bus has one ready line; a subscription with messages is in it once. The dispatcher lets each in
turn handle at most `QUANTUM` messages and yields to the event loop after its budget, so that no flood can starve a
timer or another node. Entering the line wakes the dispatcher with one `call_soon`. The runtime's own entry points
(timers, the inbox of other threads) use `run_now` instead: their messages are delivered before they return, without
another turn of the loop, whose `select` would cost more than the rest of a delivery.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence
from typing import Protocol

from busflow.bus.statistics import DispatcherStatistics
from busflow.clock import perf_counter

QUANTUM = 8
"""Messages a subscription may handle before the next one's turn."""
BUDGET_S = 0.0002
"""Wall time after which the dispatcher yields to the loop; it bounds the delay of timers in a flood."""
SLOW_S = 0.01
"""A longer turn of `QUANTUM` messages means slow handlers, for which the cost of reading the clock does not matter."""
BUDGET_MESSAGES = 256
"""The budget in messages for virtual time, where wall time must not decide anything."""


class Runnable(Protocol):
    """An entry of the ready line: a subscription or server with queued items."""

    def turn(self, limit: int) -> int:
        """Handle up to `limit` items, re-enter the line if more wait, and return the number handled."""
        ...


class Chooser(Protocol):
    """Chooses among the permitted orders of delivery, for a test that looks for races."""

    def pick(self, ready: Sequence[Runnable]) -> int:
        """Choose the entry of the line that runs next; 0 is the first."""
        ...

    def share(self, most: int) -> int:
        """Choose how many messages it may handle, from 1 to `most`."""
        ...

    def rests(self) -> bool:
        """Choose whether to yield to the loop now, as if the budget were used up."""
        ...


class Dispatcher:
    """The ready line of one bus, and the loop callback that serves it."""

    __slots__ = ("_awake", "_explore", "_loop", "_virtual", "quantum", "ready")

    def __init__(self, *, virtual: bool = False, explore: Chooser | None = None) -> None:
        """Create a dispatcher; `virtual` budgets by messages, `explore` chooses the order."""
        self.ready: deque[Runnable] = deque()
        self.quantum: int = QUANTUM
        """Messages per turn: 1 while handlers are so slow that eight of them would block the loop."""
        self._loop: asyncio.AbstractEventLoop | None = None
        self._awake = False
        self._virtual = virtual
        self._explore = explore

    def open(self, loop: asyncio.AbstractEventLoop) -> None:
        """Start to serve on this loop, beginning with the entries already in line."""
        self._loop = loop
        if self.ready:
            self._awake = True
            loop.call_soon(self._dispatch)

    def close(self) -> None:
        """Stop serving; waiting messages stay queued and counted."""
        self._loop = None
        self._awake = False

    def statistics(self) -> DispatcherStatistics:
        """Return the current load of the dispatcher."""
        return DispatcherStatistics(ready=len(self.ready), quantum=self.quantum)

    def schedule(self, runnable: Runnable) -> None:
        """Add a subscription or server to the line; it must not be in it already."""
        self.ready.append(runnable)
        if not self._awake and self._loop is not None:
            self._awake = True
            self._loop.call_soon(self._dispatch)

    def run_now(self, callback: Callable[[], None]) -> None:
        """Run an entry point of the runtime, and deliver its messages before returning."""
        if self._awake or self._loop is None:
            callback()
            return
        self._awake = True
        try:
            callback()
        finally:
            self._dispatch()

    def now(self) -> float:
        """Return the start time of a batch of an `async` handler, for `spent`."""
        return 0.0 if self._virtual else perf_counter()

    def spent(self, started: float, handled: int) -> bool:
        """Return whether a batch that began at `started` and handled this many messages has used its budget."""
        if self._virtual:
            return handled >= (QUANTUM if self._explore else BUDGET_MESSAGES)
        if handled < self.quantum or (took_s := perf_counter() - started) <= BUDGET_S:
            return False
        self.quantum = 1 if took_s > SLOW_S else QUANTUM
        return True

    async def rest(self) -> None:
        """Yield to the loop after such a batch; on wall time, all due timers run too."""
        await asyncio.sleep(0)
        if not self._virtual:  # a loop resumes a task that yields once before it runs timers
            await asyncio.sleep(0)

    def _dispatch(self) -> None:
        loop = self._loop
        if loop is None:
            return
        try:
            if self._explore is not None:
                self._serve_as_chosen(self._explore)
            elif self._virtual:
                self._serve_by_count()
            else:
                self._serve_by_time()
        finally:  # an exception in one turn does not cancel the others
            if self.ready and self._loop is not None:
                self._go_on_later(self._loop)
            else:
                self._awake = False

    def _go_on_later(self, loop: asyncio.AbstractEventLoop) -> None:
        """Continue in the next turn of the loop; on wall time, after all due timers.

        A loop runs `call_soon` callbacks before timers, which would delay each timer by one more budget.
        """
        if self._virtual:
            loop.call_soon(self._dispatch)
        else:
            loop.call_later(0, self._dispatch)

    def _serve_by_time(self) -> None:
        ready = self.ready
        if not ready:  # an entry point that published nothing need not read the clock
            return
        end = perf_counter() + BUDGET_S
        while True:
            ready.popleft().turn(self.quantum)
            if not ready:
                return
            if (now := perf_counter()) > end:
                self.quantum = 1 if now > end + SLOW_S * self.quantum / QUANTUM else QUANTUM
                return

    def _serve_by_count(self) -> None:
        ready = self.ready
        left = BUDGET_MESSAGES
        while ready and left > 0:
            left -= ready.popleft().turn(QUANTUM) or 1

    def _serve_as_chosen(self, chooser: Chooser) -> None:
        ready = self.ready
        left = BUDGET_MESSAGES
        while ready and left > 0:
            picked = chooser.pick(ready)
            runnable = ready[picked]
            del ready[picked]
            left -= runnable.turn(chooser.share(QUANTUM)) or 1
            if ready and chooser.rests():
                return
