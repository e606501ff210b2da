"""Time limits of messages and endpoints: how long a message lives, and how long an endpoint may be silent."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

if TYPE_CHECKING:
    from busflow.clock import Clock

T = TypeVar("T")

NS_PER_S = 1_000_000_000


class Perishable(Generic[T]):
    """A message on its way that is dropped, not delivered, once it has outlived its publisher's `lifespan`."""

    __slots__ = ("expires_ns", "message")

    def __init__(self, message: T, expires_ns: int) -> None:
        self.message = message
        self.expires_ns = expires_ns


def fresh(item: T | Perishable[T], clock: Clock) -> T | None:
    """The message of a queued item, or None when it has expired."""
    if not isinstance(item, Perishable):
        return item
    perishable = cast("Perishable[T]", item)
    return perishable.message if clock.monotonic_ns() < perishable.expires_ns else None


def expire(items: deque[T | Perishable[T]], clock: Clock) -> int:
    """Take out what has expired, and say how many that were."""
    kept = [item for item in items if fresh(item, clock) is not None]
    expired = len(items) - len(kept)
    if expired:
        items.clear()
        items.extend(kept)
    return expired


def next_expiry_ns(items: Iterable[object]) -> int | None:
    """When the next of these expires, on the monotonic clock; None where none does."""
    return min(
        (cast("Perishable[Any]", item).expires_ns for item in items if isinstance(item, Perishable)), default=None
    )


class SilenceTimer:
    """Calls back for every period in which nothing happened, counted from the first time that something did.

    A touch costs one reading of the clock; the timer looks at the last touch when it fires, and moves on.
    """

    __slots__ = ("_clock", "_handle", "_last_ns", "_period_ns", "_repeat", "on_silence")

    def __init__(self, period_s: float, clock: Clock, on_silence: Callable[[], None], *, repeat: bool) -> None:
        """A watch that begins at the first touch; with `repeat` it calls back once per period of silence."""
        self._period_ns = round(period_s * NS_PER_S)
        self._clock = clock
        self.on_silence = on_silence
        """Whom it calls; an endpoint that takes another one's place takes its watch along."""
        self._repeat = repeat
        self._last_ns = 0
        self._handle: asyncio.TimerHandle | None = None

    def touch(self, _message: object = None) -> None:
        """Something happened."""
        self._last_ns = self._clock.monotonic_ns()
        if self._handle is None:
            self._handle = self._clock.call_at(self._last_ns + self._period_ns, self._look)

    def close(self) -> None:
        """Watch no more."""
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
