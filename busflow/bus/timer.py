"""Timer: calls a handler on an exact grid of the monotonic clock, and counts every missed tick.

Tick k is due at t0 + k · period, rounded to integer nanoseconds once per tick, so a timer never drifts. The first tick
comes after one period. A tick that is missed, or is due while the handler still awaits, is skipped and counted; with
`missed="burst"` the handler is called for it later instead.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Coroutine
from enum import StrEnum
from fractions import Fraction
from inspect import iscoroutinefunction
from typing import TYPE_CHECKING, Any, cast

from busflow.bus.failure import is_failure, refuse_coroutine
from busflow.bus.statistics import TimerStatistics
from busflow.clock import NS_PER_S, Clock, Duration
from busflow.errors import InvalidDeclaration

if TYPE_CHECKING:
    from busflow.bus.dispatcher import Dispatcher

TimerHandler = Callable[[], None] | Callable[[], Coroutine[Any, Any, None]]
Spawn = Callable[[Coroutine[Any, Any, None], str], object]

LATENESS_KEPT = 4096
"""The number of last ticks used for the lateness percentiles."""


class Missed(StrEnum):
    """The policy for missed ticks: skip them, or call the handler for them later."""

    SKIP = "skip"
    BURST = "burst"

    @classmethod
    def _missing_(cls, value: object) -> None:
        raise InvalidDeclaration(f"missed= is one of {', '.join(cls)}, got {value!r}")


class Timer:
    """A periodic call; calling the timer itself calls the handler at once."""

    __slots__ = (
        "_busy", "_called_ns", "_cancelled", "_clock", "_dispatcher", "_due_at_ns", "_handle", "_handler",
        "_is_async", "_lateness_ns", "_on_failure", "_open", "_owed", "_period", "_period_ns", "_spawn",
        "_start_ns", "_tick", "fired", "missed", "missed_policy", "name", "node",
    )  # fmt: skip

    def __init__(
        self,
        period_s: float | Fraction,
        handler: TimerHandler,
        *,
        name: str,
        node: str,
        missed: Missed = Missed.SKIP,
    ) -> None:
        """Create a timer that its node opens later; a period of 0 is off."""
        self.name: str = name
        self.node: str = node
        self.fired: int = 0
        self.missed: int = 0
        self.missed_policy: Missed = missed
        self._handler = handler
        self._is_async = iscoroutinefunction(handler)
        self._set_period(period_s)
        self._clock: Clock | None = None
        self._dispatcher: Dispatcher | None = None
        self._spawn: Spawn | None = None
        self._on_failure: Callable[[BaseException], None] | None = None
        self._handle: asyncio.TimerHandle | None = None
        self._lateness_ns: deque[int] = deque(maxlen=LATENESS_KEPT)
        self._start_ns = self._called_ns = self._due_at_ns = 0
        self._tick = 1
        self._busy = False
        self._owed = 0
        self._open = False
        self._cancelled = False

    def __call__(self) -> Coroutine[Any, Any, None] | None:
        """Call the handler at once, as if it were the decorated method."""
        return self._handler()

    @property
    def period_s(self) -> float:
        """Seconds between ticks, 0 when off; a new value counts from the moment it is set.

        A new value restarts the grid: the next tick comes one new period later. A cancelled timer stays cancelled
        until `reset`.
        """
        return float(self._period)

    @period_s.setter
    def period_s(self, period_s: float | Fraction) -> None:
        self._set_period(period_s)
        if self._open and not self._cancelled:
            self.reset()

    def reset(self) -> None:
        """Restart the grid: the next tick comes one period from now, also after `cancel`."""
        self.cancel()
        self._cancelled = False
        if self._clock is not None and self._open and self._period > 0:
            self._start_ns = self._called_ns = self._clock.monotonic_ns()
            self._tick = 1
            self._call_at_tick(self._clock)

    def cancel(self) -> None:
        """Stop ticking until `reset`, and discard the ticks still owed by `missed="burst"`."""
        self._owed = 0
        self._cancelled = True
        if self._handle is not None:
            self._handle.cancel()
            self._handle = None

    def attach(
        self, clock: Clock, dispatcher: Dispatcher, spawn: Spawn, on_failure: Callable[[BaseException], None]
    ) -> None:
        """Set the clock, the dispatcher and the callbacks; called by the bus."""
        self._clock, self._dispatcher, self._spawn, self._on_failure = clock, dispatcher, spawn, on_failure

    def continue_account(self, predecessor: Timer) -> None:
        """Continue the counts of the same timer of the node's previous start; the grid restarts.

        Used by busflow itself.
        """
        self.fired, self.missed = predecessor.fired, predecessor.missed
        self._lateness_ns.extend(predecessor._lateness_ns)

    def observe(self, listener: Callable[[], None]) -> None:
        """Call `listener` just before every call of the handler; without listeners this costs nothing.

        Used by busflow itself.
        """
        handler: Any = self._handler

        def observed() -> Any:
            listener()
            return handler()

        self._handler = observed

    def open(self) -> None:
        """Start ticking; used by busflow itself."""
        self._open = True
        cast("Clock", self._clock).on_jump.append(self._on_jump)
        self.reset()

    def close(self) -> None:
        """Stop ticking for good; used by busflow itself."""
        if self._open:
            cast("Clock", self._clock).on_jump.remove(self._on_jump)
        self._open = False
        self.cancel()

    def statistics(self) -> TimerStatistics:
        """Return the timer's current line of the report."""
        late = sorted(self._lateness_ns)
        return TimerStatistics(
            node=self.node,
            name=self.name,
            period_s=self.period_s,
            fired=self.fired,
            missed=self.missed,
            lateness_p50_s=_percentile_s(late, 50),
            lateness_p99_s=_percentile_s(late, 99),
        )

    def _set_period(self, period_s: float | Fraction) -> None:
        self._period = checked_period(period_s, self.name)
        self._period_ns = (self._period * NS_PER_S).as_integer_ratio()

    def _due_ns(self, tick: int) -> int:
        numerator, denominator = self._period_ns
        return self._start_ns + (2 * tick * numerator + denominator) // (2 * denominator)

    def _call_at_tick(self, clock: Clock) -> None:
        """Have the next tick called when it is due."""
        self._due_at_ns: int = self._due_ns(self._tick)
        self._handle = clock.call_at(self._due_at_ns, self._on_due)

    def _on_jump(self, by: Duration) -> None:
        """Adjust to a jump back of time: restart the grid if it goes before the last tick, else keep the next stamp."""
        if self._handle is None or self._clock is None:
            return
        back_ns = -by.nanoseconds
        if back_ns > self._clock.monotonic_ns() - self._called_ns:
            self.reset()
        else:
            self._start_ns, self._called_ns = self._start_ns + back_ns, self._called_ns + back_ns
            self._handle.cancel()
            self._call_at_tick(self._clock)

    def _on_due(self) -> None:
        clock: Any = self._clock
        dispatcher: Any = self._dispatcher
        now: int = clock.monotonic_ns()
        late = now - self._due_at_ns
        if self.missed_policy is Missed.SKIP and late > 0:
            skipped = late * self._period_ns[1] // self._period_ns[0]
            self._tick += skipped
            self.missed += skipped
            late = now - self._due_ns(self._tick)
        self._tick, self._called_ns = self._tick + 1, now
        self._call_at_tick(clock)
        if self._busy:
            if self.missed_policy is Missed.BURST:
                self._owed += 1
            else:
                self.missed += 1
            return
        self.fired += 1
        self._lateness_ns.append(max(0, late))
        if self._is_async:
            self._busy = True
            cast("Spawn", self._spawn)(self._await_handler(), self.name)
        else:
            dispatcher.run_now(self._call_handler)

    def _call_handler(self) -> None:
        try:
            if (result := self._handler()) is not None:
                refuse_coroutine(result, f"timer {self.name}")
        except BaseException as error:  # noqa: BLE001  # a handler may raise anything; its node fails
            self._failed(error)

    async def _await_handler(self) -> None:
        try:
            await cast("Coroutine[Any, Any, None]", self._handler())
            while self._owed:
                self._owed -= 1
                self.fired += 1
                await cast("Coroutine[Any, Any, None]", self._handler())
        except BaseException as error:
            if not is_failure(error):
                raise
            self._failed(error)
        finally:
            self._busy = False

    def _failed(self, error: BaseException) -> None:
        self.close()
        cast("Callable[[BaseException], None]", self._on_failure)(error)

    def __repr__(self) -> str:
        return f"<Timer {self.name} of {self.node}: {self.period_s:g} s, {self.fired} fired, {self.missed} missed>"


