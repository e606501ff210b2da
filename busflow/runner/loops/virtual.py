"""An event loop on virtual time: it never waits, it jumps to the next deadline once nothing is left to run.

All that waits on this loop waits in virtual time: `asyncio.sleep`, `asyncio.timeout`, `anyio.move_on_after`. An hour
of virtual time takes no real time, and its events come in the same order every time.
"""

from __future__ import annotations

import asyncio
import heapq
import math
import selectors
import sys
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from contextvars import Context
from typing import Any, TypeAlias, TypeVar, TypeVarTuple, Unpack

from busflow import timeouts
from busflow.clock import NS_PER_S, perf_counter
from busflow.errors import Deadlock
from busflow.runner import own_process
from busflow.runner.loops.endless_calls import EndlessCalls
from busflow.runner.loops.schedule import AnyOrder, Schedule
from busflow.runner.loops.stalls import waiting
from busflow.runner.orphan_tasks import OrphanTasks

T = TypeVar("T")
Ts = TypeVarTuple("Ts")
Events: TypeAlias = list[tuple[selectors.SelectorKey, int]]

HORIZON_S = 86_400.0
"""The default end of virtual time in a test: without one, a test with periodic timers could wait in vain for ever."""
_TURNS = 1_000_000
"""Turns of the loop at one instant; more of them are an endless loop."""
_THREAD_POLL_S = 0.01
THREAD_S = 10.0
"""Limit of real time in a test for one call in a worker thread, during which virtual time stands still; a default."""


