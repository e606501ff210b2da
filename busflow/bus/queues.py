"""Bounded queues: what happens to a message when its subscription's queue is full, and the count of what was lost.

Pure: no loop, no clock, no locks. A queue belongs to one subscription and is used from one thread. It owns the
counters of what it dropped; nobody else changes them. Who reads it is woken by the topic, once for any number of
messages, not by the queue.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from busflow.bus.qos import Overflow
from busflow.errors import InvalidQoS

T = TypeVar("T")


class ObservedDrops(Counter[str]):
    """A queue's count of drops that tells of each, just before it is counted."""

    def __init__(self, counts: Counter[str]) -> None:
        self.listeners: list[Callable[[str], None]] = []
        super().__init__(counts)

    def __setitem__(self, reason: str, count: int) -> None:
        for _ in range(count - self[reason]):
            for listener in self.listeners:
                listener(reason)
        super().__setitem__(reason, count)


class Queue(ABC, Generic[T]):
    """Messages on their way to one subscription, first in first out, never more than `depth`."""

    __slots__ = ("depth", "drops", "items")

    counts_overflow = True
    """Whether its `fast_push` may lose a message without counting it."""

    def __init__(self, depth: int) -> None:
        if depth < 1:
            raise InvalidQoS(f"depth must be at least 1, got {depth}; write how many messages may wait")
        self.depth = depth
        self.items: deque[T] = deque()
        self.drops: Counter[str] = Counter()

    @abstractmethod
    def push(self, item: T) -> None:
        """Take a message in, or lose one, as the overflow policy says."""

    @property
    def fast_push(self) -> Callable[[T], None]:
        """What a publish has to call: `push`, or something quicker that does the same to `items`."""
        return self.push

    @property
    def dropped(self) -> int:
        """How many messages this queue has counted as lost, for whatever reason."""
        return self.drops.total()

    @property
    def full(self) -> bool:
        """Whether the next message finds no room."""
        return len(self.items) >= self.depth

    def observe_drops(self, listener: Callable[[str], None]) -> None:
        """Have every drop told, with its reason; who does not ask pays nothing."""
        if not isinstance(self.drops, ObservedDrops):
            self.drops = ObservedDrops(self.drops)
        self.drops.listeners.append(listener)

    def ignore_drops(self) -> None:
        """Tell of no drop any more."""
        self.drops = Counter(self.drops)

    def discard(self, reason: str) -> None:
        """Lose the oldest message and count it under `reason`."""
        self.items.popleft()
        self.drops[reason] += 1

    def __len__(self) -> int:
        return len(self.items)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {len(self.items)}/{self.depth}, {self.dropped} dropped>"


class DropOldest(Queue[T]):
    """The newest `depth` messages wait; a full queue loses its oldest.

    >>> queue = DropOldest(2)
    >>> for item in "abc":
    ...     queue.push(item)
    >>> list(queue.items), queue.dropped
    (['b', 'c'], 1)
    """

    __slots__ = ()

    counts_overflow = False

    def __init__(self, depth: int) -> None:
        super().__init__(depth)
        self.items = deque(maxlen=depth)

    @property
    def fast_push(self) -> Callable[[T], None]:
        """The deque's own `append`, which loses the oldest by itself, unless somebody wants to hear of it.

        It saves 60 ns of the 90 that a message costs here. The account does not suffer: what was published and is
        neither delivered, waiting nor counted as lost is what was lost this way.
        """
        return self.push if isinstance(self.drops, ObservedDrops) else self.items.append

    def push(self, item: T) -> None:
        """Take the message in; lose the oldest one when there is no room."""
        if len(self.items) >= self.depth:
            self.drops["overflow"] += 1
        self.items.append(item)


class DropNewest(Queue[T]):
    """The first `depth` messages wait; a full queue loses what arrives.

    >>> queue = DropNewest(2)
    >>> for item in "abc":
    ...     queue.push(item)
    >>> list(queue.items), queue.dropped
    (['a', 'b'], 1)
    """

    __slots__ = ()

    def push(self, item: T) -> None:
        """Take the message in, or lose it when there is no room."""
        if len(self.items) >= self.depth:
            self.drops["overflow"] += 1
            return
        self.items.append(item)


class Block(Queue[T]):
    """Loses nothing: whoever publishes looks for room first, and waits or is refused.

    >>> queue = Block(1)
    >>> queue.push("a")
    >>> queue.full
    True
    """

    __slots__ = ()

    def push(self, item: T) -> None:
        """Take the message in; the publisher has checked `full` on every queue of the topic before."""
        self.items.append(item)


def create_queue(overflow: Overflow, depth: int) -> Queue[Any]:
    """The queue that does what `overflow` says."""
    kinds: dict[Overflow, type[Queue[Any]]] = {
        Overflow.DROP_OLDEST: DropOldest,
        Overflow.DROP_NEWEST: DropNewest,
        Overflow.BLOCK: Block,
    }
    return kinds[overflow](depth)
