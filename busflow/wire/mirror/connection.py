"""Connection: the parts shared by all endpoints that carry messages between a bus and a Zenoh session."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from busflow import timeouts
from busflow.clock import sleep
from busflow.wire.zenoh.keys import DOMAIN, topic_key
from busflow.wire.zenoh.sender import LARGE

if TYPE_CHECKING:
    import zenoh

    from busflow.bus.bus import Bus
    from busflow.interfaces.encoding.typesupport import TypeSupport
    from busflow.interfaces.message import Message
    from busflow.log import Logger
    from busflow.wire.line.arena import Piece
    from busflow.wire.line.lines import Lines
    from busflow.wire.queries.queries import Supports
    from busflow.wire.zenoh.sender import SenderThread


@dataclass(frozen=True, slots=True)
class Connection:
    """A bus, a session, and functions that pass work between the event loop and other threads."""

    bus: Bus
    session: zenoh.Session
    supports: Supports
    sender: SenderThread
    """Sends large messages in a thread, so that the event loop never waits for the link."""
    replier: SenderThread
    """A second such thread for calls and answers: they do not wait behind images for a reader that has stopped."""
    log: Logger
    on_loop: Callable[..., None]
    """Runs a function on the event loop, from any thread."""
    lines: Lines | None = None
    """The lines to other processes of this machine; None where all messages go through Zenoh."""
    domain: int = DOMAIN
    describes_types: bool = False
    """Whether each node describes the types of its process, as nodes of ROS 2 do."""

    def key(self, topic: str, support: TypeSupport, type_hash: str = "") -> str:
        """Return the key under which messages of this type travel on a topic or service; with its hash, or another."""
        return topic_key(topic, support.name, type_hash or support.type_hash, domain=self.domain)

    def finish(self) -> None:
        """Wait until what was published and answered last has left, before the session closes."""
        for thread in (self.sender, self.replier):
            thread.finish(timeouts.current.last_messages)
        if self.lines is not None:
            self.lines.finish(timeouts.current.last_messages)
        if max(self.sender.largest, self.replier.largest) >= LARGE:
            sleep(timeouts.current.overtaken)


def decoded(payload: zenoh.ZBytes | Piece, support: TypeSupport) -> Message:
    """Decode a message of another process, and copy no payload that is too large for one of its type.

    Raises:
        MalformedMessage: The payload is none.
    """
    support.check_size(len(payload))
    return support.decode(payload.to_bytes())
