"""Time: points in time, durations, and the clocks of a run. No other module reads time or sleeps."""

from __future__ import annotations

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from enum import IntEnum
from functools import cache, total_ordering
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self, cast, overload

from busflow.errors import NotRunning

if TYPE_CHECKING:
    import asyncio

    import anyio

    from busflow.msgs.builtin_interfaces import Duration as DurationMsg
    from busflow.msgs.builtin_interfaces import Time as TimeMsg

NS_PER_S = 1_000_000_000
SIM_EPOCH_NS = 1_767_225_600 * NS_PER_S
"""2026-01-01T00:00:00Z, the start of simulated time: zero would look like a stamp that was never set."""
_MAX = 2**63 - 1

perf_counter: Callable[[], float] = time.perf_counter
"""Wall time for budgets and measurements; it never decides anything in simulated time."""
monotonic: Callable[[], float] = time.monotonic
"""The clock of an event loop's deadlines on real time."""
sleep: Callable[[float], None] = time.sleep
"""The wait of a thread without an event loop, in seconds of real time: of a command that asks a run again and again."""


def _total_ns(nanoseconds: float, seconds: float, *, lowest: int) -> int:
    """Return the sum as ROS's 64-bit count: seconds are rounded to nanoseconds, fractions of one are dropped."""
    if not math.isfinite(seconds):
        raise OverflowError(f"a time has a finite number of seconds, not {seconds}")
    # A number of numpy's would overflow within its own width.
    total = int(nanoseconds) + (seconds * NS_PER_S if isinstance(seconds, int) else round(float(seconds) * NS_PER_S))
    if not lowest <= total <= _MAX:
        raise OverflowError(f"{total} ns is beyond what ROS 2 can express, 64 bits of nanoseconds (292 years)")
    return total


class ClockType(IntEnum):
    """The source of a time. Comparing times of different types is an error."""

    ROS_TIME = 1
    """The run's clock, real or simulated; used for stamps in messages."""
    SYSTEM_TIME = 2
    STEADY_TIME = 3


@total_ordering
class _Nanoseconds:
    """A whole number of nanoseconds that compares only with its own type."""

    __slots__ = ()
    nanoseconds: int

    def _ns_of(self, other: object) -> int | None:
        """Return the other value's nanoseconds; None if it is of another type."""
        return other.nanoseconds if isinstance(other, type(self)) else None

    def __eq__(self, other: object) -> bool:
        ns = self._ns_of(other)
        return NotImplemented if ns is None else self.nanoseconds == ns

    def __lt__(self, other: Self) -> bool:
        ns = self._ns_of(other)
        return NotImplemented if ns is None else self.nanoseconds < ns

    def __hash__(self) -> int:
        return hash((type(self), self.nanoseconds))


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Duration(_Nanoseconds):
    """A span of time in whole nanoseconds; it may be negative.

    >>> Duration(seconds=1.5) - Duration(1)
    Duration(nanoseconds=1499999999)
    """

    nanoseconds: int

    def __init__(self, nanoseconds: float = 0, *, seconds: float = 0) -> None:
        object.__setattr__(self, "nanoseconds", _total_ns(nanoseconds, seconds, lowest=-_MAX - 1))

    @property
    def seconds(self) -> float:
        """The span in seconds, as a float: not exact beyond 104 days."""
        return self.nanoseconds / NS_PER_S

    def __add__(self, other: Duration) -> Duration:
        ns = self._ns_of(other)
        return NotImplemented if ns is None else Duration(self.nanoseconds + ns)

    def __sub__(self, other: Duration) -> Duration:
        ns = self._ns_of(other)
        return NotImplemented if ns is None else Duration(self.nanoseconds - ns)

    def __mul__(self, factor: float) -> Duration:
        if not isinstance(cast("object", factor), (int, float)):
            return NotImplemented
        if math.isfinite(factor):
            return Duration(self.nanoseconds * factor)
        if factor == math.inf:
            return INFINITE
        raise ValueError(f"a duration cannot be multiplied with {factor}")

    def __str__(self) -> str:
        return "Infinite" if self.nanoseconds == _MAX else f"{self.nanoseconds} nanoseconds"

    def to_msg(self) -> DurationMsg:
        """Return the duration as a ROS message."""
        from busflow.msgs.builtin_interfaces import Duration as DurationMsg

        sec, nanosec = divmod(self.nanoseconds, NS_PER_S)
        return DurationMsg(sec=sec, nanosec=nanosec)

    @classmethod
    def from_msg(cls, msg: DurationMsg) -> Duration:
        """Create the duration of a ROS message."""
        return cls(nanoseconds_of(msg))


