"""What was published when it was recorded and when it was replayed, held against each other as both come in."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, NamedTuple

from busflow.clock import NS_PER_S
from busflow.recording.comparison import Comparison, FieldDifference

_MOST_FIELDS = 20
_NS_PER_MS = 1_000_000


class Kind(StrEnum):
    """In what a message differs."""

    CONTENT = "content"
    TIME = "time"
    MISSING = "missing"
    """It was recorded, and not published in the replay."""
    EXTRA = "extra"
    """It was published in the replay alone."""
    FAILURE = "failure"
    """A node failed in the replay."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One message that is not the same in the recording and in its replay."""

    kind: Kind
    topic: str
    number: int
    """Which message of the topic it is, from 1."""
    time_s: float
    """When it was published, seconds since the recorded run began."""
    fields: tuple[FieldDifference, ...] = ()
    text: str = ""

    def __str__(self) -> str:
        what = "; ".join(map(str, self.fields)) or self.text
        if self.kind is Kind.FAILURE:
            return f"{self.topic} failed at {self.time_s:.9f} s: {what}"
        return f"{self.topic} #{self.number} at {self.time_s:.9f} s: {what}"

    def as_json(self) -> dict[str, Any]:
        """Plain data."""
        told = {"kind": self.kind.value, "topic": self.topic, "number": self.number, "time_s": self.time_s}
        fields = [{"path": each.path, "recorded": each.left, "replayed": each.right} for each in self.fields]
        return {**told, "fields": fields, "text": str(self)}


class Published(NamedTuple):
    """A message that was published."""

    time_ns: int
    payload: bytes


@dataclass(slots=True)
class _Side:
    """What waits on one topic for its counterpart."""

    plain: Callable[[bytes], Any]
    recorded: deque[Published] = field(default_factory=deque[Published])
    replayed: deque[Published] = field(default_factory=deque[Published])
    compared: int = 0


class Check:
    """Compares, topic by topic and in order, what comes from both sides."""

    def __init__(self, comparison: Comparison, *, started_ns: int, most: int = 1000) -> None:
        """A check of topics that have yet to be named.

        Args:
            comparison: What counts as the same. Its tolerance of time holds for when a message was published, too.
            started_ns: When the recorded run began.
            most: How many differences are kept; all are counted.
        """
        self.differences: list[Difference] = []
        self.count = 0
        self.compared: Counter[str] = Counter()
        self._comparison, self._started_ns, self._most = comparison, started_ns, most
        self._sides: dict[str, _Side] = {}

    def watch(self, topic: str, plain: Callable[[bytes], Any]) -> None:
        """Compare this topic, also if nothing comes; `plain` shows one of its messages as plain data."""
        self._sides.setdefault(topic, _Side(plain))
        self.compared.setdefault(topic, 0)

    def recorded(self, topic: str, published: Published) -> None:
        """A message of the recording."""
        side = self._sides[topic]
        side.recorded.append(published)
        self._compare(topic, side)

    def replayed(self, topic: str, published: Published) -> None:
        """A message of the replay."""
        side = self._sides[topic]
        side.replayed.append(published)
        self._compare(topic, side)

    def failed(self, node: str, time_ns: int, text: str) -> None:
        """A node failed in the replay."""
        self._add(Difference(Kind.FAILURE, node, 0, self._seconds(time_ns), text=text))

    def finish(self, *, forgiven_from_ns: int | None = None) -> None:
        """Both sides have come to their end: what has no counterpart is a difference.

        Args:
            forgiven_from_ns: From this moment on, a message that was published in the replay alone is none: the
                recorded run was ending.
        """
        for topic, side in self._sides.items():
            for offset, each in enumerate(side.recorded, start=side.compared + 1):
                text = "recorded, and not published in the replay"
                self._add(Difference(Kind.MISSING, topic, offset, self._seconds(each.time_ns), text=text))
            for offset, each in enumerate(side.replayed, start=side.compared + 1):
                if forgiven_from_ns is None or each.time_ns < forgiven_from_ns:
                    text = "published in the replay, and not recorded"
                    self._add(Difference(Kind.EXTRA, topic, offset, self._seconds(each.time_ns), text=text))

    def _compare(self, topic: str, side: _Side) -> None:
        if not (side.recorded and side.replayed):
            return
        left, right = side.recorded.popleft(), side.replayed.popleft()
        side.compared += 1
        self.compared[topic] += 1
        seconds = self._seconds(left.time_ns)
        if left.payload != right.payload:
            fields: list[FieldDifference] = []
            for each in self._comparison.differences(side.plain(left.payload), side.plain(right.payload)):
                fields.append(each)
                if len(fields) == _MOST_FIELDS:
                    break
            if fields:
                self._add(Difference(Kind.CONTENT, topic, side.compared, seconds, tuple(fields)))
                return
        late_ns = right.time_ns - left.time_ns
        if abs(late_ns) > self._comparison.time_tolerance_ns:
            word = "later" if late_ns > 0 else "earlier"
            text = f"published {abs(late_ns) / _NS_PER_MS:g} ms {word} in the replay"
            self._add(Difference(Kind.TIME, topic, side.compared, seconds, text=text))

    def _add(self, difference: Difference) -> None:
        self.count += 1
        if len(self.differences) < self._most:
            self.differences.append(difference)

    def _seconds(self, time_ns: int) -> float:
        return (time_ns - self._started_ns) / NS_PER_S
