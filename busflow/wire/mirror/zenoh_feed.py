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
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import zenoh
import zenoh.ext

from busflow import timeouts

if TYPE_CHECKING:
    from busflow.wire.mirror.arrival_buffer import ArrivalBuffer


class ZenohFeed:
    """A subscription in Zenoh, with its ring buffer and its thread."""

    def __init__(
        self,
        session: zenoh.Session,
        key: str,
        buffer: ArrivalBuffer,
        *,
        depth: int,
        latched: int,
        on_sample: Callable[[], None],
    ) -> None:
        """Begin to receive.

        Args:
            session: the session that receives.
            key: the key of the messages.
            buffer: gets the messages.
            depth: the size of the ring.
            latched: how many kept messages are asked of each publisher.
            on_sample: called in the feed's thread when a message is in the buffer and the loop is to take more.
        """
        self.waits: bool = False
        """Whether the thread waits for the loop, which may take samples out of the ring; else it has the next one."""
        self._buffer, self._on_sample, self._closed = buffer, on_sample, False
        self._emptied = threading.Lock()
        """Held, but released for a moment when the loop hands the ring back to the thread."""
        self._emptied.acquire()
        ring = zenoh.handlers.RingChannel(depth)
        self._subscriber: Any = _latched(session, key, ring, latched) if latched else _plain(session, key, ring)
        # Its handler waits in its place: it could not be undeclared during its own recv().
        buffer.ring = self._subscriber.handler
        self._thread = threading.Thread(target=self._watch, name=f"busflow.inlet.{key}", daemon=True)
        self._thread.start()

    def resume(self) -> None:
        """Let the thread wait for the next message, if it waits for the loop."""
        if self.waits and self._emptied.locked():
            self.waits = False
            self._emptied.release()

    def close(self) -> None:
        """Stop receiving."""
        self._closed = self.waits = True
        self._buffer.ring = None
        self._subscriber.undeclare()
        self.resume()
        self._thread.join(timeouts.current.inlet_end)

    def _watch(self) -> None:
        """Wait for a message, then for the loop to empty the ring, and so on."""
        try:
            while not self._closed:
                if len(self._buffer) == 0:  # else it was filled here when the loop had found it empty
                    self._buffer.put_sample(self._subscriber.handler.recv())
                self.waits = True
                self._on_sample()
                while not self._emptied.acquire(timeout=timeouts.current.busy_loop):
                    self._buffer.limit()
        except zenoh.ZError:
            pass  # the subscriber was undeclared, which ends a waiting recv()


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