INFINITE = Duration(_MAX)
"""The duration that means "no limit" in ROS 2."""


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Time(_Nanoseconds):
    """A point in time: whole nanoseconds since its clock's epoch, never negative.

    >>> Time(seconds=2) - Time(seconds=0.5)
    Duration(nanoseconds=1500000000)
    >>> Time(1) == Time(1, clock_type=ClockType.STEADY_TIME)
    Traceback (most recent call last):
    TypeError: a time of ROS_TIME cannot be compared with one of STEADY_TIME
    """

    nanoseconds: int
    clock_type: ClockType

    def __init__(
        self, nanoseconds: float = 0, *, seconds: float = 0, clock_type: ClockType = ClockType.ROS_TIME
    ) -> None:
        if type(nanoseconds) is int and 0 <= nanoseconds <= _MAX and seconds == 0 and type(clock_type) is ClockType:
            _set_nanoseconds(self, nanoseconds)  # the fast path: each stamp of a message is created here
            _set_clock_type(self, clock_type)
            return
        if not isinstance(cast("object", clock_type), ClockType):
            raise TypeError(f"clock_type is a ClockType such as ClockType.ROS_TIME, not {clock_type!r}")
        if nanoseconds < 0 or seconds < 0:
            raise ValueError(f"a point in time is not negative: {seconds} s and {nanoseconds} ns")
        object.__setattr__(self, "nanoseconds", _total_ns(nanoseconds, seconds, lowest=0))
        object.__setattr__(self, "clock_type", clock_type)

    @property
    def sec(self) -> int:  # noqa: D102 - the message's word
        return self.nanoseconds // NS_PER_S

    @property
    def nanosec(self) -> int:  # noqa: D102 - the message's word
        return self.nanoseconds % NS_PER_S

    def seconds_nanoseconds(self) -> tuple[int, int]:
        """Return the seconds and the nanoseconds within the second."""
        return self.sec, self.nanosec

    def __add__(self, other: Duration) -> Time:
        if not isinstance(cast("object", other), Duration):
            return NotImplemented
        return Time(self.nanoseconds + other.nanoseconds, clock_type=self.clock_type)

    __radd__ = __add__

    @overload
    def __sub__(self, other: Time) -> Duration: ...
    @overload
    def __sub__(self, other: Duration) -> Time: ...
    def __sub__(self, other: object) -> Time | Duration:
        if isinstance(other, Duration):
            return Time(self.nanoseconds - other.nanoseconds, clock_type=self.clock_type)
        ns = self._ns_of(other)
        return NotImplemented if ns is None else Duration(self.nanoseconds - ns)

    def _ns_of(self, other: object) -> int | None:
        if isinstance(other, Time) and other.clock_type is not self.clock_type:
            mine, theirs = self.clock_type.name, other.clock_type.name
            raise TypeError(f"a time of {mine} cannot be compared with one of {theirs}")
        return other.nanoseconds if isinstance(other, Time) else None

    def to_msg(self) -> TimeMsg:
        """Return the time as a ROS message, for a header's stamp."""
        sec, nanosec = divmod(self.nanoseconds, NS_PER_S)
        return _time_message()(sec=sec, nanosec=nanosec)

    @classmethod
    def from_msg(cls, msg: TimeMsg, clock_type: ClockType = ClockType.ROS_TIME) -> Time:
        """Create the time of a ROS message."""
        return cls(nanoseconds_of(msg), clock_type=clock_type)


def nanoseconds_of(stamp: Time | TimeMsg | DurationMsg) -> int:
    """Return the whole nanoseconds of a time, or of a ROS message's time or duration."""
    return stamp.sec * NS_PER_S + stamp.nanosec


@cache
def _time_message() -> type[TimeMsg]:
    """Return the message class, imported at the first stamp, because pydantic is slow to import."""
    from busflow.msgs.builtin_interfaces import Time as TimeMsg

    return TimeMsg


_set_nanoseconds: Callable[[Time, int], None] = cast("Any", Time).nanoseconds.__set__
_set_clock_type: Callable[[Time, ClockType], None] = cast("Any", Time).clock_type.__set__


