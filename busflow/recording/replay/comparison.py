"""Compares recorded and replayed messages, as both come in."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from itertools import islice
from typing import Any, NamedTuple

from busflow.clock import NS_PER_S
from busflow.recording.tools.message_diff import Comparison, FieldDifference
from busflow.recording.tools.pairs import LetGo, Lonely, Pairs, Side

_MOST_FIELDS = 20
_NS_PER_MS = 1_000_000


class DifferenceKind(StrEnum):
    """The kind of a difference."""

    CONTENT = "content"
    TIME = "time"
    MISSING = "missing"
    """A recorded message that the replay did not publish."""
    EXTRA = "extra"
    """A message that only the replay published."""
    FAILURE = "failure"
    """A node failed in the replay."""
    UNCOMPARED = "uncompared"
    """A message that came after its counterpart had been discarded."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One message that is not the same in the recording and in its replay."""

    kind: DifferenceKind
    topic: str
    number: int
    """The number of the message on its topic, from 1."""
    time_s: float
    """The time of publishing, in seconds since the recorded run began."""
    fields: tuple[FieldDifference, ...] = ()
    text: str = ""

    def __str__(self) -> str:
        what = "; ".join(map(str, self.fields)) or self.text
        if self.kind is DifferenceKind.FAILURE:
            return f"{self.topic} failed at {self.time_s:.9f} s: {what}"
        return f"{self.topic} #{self.number} at {self.time_s:.9f} s: {what}"

    def as_json(self) -> dict[str, Any]:
        """Return the difference as plain data."""
        facts = {"kind": self.kind.value, "topic": self.topic, "number": self.number, "time_s": self.time_s}
        fields = [{"path": each.path, "recorded": each.left, "replayed": each.right} for each in self.fields]
        return {**facts, "fields": fields, "text": str(self)}


class Published(NamedTuple):
    """A message that was published."""

    time_ns: int
    payload: bytes


@dataclass(slots=True)
class _Topic:
    """The comparison of one topic."""

    plain: Callable[[bytes], Any]
    paired: int = 0
    late: int = 0
    """The replayed messages from after the end of the recorded run."""


class Check:
    """Compares, topic by topic and in order, what comes from both sides."""

    def __init__(
        self, comparison: Comparison, *, started_ns: int, forgiven_from_ns: int | None = None, most: int = 1000
    ) -> None:
        """Create a check of topics that have yet to be named.

        Args:
            comparison: What counts as the same. Its tolerance of time holds for when a message was published, too.
            started_ns: When the recorded run began.
            forgiven_from_ns: From this moment on, a message that was published in the replay alone is no difference:
                the recorded run was ending.
            most: How many differences are kept; all are counted.
        """
        self.differences: list[Difference] = []
        self.count: int = 0
        self.compared: Counter[str] = Counter()
        self._comparison, self._started_ns, self._most = comparison, started_ns, most
        self._forgiven_from_ns = forgiven_from_ns
        self._topics: dict[str, _Topic] = {}
        self._pairs = Pairs[Published]()

    def watch(self, topic: str, plain: Callable[[bytes], Any]) -> None:
        """Compare this topic, also if nothing comes; `plain` shows one of its messages as plain data."""
        self._topics.setdefault(topic, _Topic(plain))
        self.compared.setdefault(topic, 0)

    def recorded(self, topic: str, published: Published) -> None:
        """Compare a message of the recording with its counterpart, now or once that comes."""
        if (replayed := self._counterpart(topic, 0, published)) is not None:
            self._compare(topic, published, replayed)

    def replayed(self, topic: str, published: Published) -> None:
        """Compare a message of the replay with its counterpart, now or once that comes."""
        self._topics[topic].late += self._is_forgiven(published)
        if (recorded := self._counterpart(topic, 1, published)) is not None:
            self._compare(topic, recorded, published)

    def _counterpart(self, topic: str, side: Side, published: Published) -> Published | None:
        """Return the counterpart of a message; None if it is yet to come, or was discarded."""
        try:
            return self._pairs.take(topic, side, published)
        except LetGo:
            self._pass_over(topic, published)
            return None

    def failed(self, node: str, time_ns: int, text: str) -> None:
        """Add the failure of a node in the replay as a difference."""
        self._add(DifferenceKind.FAILURE, node, 0, time_ns, text)

    def finish(self) -> None:
        """Count each message without a counterpart as a difference, now that both sides have ended."""
        for lonely in self._pairs.left():
            if lonely.side == 0:
                self._miss(lonely)
            else:
                self._exceed(lonely)

    def _miss(self, lonely: Lonely[Published]) -> None:
        text = "recorded, and not published in the replay"
        for number, each in enumerate(lonely.waiting, start=self._topics[lonely.topic].paired + 1):
            self._add(DifferenceKind.MISSING, lonely.topic, number, each.time_ns, text)
        self.count += lonely.let_go

    def _exceed(self, lonely: Lonely[Published]) -> None:
        topic = self._topics[lonely.topic]
        text = "published in the replay, and not recorded"
        for number, each in enumerate(lonely.waiting, start=topic.paired + 1):
            if not self._is_forgiven(each):
                self._add(DifferenceKind.EXTRA, lonely.topic, number, each.time_ns, text)
        self.count += max(0, lonely.let_go - topic.late)  # those at the end are the last ones

    def _pass_over(self, name: str, published: Published) -> None:
        topic = self._topics[name]
        topic.paired += 1
        text = "not compared: so many came before its counterpart that it was not kept"
        self._add(DifferenceKind.UNCOMPARED, name, topic.paired, published.time_ns, text)

    def _compare(self, name: str, left: Published, right: Published) -> None:
        topic = self._topics[name]
        topic.paired += 1
        self.compared[name] += 1
        if left.payload != right.payload:
            found = self._comparison.differences(topic.plain(left.payload), topic.plain(right.payload))
            if fields := tuple(islice(found, _MOST_FIELDS)):
                self._add(DifferenceKind.CONTENT, name, topic.paired, left.time_ns, fields=fields)
                return
        late_ns = right.time_ns - left.time_ns
        if abs(late_ns) > self._comparison.time_tolerance_ns:
            word = "later" if late_ns > 0 else "earlier"
            text = f"published {abs(late_ns) / _NS_PER_MS:g} ms {word} in the replay"
            self._add(DifferenceKind.TIME, name, topic.paired, left.time_ns, text)

    def _add(
        self,
        kind: DifferenceKind,
        topic: str,
        number: int,
        time_ns: int,
        text: str = "",
        fields: tuple[FieldDifference, ...] = (),
    ) -> None:
        self.count += 1
        if len(self.differences) < self._most:
            time_s = (time_ns - self._started_ns) / NS_PER_S
            self.differences.append(Difference(kind, topic, number, time_s, fields, text))

    def _is_forgiven(self, published: Published) -> bool:
        return self._forgiven_from_ns is not None and published.time_ns >= self._forgiven_from_ns
