"""Dispatcher: hands queued messages to handlers, fairly, on one event loop.

Theory of operation. A subscription with messages stands in one ready line per bus, once. The dispatcher lets
each in turn handle at most `QUANTUM` messages and gives the loop back after its budget, so that no flood can
starve a timer or another node. Entering the line wakes the dispatcher with one `call_soon`. The runtime's own
entry points (timers, the inbox of other threads) come through `run_now` instead: what they publish is delivered
before they return, without another turn of the loop, whose `select` would be the dearest part of a delivery.
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
"""Wall time after which the loop gets its turn: bounds how late a flood makes a timer."""
SLOW_S = 0.01
"""A turn that takes longer is that of slow handlers; what a look at the time costs does not matter then."""
BUDGET_MESSAGES = 256
"""The same in virtual time, where wall time must not decide anything."""


class Runnable(Protocol):
    """What stands in the ready line: a subscription with messages waiting."""

    def turn(self, limit: int) -> int:
        """Handle up to `limit` messages, get back in line if more wait, and say how many it was."""
        ...


class Chooser(Protocol):
    """Who decides what the order of deliveries leaves open, for a test that looks for races."""

    def pick(self, ready: Sequence[Runnable]) -> int:
        """Who in the line has its turn; 0 is the first."""
        ...

    def share(self, most: int) -> int:
        """How many messages it may handle, from 1 to `most`."""
        ...

    def rests(self) -> bool:
        """Whether the loop gets its turn now, as when the budget is used up."""
        ...


class Dispatcher:
    """The ready line of one bus and the one who serves it."""

    __slots__ = ("_awake", "_explore", "_loop", "_virtual", "quantum", "ready")

    def __init__(self, *, virtual: bool = False, explore: Chooser | None = None) -> None:
        """A dispatcher that budgets by messages when `virtual`, and serves as `explore` chooses if there is one."""
        self.ready: deque[Runnable] = deque()
        self.quantum = QUANTUM
        """Messages of a turn: one, while handlers take so long that the loop would stand still over eight of them."""
        self._loop: asyncio.AbstractEventLoop | None = None
        self._awake = False
        self._virtual = virtual
        self._explore = explore

    def open(self, loop: asyncio.AbstractEventLoop) -> None:
        """Serve on this loop from now on, first of all what already waits in line."""
        self._loop = loop
        if self.ready:
            self._awake = True
            loop.call_soon(self._dispatch)

    def close(self) -> None:
        """Serve no more: what waits stays queued and counted."""
        self._loop = None
        self._awake = False

    def statistics(self) -> DispatcherStatistics:
        """How busy the dispatcher is now."""
        return DispatcherStatistics(ready=len(self.ready), quantum=self.quantum)

    def schedule(self, runnable: Runnable) -> None:
        """Put a subscription in line; it must not stand there already."""
        self.ready.append(runnable)
        if not self._awake and self._loop is not None:
            self._awake = True
            self._loop.call_soon(self._dispatch)

    def run_now(self, callback: Callable[[], None]) -> None:
        """Run an entry point of the runtime and deliver what it published before returning."""
        if self._awake or self._loop is None:
            callback()
            return
        self._awake = True
        try:
            callback()
        finally:
            self._dispatch()

    def now(self) -> float:
        """The moment a batch of an `async` handler begins, for `spent`."""
        return 0.0 if self._virtual else perf_counter()

    def spent(self, started: float, handled: int) -> bool:
        """Whether a batch that began at `started` and handled so many messages has had its share of the loop."""
        if self._virtual:
            return handled >= (QUANTUM if self._explore else BUDGET_MESSAGES)
        if handled < self.quantum or (took_s := perf_counter() - started) <= BUDGET_S:
            return False
        self.quantum = 1 if took_s > SLOW_S else QUANTUM
        return True

    async def rest(self) -> None:
        """Give the loop its turn after such a batch, on wall time with all timers that are due."""
        await asyncio.sleep(0)
        if not self._virtual:  # a loop goes on with a task that yields before it calls a timer, but not a second time
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
        finally:  # whatever one turn may raise, the others get theirs
            if self.ready and self._loop is not None:
                self._go_on_later(self._loop)
            else:
                self._awake = False

    def _go_on_later(self, loop: asyncio.AbstractEventLoop) -> None:
        """Take the next turn of the loop, on wall time after all timers that are due.

        A loop calls what `call_soon` left with it before any timer: one would come a budget later than it has to.
        """
        if self._virtual:
            loop.call_soon(self._dispatch)
        else:
            loop.call_later(0, self._dispatch)

    def _serve_by_time(self) -> None:
        ready = self.ready
        if not ready:  # an entry point that published nothing does not ask for the time
            return
        end = perf_counter() + BUDGET_S
        while True:
            ready.popleft().turn(self.quantum)
            if not ready:
                return
            if (now := perf_counter()) > end:
                self.quantum = 1 if now > end + SLOW_S else QUANTUM
                return

    def _serve_by_count(self) -> None:
        ready = self.ready
        left = BUDGET_MESSAGES
        while ready and left > 0:
            left -= max(1, ready.popleft().turn(QUANTUM))

    def _serve_as_chosen(self, chooser: Chooser) -> None:
        ready = self.ready
        left = BUDGET_MESSAGES
        while ready and left > 0:
            picked = chooser.pick(ready)
            runnable = ready[picked]
            del ready[picked]
            left -= max(1, runnable.turn(chooser.share(QUANTUM)))
            if ready and chooser.rests():
                return
