"""Zenoh feed: brings one topic's messages out of Zenoh into a buffer, by a thread of its own.

A ring buffer takes the arriving messages. If the loop is too busy to empty it, it drops its oldest message; it never
blocks the link, which other topics share. The thread waits for the first message and wakes the loop. The loop then
empties the ring by itself, and the thread does nothing until all is empty. If the thread passed on every message, both
would spend most of their time on the interpreter's lock (26 µs a message, against 6 µs).
"""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import zenoh
import zenoh.ext

from busflow import timeouts
from busflow.wire.zenoh.sender import LARGEST

if TYPE_CHECKING:
    from busflow.bus.topic import Topic
    from busflow.interfaces.encoding.typesupport import TypeSupport

_RING = 256
"""Number of samples in the ring."""
_BULKY_RING = 16
"""Number for images, clouds and maps: 256 of them would take gigabytes."""
_MOST_RING = 4096
"""The largest number, for subscriptions with a large depth."""


def ring_size(topic: Topic[Any], support: TypeSupport) -> int:
    """Return the size of a topic's ring: the default or, up to a limit, the depth of the deepest subscription."""
    deepest = max((each.endpoint.qos.depth for each in topic.subscriptions), default=1)
    return min(max(deepest, _BULKY_RING if support.is_bulky else _RING), _MOST_RING)


class ZenohFeed:
    """A subscription in Zenoh, with its ring buffer and its thread.

    The ring limits the number of samples, and in a thread of Zenoh, which never waits for the interpreter's lock. It
    knows no limit in bytes. So while the loop is busy for long, the feed's thread takes them out and drops the oldest.
    """

    def __init__(
        self,
        session: zenoh.Session,
        key: str,
        *,
        depth: int,
        latched: int,
        on_sample: Callable[[], None],
        on_heavy: Callable[[], None],
    ) -> None:
        """Begin to receive.

        Args:
            session: the session that receives.
            key: the key of the messages.
            depth: the size of the ring.
            latched: how many kept messages are asked of each publisher.
            on_sample: called in the feed's thread when a sample has come and the loop is to take it and others.
            on_heavy: called once, in the feed's thread, when samples are dropped because they have too many bytes.
        """
        self.waits: bool = False
        """Whether the thread waits for the loop, which may take samples; else the thread has the next one."""
        self._depth, self._on_sample, self._on_heavy = depth, on_sample, on_heavy
        self._closed = self._is_heavy = self._has_dropped = False
        self._samples = deque[zenoh.Sample]()
        """Samples that the ring has no more; beyond its depth, the oldest are dropped."""
        self._lock = threading.Lock()
        self._emptied = threading.Semaphore(0)
        """Released when the loop hands the ring back to the thread."""
        ring = zenoh.handlers.RingChannel(depth)
        self._subscriber: Any = _latched(session, key, ring, latched) if latched else _plain(session, key, ring)
        # Its handler waits in its place: it could not be undeclared during its own recv().
        self._ring: Any = self._subscriber.handler
        self._thread = threading.Thread(target=self._watch, name=f"busflow.inlet.{key}", daemon=True)
        self._thread.start()

    def take(self) -> tuple[list[zenoh.Sample], bool]:
        """Return all samples, and whether any may have been dropped before them; on the loop, while the thread waits.

        There are none while the thread has the next one.
        """
        if not self.waits:
            return [], False
        with self._lock:
            self._drain()
            found, has_dropped = list(self._samples), self._has_dropped
            self._samples.clear()
            self._has_dropped = False
        return found, has_dropped

    def resume(self) -> None:
        """Let the thread wait for the next sample, if it waits for the loop."""
        if self.waits:
            self.waits = False
            self._emptied.release()

    def close(self) -> None:
        """Stop receiving."""
        self._closed = self.waits = True
        self._subscriber.undeclare()
        self.resume()
        self._thread.join(timeouts.current.inlet_end)

    def _watch(self) -> None:
        """Wait for a sample, then for the loop to take it and all others, and so on."""
        try:
            while not self._closed:
                if not self._samples:  # else they were taken out here when the loop had found none
                    self._samples.append(self._ring.recv())
                self.waits = True
                self._on_sample()
                while not self._emptied.acquire(timeout=timeouts.current.busy_loop):
                    self._limit()
        except zenoh.ZError:
            pass  # the subscriber was undeclared, which ends a waiting recv()

    def _drain(self) -> None:
        """Take all samples out of the ring."""
        taken = 0
        try:
            while (sample := self._ring.try_recv()) is not None:
                self._samples.append(sample)
                taken += 1
        except zenoh.ZError:
            pass  # the session is closed
        self._has_dropped = self._has_dropped or taken >= self._depth
        self._drop(len(self._samples) - self._depth)

    def _limit(self) -> None:
        """Drop the oldest samples beyond `LARGEST` bytes, but not the newest one."""
        with self._lock:
            self._drain()
            excess, count = sum(len(each.payload) for each in self._samples) - LARGEST, 0
            while excess > 0 and count < len(self._samples) - 1:
                excess -= len(self._samples[count].payload)
                count += 1
            self._drop(count)
        if count and not self._is_heavy:
            self._is_heavy = True
            self._on_heavy()

    def _drop(self, count: int) -> None:
        for _ in range(count):
            self._samples.popleft()
        self._has_dropped = self._has_dropped or count > 0


def _plain(session: zenoh.Session, key: str, ring: Any) -> Any:
    return session.declare_subscriber(key, ring, allowed_origin=zenoh.Locality.REMOTE)


def _latched(session: zenoh.Session, key: str, ring: Any, depth: int) -> Any:
    """Declare a transient_local subscription as `rmw_zenoh` does."""
    return zenoh.ext.declare_advanced_subscriber(
        session,
        key,
        ring,
        allowed_origin=zenoh.Locality.REMOTE,
        history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=depth),
        recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
    )