def exact_period(period_s: float | None, hz: float | None, name: str) -> Fraction:
    """Return the period of a timer from its period or its rate; 0 is off.

    Raises:
        InvalidDeclaration: both or neither is given, or the value is not valid.
    """
    if (period_s is None) == (hz is None):
        raise InvalidDeclaration(
            f"timer {name} takes either the period in seconds or hz=, got period {period_s!r}, hz {hz!r}"
        )
    if period_s is not None:
        return checked_period(period_s, name)
    try:
        rate = Fraction(str(hz))
    except ValueError:
        rate = Fraction(-1)
    if rate < 0:
        raise InvalidDeclaration(f"timer {name}: hz= is 0 (off) or a positive number, got {hz!r}")
    return checked_period(1 / rate if rate else rate, name)


def checked_period(period_s: float | Fraction, name: str) -> Fraction:
    """Return the period as the decimal number it was written as: 0.1 means a tenth, not the nearest binary fraction.

    Raises:
        InvalidDeclaration: no timer can have that period.
    """
    try:
        period = Fraction(str(period_s))
    except ValueError:
        period = Fraction(-1)
    if period < 0 or 0 < period * NS_PER_S < 1:
        raise InvalidDeclaration(f"timer {name}: the period is 0 (off) or seconds from 1e-9 upwards, got {period_s!r}")
    return period


def _percentile_s(ordered_ns: list[int], percent: int) -> float | None:
    """Return the nearest-rank percentile, in seconds."""
    if not ordered_ns:
        return None
    return ordered_ns[max(0, -(-len(ordered_ns) * percent // 100) - 1)] / NS_PER_S
