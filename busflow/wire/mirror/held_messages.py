"""Held messages: those that a publisher sends before the processes that receive its topic have admitted it."""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import zenoh

from busflow import timeouts
from busflow.wire.zenoh.keys import QUERY_PREFIX
from busflow.wire.zenoh.sender import DEPTH, MOST_BYTES

if TYPE_CHECKING:
    from busflow.wire.line.packets import Signed
    from busflow.wire.mirror.connection import Connection


def ask_processes(connection: Connection, on_end: Callable[[bool], None]) -> None:
    """Query every process of the run; each answers after it has admitted the publishers that were shown before.

    Args:
        connection: the session in which the query is sent.
        on_end: called on the loop when all processes have answered (True), or after a second.
    """
    all_answered = True

    def on_reply(reply: zenoh.Reply) -> None:
        nonlocal all_answered
        all_answered = all_answered and reply.ok is not None

    callback: Any = zenoh.handlers.Callback(
        on_reply, drop=lambda: connection.on_loop(on_end, all_answered), indirect=False
    )
    connection.session.get(
        f"{QUERY_PREFIX}/*/run",
        callback,
        payload="{}",
        congestion_control=zenoh.CongestionControl.DROP,
        consolidation=zenoh.ConsolidationMode.NONE,
        allowed_destination=zenoh.Locality.REMOTE,
        timeout=timeouts.current.held_messages,
    )


class HeldMessages:
    """Encoded messages of one publisher, held until every process has answered a query or a second has passed."""

    def __init__(self, connection: Connection, room: int, on_end: Callable[[bool], None]) -> None:
        """Query every process of the run, and hold what is added.

        Args:
            connection: the session in which the query is sent.
            room: how many messages may be held; beyond that, the oldest is dropped for a new one.
            on_end: as for `ask_processes`.
        """
        self.dropped: int = 0
        self._most = min(room, DEPTH)
        self._messages: deque[Signed] = deque()
        self._bytes = 0
        ask_processes(connection, on_end)

    def add(self, payload: bytes, attachment: bytes) -> None:
        """Hold one more message."""
        self._messages.append((payload, attachment))
        self._bytes += len(payload)
        while len(self._messages) > self._most or (self._bytes > MOST_BYTES and len(self._messages) > 1):
            self._bytes -= len(self._messages.popleft()[0])
            self.dropped += 1

    def release(self) -> tuple[Signed, ...]:
        """Return the held messages, each with its attachment, and forget them."""
        messages = tuple(self._messages)
        self._messages.clear()
        return messages
