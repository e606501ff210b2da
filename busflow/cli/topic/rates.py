"""Rates: readings of a topic's meter, over a window of messages, as `ros2 topic hz`, `bw` and `delay` print them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from busflow.text import printable
from busflow.wire.queries.meter import Spread

_UNITS = ((1_000_000, "MB", 2), (1000, "KB", 2), (1, "B", 0))


@dataclass(frozen=True, slots=True)
class Flow:
    """The ledger of one subscription in an interval."""

    node: str
    published: int
    delivered: int
    dropped: int
    queued: int
    """The backlog at the end of the interval."""
    drops: Mapping[str, int]
    """The dropped messages by reason."""


@dataclass(frozen=True, slots=True)
class Reading:
    """The measurements of a topic in an interval."""

    duration_s: float
    count: int
    periods: Spread
    sizes: Spread
    ages: Spread

    @classmethod
    def of(cls, answers: Sequence[Mapping[str, Any]]) -> Reading:
        """Combine the answers of a run's processes to `measure`: each message is counted where it is published.

        A publisher outside the run, a terminal or a ROS 2 node, has no meter: its messages are counted where they
        arrive, in one process.
        """
        duration_s = max(answer["duration_s"] for answer in answers)
        known = {node for answer in answers for node in answer["publishers"]}
        outside: dict[str, Mapping[str, Any]] = {}
        for answer in answers:
            for node, arrived in answer["arrived"].items():
                if node not in known:  # the process that received the most of it
                    outside[node] = max(outside.get(node, arrived), arrived, key=lambda each: each["count"])
        parts = [cls._of_one(duration_s, part) for part in (*answers, *outside.values())]
        return cls(
            duration_s,
            sum(part.count for part in parts),
            _beside([part.periods for part in parts]),
            sum((part.sizes for part in parts), Spread()),
            sum((part.ages for part in parts), Spread()),
        )

    @classmethod
    def _of_one(cls, duration_s: float, part: Mapping[str, Any]) -> Reading:
        return cls(duration_s, part["count"], *(Spread(**part[name]) for name in ("periods_s", "sizes", "ages_s")))

    def __add__(self, other: Reading) -> Reading:
        return Reading(
            self.duration_s + other.duration_s,
            self.count + other.count,
            self.periods + other.periods,
            self.sizes + other.sizes,
            self.ages + other.ages,
        )


def _beside(spreads: Sequence[Spread]) -> Spread:
    """Combine the periods of parallel publishers: the rates add up, the deviation is that within each.

    >>> each = Spread(10, 1.0, 0.0, 0.1, 0.1)
    >>> round(1 / _beside([each, Spread(), each]).mean)
    20
    """
    given = [each for each in spreads if each.count]
    if len(given) < 2:  # nothing to combine
        return given[0] if given else Spread()
    squares = sum(each.squares for each in given)
    together = sum(given, Spread())
    return Spread(together.count, max(each.total for each in given), squares, together.low, together.high)


NOTHING = Reading(0.0, 0, Spread(), Spread(), Spread())


class Window:
    """The newest readings of a topic, with about `size` messages together."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._readings: deque[Reading] = deque()
        self._total = NOTHING

    def add(self, reading: Reading) -> Reading:
        """Add a reading, drop the oldest that are no longer needed, and return the sum."""
        self._readings.append(reading)
        self._total += reading
        while self._total.count - self._readings[0].count >= self._size:
            self._readings.popleft()
            self._total = sum(self._readings, NOTHING)
        return self._total


class Flows:
    """The changes of a topic's subscriptions from one reading to the next."""

    def __init__(self) -> None:
        self._before: dict[tuple[str, int], Mapping[str, Any]] = {}

    def since(self, statistics: Sequence[Mapping[str, Any]]) -> list[Flow]:
        """Return the flows since the last call, from the ledgers then and now; empty the first time."""
        now = {
            (line["node"], sum(each["node"] == line["node"] for each in statistics[:place])): line
            for place, line in enumerate(statistics)
        }
        before, self._before = self._before, now
        return [_flow(line, before[key]) for key, line in now.items() if key in before]