class VirtualLoop(asyncio.SelectorEventLoop):
    """Virtual time that starts at zero, counted in whole nanoseconds.

    Deadlines that are equal keep the order in which they were asked for. Time stands still while a worker thread
    (`anyio.to_thread`, `run_in_executor`) works. Sockets are polled, but time does not wait for them.

    Args:
        schedule: The order of ready tasks and timers; None keeps asyncio's.
        horizon_s: The end of virtual time, with an error that names the tasks that still wait.
        rate: Virtual seconds per real one; None is as fast as possible.
        follows: Whether only `move_to` moves time, as the messages of a simulator say.
        thread_s: Real seconds that one call in a worker thread may take; virtual time stands still for it.
        ends_handlers: Whether `stuck_handlers` lets a handler fail that takes longer than `thread_s`, as in a test. In
            a run it only warns, since a node may compute for longer.
    """

    _ready: deque[asyncio.Handle]

    def __init__(
        self,
        *,
        schedule: Schedule | None = None,
        horizon_s: float = math.inf,
        rate: float | None = None,
        follows: bool = False,
        thread_s: float = THREAD_S,
        ends_handlers: bool = True,
    ) -> None:
        self.thread_s: float = thread_s
        self.ends_handlers: bool = ends_handlers
        self.schedule: Schedule | None = schedule
        self.follows: bool = follows
        self._rate, self._began_s = rate, perf_counter()
        self._now_ns, self._now_s = 0, 0.0
        self._horizon_ns = math.inf if math.isinf(horizon_s) else round(horizon_s * NS_PER_S)
        self._timers: list[tuple[int, int, asyncio.TimerHandle]] = []
        self._timers_made = self._timers_cancelled = 0
        self._limits: list[tuple[float, int, asyncio.Handle]] = []
        self._settling: deque[asyncio.Future[None]] = deque()
        self._threads = self._turns = self._unpolled = 0
        self.watchers = 0
        """Number of threads that only watch the loop, and never give it anything to do."""
        self._endless = EndlessCalls(thread_s)
        self._input = _Selector(self._next_events)
        super().__init__(self._input)
        if schedule is not None:
            self._ready = AnyOrder(self._ready, schedule)
            schedule.attach(self, self.time_ns)
        self.orphans: OrphanTasks = OrphanTasks(self)
        """Failed tasks that nothing awaits."""

    def time(self) -> float:
        """Virtual seconds."""
        return self._now_s

    def time_ns(self) -> int:
        """Virtual nanoseconds, exactly."""
        return self._now_ns

    @property
    def moment(self) -> tuple[int, int]:
        """Time and turn, which another thread may read: they stay the same only within one turn."""
        return self._now_ns, self._turns

    async def settle(self) -> None:
        """Run everything that is due now; time does not move."""
        future = self.create_future()
        self._settling.append(future)
        await future

    async def advance(self, seconds: float) -> None:
        """Let time pass, and run everything that is due until its end, the last instant included."""
        end = self.create_future()
        self.call_at_ns(self._now_ns + round(seconds * NS_PER_S), lambda: end.done() or end.set_result(None))
        await end
        await self.settle()

    def move_to(self, now_ns: int) -> None:
        """Move time forward: all that was due by then is due now."""
        self._now_ns = max(self._now_ns, now_ns)
        self._now_s = max(self._now_s, self._now_ns / NS_PER_S)
        self._turns = 0
        self._release_due()

    def call_at(
        self, when: float, callback: Callable[[Unpack[Ts]], object], *args: *Ts, context: Context | None = None
    ) -> asyncio.TimerHandle:
        """Call back at a virtual time in seconds, to the nearest nanosecond; at infinity never."""
        return self._schedule(when, _to_ns(when), callback, args, context)

    def call_later(
        self, delay: float, callback: Callable[[Unpack[Ts]], object], *args: *Ts, context: Context | None = None
    ) -> asyncio.TimerHandle:
        """Call back after virtual seconds, to the nearest nanosecond; after infinity never."""
        delay_ns = _to_ns(delay)
        when_ns = None if delay_ns is None else self._now_ns + delay_ns
        return self._schedule(self._now_s + delay, when_ns, callback, args, context)

    def call_at_ns(self, when_ns: int, callback: Callable[[], object]) -> asyncio.TimerHandle:
        """Call back at exactly that virtual time."""
        return self._schedule(when_ns / NS_PER_S, when_ns, callback, (), None)

    def call_after_wall(self, seconds: float, callback: Callable[[], object]) -> asyncio.Handle:
        """Call back after real seconds, for a limit in real time; at once if nothing else is left that could happen."""
        self._timers_made += 1
        handle = asyncio.Handle(callback, (), self)
        heapq.heappush(self._limits, (perf_counter() + seconds, self._timers_made, handle))
        return handle

    def run_in_executor(
        self, executor: Executor | None, func: Callable[[Unpack[Ts]], T], *args: *Ts
    ) -> asyncio.Future[T]:
        """Work in a thread while time stands still."""
        future = super().run_in_executor(executor, func, *args)
        self._threads += 1
        future.add_done_callback(self._thread_done)
        return future

    def leave_threads(self) -> None:
        """Wait for no call in a thread any more, e.g. after Ctrl-C; callable in a signal's thread."""
        self._endless.found = True

    def close(self) -> None:
        """Close the loop; what still works for it in a thread may never end."""
        if not self.is_closed():
            own_process.hanging += self._anyio_workers()
        super().close()

    async def shutdown_default_executor(self, *args: Any, **kwargs: Any) -> None:
        """Wait for the executor's threads, in real time, unless a call in one was found to be endless."""
        if self._endless.found and self._default_executor is not None:
            own_process.hanging += self._default_executor._threads  # noqa: SLF001  # it has no public list
            self._default_executor.shutdown(wait=False)
            self._default_executor = None
        with self._standing_still():
            await super().shutdown_default_executor(*args, **kwargs)

    def _schedule(
        self,
        when: float,
        when_ns: int | None,
        callback: Callable[..., object],
        args: tuple[object, ...],
        context: Context | None,
    ) -> asyncio.TimerHandle:
        if self.is_closed():
            raise RuntimeError("the event loop is closed")
        handle = asyncio.TimerHandle(when, callback, args, self, context)
        if when_ns is not None:
            self._timers_made += 1
            heapq.heappush(self._timers, (when_ns, self._timers_made, handle))
        return handle

    def _timer_handle_cancelled(self, handle: asyncio.TimerHandle) -> None:  # noqa: ARG002 - asyncio's signature
        """Remove cancelled timers once they are over 100, and half of all timers: most timeouts are cancelled."""
        self._timers_cancelled += 1
        if self._timers_cancelled > max(100, len(self._timers) // 2):
            self._timers = [timer for timer in self._timers if not timer[2].cancelled()]
            heapq.heapify(self._timers)
            self._timers_cancelled = 0

    def _release_due(self) -> None:
        """Make due timers ready. The float deadline of one may be a fraction of a nanosecond after `_now_ns`."""
        while self._timers and self._timers[0][0] <= self._now_ns:
            _, _, handle = heapq.heappop(self._timers)
            if (when_s := handle.when()) > self._now_s:
                self._now_s = when_s
            self._ready.append(handle)

    def _advance(self) -> bool:
        """Jump to the next deadline, if there is one."""
        while self._timers and self._timers[0][2].cancelled():
            heapq.heappop(self._timers)
        if not self._timers:
            return False
        if self._timers[0][0] > self._horizon_ns:
            raise self._deadlock(f"the horizon of {self._horizon_ns / NS_PER_S:g} s is reached")
        self._turns = 0
        self._now_ns = self._timers[0][0]
        self._now_s = max(self._now_s, self._now_ns / NS_PER_S)
        self._release_due()
        return True

    def _next_events(self, timeout: float | None) -> Events:
        """Return what the next turn of the loop begins with."""
        self._turns += 1
        if self._turns > _TURNS:
            raise self._deadlock(
                f"the loop turned {_TURNS:,} times and time did not move: a task or callback runs again without end"
            )
        # A poll of the system costs as much as the turn itself. Calls from other threads are ready without a poll, so
        # only sockets and pipes need one in each turn; signals can wait for up to 64 turns.
        self._unpolled = (self._unpolled + 1) % 64
        events = self._input.poll(0) if self._unpolled == 0 or self._has_io() else []
        if self._limits and self._limit_s() <= 0:
            self._pass_limit()
        if timeout == 0:
            self._release_due()
            return events
        return events or self._let_threads_work() or self._let_time_move()

    def _let_threads_work(self) -> Events:
        """Wait in real time while a worker thread works, and time stands still."""
        if self.follows and self._settling:
            return []  # time stands still anyway, and a simulator in a thread may never end
        while self._working() and self._limit_s() > 0:
            if events := self._input.poll(min(_THREAD_POLL_S, self._limit_s())):
                return events
            if not self._threads and all(map(_waits_for_the_loop, self._anyio_workers())):
                break
            if not self.follows and (endless := self._endless.look(self._anyio_workers(), pools=self._threads > 0)):
                raise self._deadlock(endless)
        return []

    def _let_time_move(self) -> Events:
        """Settle at this instant, else jump to the next deadline, else wait for threads and input, or give up.

        Called after `_let_threads_work`: what the threads reported meanwhile is ready, and comes first.
        """
        self._release_due()
        while self._settling and not self._ready:
            future = self._settling.popleft()
            if not future.done():
                future.set_result(None)
                return []
        if self._ready:
            return []
        if self._rate is not None and (early_s := self._early_s(self._rate)) > 0:
            return self._input.poll(early_s)
        if not self.follows and self._advance():
            return []
        limits = timeouts.current
        grace_s = limits.idle_sockets if self._has_io() else limits.foreign_threads if self._has_threads() else 0
        if grace_s > 0 and (self._limits or self.follows):
            grace_s = max(0, self._limit_s())  # the next limit says how long to wait; without one it is for ever
        events = self._input.poll(grace_s)
        if not events and not self._ready and not self._pass_limit():
            lacking = "no time from a simulator" if self.follows else "no timer"
            raise self._deadlock(f"nothing is left to run: {lacking}, no worker thread, no input")
        return events

    def _early_s(self, rate: float) -> float:
        """Return the real seconds until the next deadline at this rate; without one there is nothing to wait for."""
        return self._timers[0][0] / NS_PER_S / rate - (perf_counter() - self._began_s) if self._timers else 0.0

    def _limit_s(self) -> float:
        """Return the real seconds until the next limit, infinite where there is none."""
        while self._limits and self._limits[0][2].cancelled():
            heapq.heappop(self._limits)
        return self._limits[0][0] - perf_counter() if self._limits else math.inf

    def _pass_limit(self) -> bool:
        """Call the callback of the next limit, if there is one."""
        if math.isinf(self._limit_s()):
            return False
        self._ready.append(heapq.heappop(self._limits)[2])
        return True

    def _has_io(self) -> bool:
        return self._input.registered > 1  # one is the socket by which other threads wake the loop

    def _working(self) -> bool:
        """Return whether a worker thread works for this loop; False once an endless call was found."""
        if self._endless.found:
            return False
        return self._threads > 0 or (self._has_threads() and any(self._anyio_workers()))

    def _has_threads(self) -> bool:
        """Return whether there are threads that may give the loop something to do."""
        return threading.active_count() > 1 + self.watchers

    def _anyio_workers(self) -> Iterator[threading.Thread]:
        """Yield the threads that anyio started for this loop and that have not finished their call."""
        for thread in threading.enumerate():
            queue = getattr(thread, "queue", None) if getattr(thread, "loop", None) is self else None
            if getattr(queue, "unfinished_tasks", 0) > 0:
                yield thread

    def _thread_done(self, _: object) -> None:
        self._threads -= 1

    @contextmanager
    def _standing_still(self) -> Generator[None]:
        self._threads += 1
        try:
            yield
        finally:
            self._threads -= 1

    def _deadlock(self, why: str) -> Deadlock:
        lines = [f"at {self._now_s:g} s of virtual time {why}", *waiting(self)]
        return Deadlock("\n  ".join(lines))


class _Selector(selectors.DefaultSelector):
    """The place where an event loop waits for input. It asks the loop how long to wait."""

    def __init__(self, choose: Callable[[float | None], Events]) -> None:
        super().__init__()
        self._choose = choose
        self.registered = 0
        """Number of watched files; counted here because the loop needs it every turn."""

    def register(self, fileobj: Any, events: int, data: Any = None) -> selectors.SelectorKey:
        """Watch a file."""
        key = super().register(fileobj, events, data)
        self.registered += 1
        return key

    def unregister(self, fileobj: Any) -> selectors.SelectorKey:
        """Stop watching a file."""
        key = super().unregister(fileobj)
        self.registered -= 1
        return key

    def select(self, timeout: float | None = None) -> Events:
        """Return the input of a turn; asyncio passes zero while a callback is ready, else None."""
        return self._choose(timeout)

    def poll(self, timeout_s: float) -> Events:
        """Return the input that has arrived, or arrives within real seconds."""
        return super().select(None if math.isinf(timeout_s) else timeout_s)


def _waits_for_the_loop(thread: threading.Thread) -> bool:
    """Return whether a worker waits in `anyio.from_thread`: the loop's answer may need virtual time to pass."""
    frame = sys._current_frames().get(thread.ident or 0)  # noqa: SLF001 - documented in spite of its name
    if frame is None or frame.f_code is not threading.Condition.wait.__code__:
        return False  # a thread that runs leaves its frames while they are looked at
    home = getattr(sys.modules.get("anyio.from_thread"), "__file__", None)
    while frame is not None and frame.f_code.co_filename != home:
        frame = frame.f_back
    return frame is not None


def _to_ns(seconds: float) -> int | None:
    """Return the nearest nanosecond; None for never."""
    if math.isnan(seconds):
        raise ValueError("cannot wait for NaN seconds; check what the number was computed from")
    if math.isinf(seconds):
        return None if seconds > 0 else 0
    return round(seconds * NS_PER_S)
