"""`Pairs`: the messages of two sides, of each topic the first with the first, and so on, while both come in.

The messages that wait are bounded in bytes: if one side is silent on a topic, or far behind, the latest messages of the
other are counted and let go, so that the first ones stay.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Generic, Literal, NamedTuple, Protocol, TypeVar

MOST_WAITING = 256 << 20
"""Bytes of messages that wait for their counterparts."""
_EACH_BYTES = 256
"""The size that a waiting message counts for beside its bytes."""

Side = Literal[0, 1]


class Sized(Protocol):
    """A message, as far as its size matters."""

    @property
    def payload(self) -> bytes:
        """Its bytes."""
        ...


M = TypeVar("M", bound=Sized)


class LetGo(Exception):
    """The counterpart of a message was let go: the two cannot be compared."""


class Lonely(NamedTuple, Generic[M]):
    """The messages of a topic on one side that have no counterpart yet."""

    topic: str
    side: Side
    waiting: deque[M]
    """The first ones."""
    let_go: int
    """The number of messages after these."""


@dataclass(slots=True)
class _Lane(Generic[M]):
    """The waiting messages of one topic, all of one side."""

    side: Side
    waiting: deque[M] = field(default_factory=deque[M])
    size: int = 0
    let_go: int = 0


class Pairs(Generic[M]):
    """The waiting messages, by topic."""

    def __init__(self, most_bytes: int | None = None) -> None:
        """Start with no waiting message; `most_bytes` is `MOST_WAITING` by default."""
        self._most = MOST_WAITING if most_bytes is None else most_bytes
        self._lanes: dict[str, _Lane[M]] = {}
        self._size = 0

    def take(self, topic: str, side: Side, message: M) -> M | None:
        """Return the counterpart of a message; None where there is none yet, and it waits itself.

        Raises:
            LetGo: It came, and was not kept.
        """
        lane = self._lanes.get(topic)
        if lane is None:
            lane = self._lanes[topic] = _Lane(side)
        if lane.side != side:
            if lane.waiting:
                found = lane.waiting.popleft()
                self._count(lane, -_size(found))
                return found
            if lane.let_go:
                lane.let_go -= 1
                raise LetGo
            lane.side = side
        self._wait(lane, message)
        return None

    def left(self) -> Iterator[Lonely[M]]:
        """Yield the messages without counterpart, topic by topic."""
        for topic, lane in self._lanes.items():
            if lane.waiting or lane.let_go:
                yield Lonely(topic, lane.side, lane.waiting, lane.let_go)

    def _wait(self, lane: _Lane[M], message: M) -> None:
        if lane.let_go:  # it comes after those
            lane.let_go += 1
            return
        lane.waiting.append(message)
        self._count(lane, _size(message))
        while self._size > self._most:  # a silent topic must not take the room of one that is only a little behind
            fullest = max(self._lanes.values(), key=lambda each: each.size)
            self._count(fullest, -_size(fullest.waiting.pop()))
            fullest.let_go += 1

    def _count(self, lane: _Lane[M], size: int) -> None:
        lane.size += size
        self._size += size


def _size(message: Sized) -> int:
    return len(message.payload) + _EACH_BYTES