class Clock(ABC):
    """The clock of one run, created when the run begins."""

    kind: ClassVar[Literal["system", "sim"]]

    def __init__(self) -> None:
        self.on_jump: list[Callable[[Duration], None]] = []
        """Called with the difference when a simulator sets the time back."""
        self._start_ns = self.monotonic_ns()

    def begin(self) -> None:
        """Mark the start of the run, from which `seconds` counts; used by busflow itself."""
        self._start_ns = self.monotonic_ns()

    @abstractmethod
    def now(self) -> Time:
        """Return the current time, for stamps of messages."""

    def now_ns(self) -> int:
        """Return the current time in nanoseconds, for code that reads it very often."""
        return self.now().nanoseconds

    @abstractmethod
    def monotonic_ns(self) -> int:
        """Return nanoseconds that never go back nor jump, for timers."""

    @abstractmethod
    def call_at(self, deadline_ns: int, callback: Callable[[], object]) -> asyncio.TimerHandle:
        """Schedule a callback on the running loop for when `monotonic_ns` reaches the deadline; at once if it has."""

    def seconds(self) -> float:
        """Return the seconds since the run began."""
        return (
            self.monotonic_ns() - self._start_ns
        ) / NS_PER_S  # without a further call: nodes ask for it all the time

    def elapsed_ns(self) -> int:
        """Return the nanoseconds since the run began."""
        return self.monotonic_ns() - self._start_ns

    async def sleep(self, seconds: float) -> None:
        """Wait. Zero or less yields to the event loop once; infinity waits until cancelled."""
        if math.isnan(seconds):
            raise ValueError("cannot sleep for NaN seconds; check what the number was computed from")
        import asyncio

        await asyncio.sleep(seconds)

    async def sleep_until(self, until: Time) -> None:
        """Wait until `now` reaches a time of this clock."""
        now = self.now()
        if until.clock_type is not now.clock_type:
            raise ValueError(f"the clock type does not match: {until.clock_type.name} in {now.clock_type.name}")
        while (left := until - self.now()).nanoseconds > 0:  # time may have been set back meanwhile
            await self.sleep(left.seconds)

    async def settle(self) -> None:  # noqa: B027  # only simulated time has something to do
        """Run everything that is due now, in simulated time; in real time this does nothing."""

    def wall_timeout(self, seconds: float) -> AbstractContextManager[anyio.CancelScope]:
        """Return `anyio.move_on_after` in wall time with any clock, for limits on real-world operations."""
        import anyio

        return anyio.move_on_after(seconds)


class SystemClock(Clock):
    """Real time: the wall clock for stamps, the monotonic clock for timers."""

    kind: ClassVar[Literal["system", "sim"]] = "system"

    def now(self) -> Time:
        """Return the wall clock's time, in UTC."""
        return Time(time.time_ns())

    def now_ns(self) -> int:
        """Return the current time in nanoseconds."""
        return time.time_ns()

    def monotonic_ns(self) -> int:
        """Return the system's monotonic clock, which does not follow changes of the wall clock."""
        return time.monotonic_ns()

    def call_at(self, deadline_ns: int, callback: Callable[[], object]) -> asyncio.TimerHandle:
        """Schedule a callback on the running loop, whose clock is the same monotonic one."""
        import asyncio  # not imported by commands that only read the time

        return asyncio.get_running_loop().call_at(deadline_ns / NS_PER_S, callback)


class SimClock(Clock):
    """Simulated time: the time of a virtual-time loop, by default the running one."""

    kind: ClassVar[Literal["system", "sim"]] = "sim"

    def __init__(self, *, epoch_ns: int = SIM_EPOCH_NS, loop: asyncio.AbstractEventLoop | None = None) -> None:
        import asyncio

        # A loop with exact time: `time_ns()` and `call_at_ns(when_ns, callback)`.
        self._loop: Any = asyncio.get_running_loop() if loop is None else loop
        if not hasattr(self._loop, "call_at_ns"):
            raise NotRunning("SimClock needs a virtual-time loop; run under busflow.testing.virtual_time")
        self._epoch_ns = epoch_ns
        super().__init__()

    def now(self) -> Time:
        """Return the epoch plus the loop's virtual time."""
        return Time(self._epoch_ns + self._loop.time_ns())

    def now_ns(self) -> int:
        """Return the current time in nanoseconds."""
        return self._epoch_ns + self._loop.time_ns()

    async def settle(self) -> None:
        """Run everything that is due now; time does not move."""
        await self._loop.settle()

    def start_at(self, stamp: Time) -> None:
        """Set the current time to this stamp."""
        self._epoch_ns = stamp.nanoseconds - self._loop.time_ns()

    def jump(self, by: Duration) -> None:
        """Set the time of stamps forwards or backwards, as when a real clock is set; timers are not affected."""
        self._epoch_ns += by.nanoseconds

    def monotonic_ns(self) -> int:
        """Return the loop's virtual time."""
        return self._loop.time_ns()

    def call_at(self, deadline_ns: int, callback: Callable[[], object]) -> asyncio.TimerHandle:
        """Schedule a callback on the loop at exactly the deadline."""
        return self._loop.call_at_ns(deadline_ns, callback)

    @contextmanager
    def wall_timeout(self, seconds: float) -> Generator[anyio.CancelScope]:
        """Limit a block to real seconds; jumps of virtual time do not count."""
        import anyio

        with anyio.CancelScope() as scope:
            limit = self._loop.call_after_wall(seconds, scope.cancel)
            try:
                yield scope
            finally:
                limit.cancel()