def _flow(now: Mapping[str, Any], before: Mapping[str, Any]) -> Flow:
    if now["published"] < before["published"]:  # the subscription of a restarted node starts at 0
        before = {}

    def grown(now: Mapping[str, int], before: Mapping[str, int], word: str) -> int:
        return now[word] - before.get(word, 0)

    drops = {word: grown(now["drops"], before.get("drops", {}), word) for word in now["drops"]}
    return Flow(
        node=now["node"],
        published=grown(now, before, "published"),
        delivered=grown(now, before, "delivered"),
        dropped=grown(now, before, "dropped"),
        queued=now["queued"],
        drops={word: count for word, count in drops.items() if count},
    )


def hz_text(window: Reading) -> str:
    r"""Return a rate as `ros2 topic hz` prints it.

    >>> hz_text(Reading(1.0, 11, Spread(10, 1.0, 0.0, 0.1, 0.1), Spread(), Spread()))
    'average rate: 10.000\n\tmin: 0.100s max: 0.100s std dev: 0.00000s window: 10'
    """
    spread = window.periods
    rate = 1 / spread.mean if spread.mean else 0.0
    return f"average rate: {rate:.3f}\n{_spread_text(spread)}"


def delay_text(window: Reading) -> str:
    """Return a delay as `ros2 topic delay` prints it."""
    return f"average delay: {window.ages.mean:.3f}\n{_spread_text(window.ages)}"


def _spread_text(spread: Spread) -> str:
    return (
        f"\tmin: {spread.low or 0:.3f}s max: {spread.high or 0:.3f}s"
        f" std dev: {spread.deviation:.5f}s window: {spread.count}"
    )


def bw_text(window: Reading) -> str:
    r"""Return a bandwidth as `ros2 topic bw` prints it.

    >>> bw_text(Reading(1.0, 10, Spread(), Spread(10, 3240.0, 0.0, 324.0, 324.0), Spread()))
    '3.24 KB/s from 10 messages\n\tMessage size mean: 0.32 KB min: 0.32 KB max: 0.32 KB'
    """
    sizes = window.sizes
    rate = sizes.total / window.duration_s if window.duration_s else 0.0
    factor, unit, digits = next((each for each in _UNITS if rate >= each[0]), _UNITS[-1])

    def shown(number: float | None) -> str:
        return f"{(number or 0) / factor:.{digits}f} {unit}"

    text = f"{shown(rate)}/s from {sizes.count} messages"
    return f"{text}\n\tMessage size mean: {shown(sizes.mean)} min: {shown(sizes.low)} max: {shown(sizes.high)}"


def drop_lines(flows: Sequence[Flow]) -> Iterator[str]:
    """Yield a line for each subscription that dropped messages."""
    for flow in flows:
        if flow.dropped:
            reasons = ", ".join(f"{count} {word}" for word, count in flow.drops.items())
            yield f"\t{printable(flow.node)} dropped {flow.dropped} of {flow.published} ({reasons})"


def _spread_json(spread: Spread) -> dict[str, float | None]:
    return {"min": spread.low, "max": spread.high, "mean": spread.mean, "std_dev": spread.deviation}


@dataclass(frozen=True, slots=True)
class Measure:
    """A measured quantity: its name, its values in a reading, and its text."""

    word: str
    text: Callable[[Reading], str]
    spread: Callable[[Reading], Spread]
    window: int
    """The default number of messages in a window, as in ROS 2."""

    def as_json(self, topic: str, last: Reading, window: Reading, flows: Sequence[Flow]) -> dict[str, Any]:
        """Return what `--json` prints for an interval."""
        spread = self.spread(window)
        rate = {
            "hz": {"rate_hz": 1 / spread.mean if spread.mean else None},
            "bw": {"bytes_per_s": spread.total / window.duration_s if window.duration_s else None},
        }
        unit = "size_bytes" if self.word == "bw" else "period_s" if self.word == "hz" else "delay_s"
        return {
            "topic": topic,
            "interval_s": last.duration_s,
            "count": last.count,
            "window": spread.count,
            **rate.get(self.word, {}),
            unit: _spread_json(spread),
            "subscriptions": [asdict(flow) for flow in flows],
        }


HZ = Measure("hz", hz_text, lambda reading: reading.periods, 10_000)
BW = Measure("bw", bw_text, lambda reading: reading.sizes, 100)
DELAY = Measure("delay", delay_text, lambda reading: reading.ages, 10_000)
