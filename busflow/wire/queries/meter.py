"""Meter: counts a topic's messages at publication while a client reads it; exact at any rate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from math import inf, sqrt
from typing import TYPE_CHECKING, Any

from busflow.bus.topic_origins import Origins
from busflow.clock import NS_PER_S
from busflow.errors import BusflowError

if TYPE_CHECKING:
    from busflow.bus.bus import Bus
    from busflow.bus.topic import Topic
    from busflow.clock import Clock
    from busflow.interfaces.message import Message

_PATIENCE_S = 5.0
"""A meter that is not read for this long is removed, because its client may have been killed."""
_MOST = 1000


@dataclass(slots=True)
class Spread:
    """Count, sum, squared distances and extremes: enough for mean and deviation, and two spreads can be added.

    The distances are added as by T. F. Chan, G. H. Golub and R. J. LeVeque, "Updating formulae and a pairwise algorithm
    for computing sample variances", 1979: sums of squares would lose the deviation of values that are nearly alike.
    """

    count: int = 0
    total: float = 0.0
    squares: float = 0.0
    """Sum of the squared distances from the mean."""
    low: float | None = None
    high: float | None = None

    def add(self, value: float) -> None:
        """Add a value."""
        distance = value - self.mean if self.count else 0.0
        self.count += 1
        self.total += value
        self.squares += distance * (value - self.mean)
        self.low = min(inf if self.low is None else self.low, value)
        self.high = max(-inf if self.high is None else self.high, value)

    def __add__(self, other: Spread) -> Spread:
        """Return the spread of the values of both.

        >>> one, other = Spread(), Spread()
        >>> one.add(1.0), other.add(3.0)
        (None, None)
        >>> (one + other).mean, (one + other).deviation
        (2.0, 1.0)
        """
        lows = [each.low for each in (self, other) if each.low is not None]
        highs = [each.high for each in (self, other) if each.high is not None]
        count = self.count + other.count
        apart = (self.mean - other.mean) ** 2 * self.count * other.count / count if count else 0.0
        return Spread(
            count,
            self.total + other.total,
            self.squares + other.squares + apart,
            min(lows, default=None),
            max(highs, default=None),
        )

    @property
    def mean(self) -> float:
        """The mean of the values; 0 if there are none."""
        return self.total / self.count if self.count else 0.0

    @property
    def deviation(self) -> float:
        """The standard deviation of the values."""
        return sqrt(max(0.0, self.squares) / self.count) if self.count else 0.0


class Tally:
    """Messages of one origin: their number, periods in seconds, sizes in bytes, ages in seconds."""

    def __init__(self) -> None:
        self.last_ns: int | None = None
        self._restart()

    def _restart(self) -> None:
        self.count: int = 0
        self.odd = 0
        """Messages of unknown size or age."""
        self.periods: Spread = Spread()
        self.sizes: Spread = Spread()
        self.ages: Spread = Spread()

    def add(self, now_ns: int) -> None:
        """Count a message."""
        self.count += 1
        if self.last_ns is not None:
            self.periods.add((now_ns - self.last_ns) / NS_PER_S)
        self.last_ns = now_ns

    def read(self) -> dict[str, Any]:
        """Return the counts since the last read, and start again."""
        found = {
            "count": self.count,
            "periods_s": asdict(self.periods),
            "sizes": asdict(self.sizes),
            "ages_s": asdict(self.ages),
            "odd": self.odd,
        }
        self._restart()
        return found


class Meter:
    """Counts of a topic's messages since the last read: of this process, and of each node elsewhere."""

    def __init__(self, topic: Topic[Any], clock: Clock, size: Callable[[Message], int] | None) -> None:
        """Create a meter that is not yet on its topic; `size` only if bytes are wanted, since it costs most."""
        self.topic = topic
        self._clock = clock
        self._size = size
        self._own = Tally()
        self._arrived: dict[str, Tally] = {}
        self._origins = Origins(topic)
        self._since_ns = clock.monotonic_ns()

    def on_message(self, message: Message) -> None:
        """Count a message as it is published."""
        tally = self._tally()
        tally.add(self._clock.monotonic_ns())
        try:
            self._weigh(tally, message)
        except (BusflowError, AttributeError, TypeError, ValueError, ArithmeticError):
            tally.odd += 1  # a measurement must never make a publish fail

    def _tally(self) -> Tally:
        """Return the tally of the message that is being published."""
        node = self._origins.of_this()
        if node is None:
            return self._own
        return self._arrived.setdefault(node if len(self._arrived) < _MOST else "", Tally())

    def _weigh(self, tally: Tally, message: Message) -> None:
        stamp = getattr(getattr(message, "header", None), "stamp", None)
        if stamp is not None:
            tally.ages.add((self._clock.now().nanoseconds - stamp.sec * NS_PER_S - stamp.nanosec) / NS_PER_S)
        if self._size is not None:
            tally.sizes.add(self._size(message))

    def read(self) -> dict[str, Any]:
        """Return the counts since the last read, or since the meter was added, and start again.

        What arrived from other processes is beside it, by node, under `arrived`: most of them count it themselves.
        """
        now_ns = self._clock.monotonic_ns()
        duration_s, self._since_ns = (now_ns - self._since_ns) / NS_PER_S, now_ns
        return {
            "topic": self.topic.name,
            "duration_s": duration_s,
            **self._own.read(),
            "publishers": sorted({each.endpoint.node for each in self.topic.publishers if not each.endpoint.remote}),
            "arrived": {node: tally.read() for node, tally in self._arrived.items()},
        }


class Meters:
    """The active meters, one for each reader and topic."""

    def __init__(self, bus: Bus, size_of: Callable[[Topic[Any]], Callable[[Message], int]]) -> None:
        self._bus, self._size_of = bus, size_of
        self._meters: dict[tuple[str, str], Meter] = {}
        self._read_at: dict[tuple[str, str], int] = {}

    def read(self, reader: str, topic: Topic[Any], *, sizes: bool) -> dict[str, Any]:
        """Return a topic's counts since this reader's last call; the first call adds the meter.

        Raises:
            BusflowError: too many are read at once.
        """
        key = (reader, topic.name)
        meter = self._meters.get(key)
        if meter is None:
            if len(self._meters) >= _MOST:
                raise BusflowError(f"{_MOST} meters are read already; end some of the commands that do")
            meter = self._meters[key] = Meter(topic, self._bus.clock, self._size_of(topic) if sizes else None)
            self._bus.tap(topic, meter.on_message)
            self._expire_later(key)
        self._read_at[key] = self._bus.clock.monotonic_ns()
        return meter.read()

    def close(self) -> None:
        """Remove every meter."""
        for meter in self._meters.values():
            self._bus.untap(meter.topic, meter.on_message)
        self._meters.clear()

    def _expire_later(self, key: tuple[str, str]) -> None:
        after_ns = round(_PATIENCE_S * NS_PER_S)
        self._bus.clock.call_at(self._bus.clock.monotonic_ns() + after_ns, lambda: self._expire(key))

    def _expire(self, key: tuple[str, str]) -> None:
        if key not in self._meters:
            return
        if self._bus.clock.monotonic_ns() - self._read_at[key] < _PATIENCE_S * NS_PER_S:
            self._expire_later(key)
            return
        del self._read_at[key]
        meter = self._meters.pop(key)
        self._bus.untap(meter.topic, meter.on_message)
