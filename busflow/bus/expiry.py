"""Time limits: the lifespan of messages, and the longest permitted silence of endpoints."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Iterable
from typing import Any, Generic, TypeVar, cast

from busflow.clock import NS_PER_S, Clock

T = TypeVar("T")


class Perishable(Generic[T]):
    """A queued message with an expiry time from its publisher's `lifespan`; after it, the message is dropped."""

    __slots__ = ("expires_ns", "message")

    def __init__(self, message: T, expires_ns: int) -> None:
        self.message: T = message
        self.expires_ns: int = expires_ns


def message_of(item: T | Perishable[T]) -> T:
    """Return the message of a queued or kept item, also if it has expired."""
    return cast("Perishable[T]", item).message if isinstance(item, Perishable) else item


def fresh(item: T | Perishable[T], clock: Clock) -> T | None:
    """Return the message of a queued item, or None if it has expired."""
    if not isinstance(item, Perishable):
        return item
    perishable = cast("Perishable[T]", item)
    return perishable.message if clock.monotonic_ns() < perishable.expires_ns else None


def expire(items: deque[T | Perishable[T]], clock: Clock) -> int:
    """Remove the expired items, and return their number."""
    kept = [item for item in items if fresh(item, clock) is not None]
    expired = len(items) - len(kept)
    if expired:
        items.clear()
        items.extend(kept)
    return expired


def next_expiry_ns(items: Iterable[object]) -> int | None:
    """Return the monotonic time in ns at which the next item expires; None if none does."""
    return min(
        (cast("Perishable[Any]", item).expires_ns for item in items if isinstance(item, Perishable)), default=None
    )


class SilenceTimer:
    """Calls back for every period without a `touch`, counted from the first touch.

    A touch costs one reading of the clock; when the timer fires, it checks the last touch and schedules itself again.
    """

    __slots__ = ("_clock", "_handle", "_last_ns", "_period_ns", "_repeat", "on_silence")

    def __init__(self, period_s: float, clock: Clock, on_silence: Callable[[], None], *, repeat: bool) -> None:
        """Create a timer that starts at the first touch; with `repeat` it calls back once per period of silence."""
        self._period_ns = round(period_s * NS_PER_S)
        self._clock = clock
        self.on_silence: Callable[[], None] = on_silence
        """The callback; a successor endpoint takes over the timer and sets its own."""
        self._repeat = repeat
        self._last_ns = 0
        self._handle: asyncio.TimerHandle | None = None

    def touch(self, _message: object = None) -> None:
        """Restart the period; the argument is ignored."""
        self._last_ns = self._clock.monotonic_ns()
        if self._handle is None:
            self._handle = self._clock.call_at(self._last_ns + self._period_ns, self._look)

    def close(self) -> None:
        """Stop the timer."""
        if self._handle is not None:
            self._handle.cancel()
            self._handle = None

    def _look(self) -> None:
        due_ns = self._last_ns + self._period_ns
        silent = self._clock.monotonic_ns() >= due_ns
        if silent:
            self._last_ns = due_ns
            due_ns += self._period_ns
        again = self._repeat or not silent
        self._handle = self._clock.call_at(due_ns, self._look) if again else None
        if silent:
            self.on_silence()
