"""Connection: the shared parts of all endpoints that cross between a bus and a Zenoh session."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import zenoh
    from structlog.typing import FilteringBoundLogger

    from busflow.bus.bus import Bus
    from busflow.wire.queries.queries import Supports
    from busflow.wire.zenoh.sender import SenderThread


@dataclass(frozen=True, slots=True)
class Connection:
    """A bus, a session, and the means to cross between their threads."""

    bus: Bus
    session: zenoh.Session
    supports: Supports
    sender: SenderThread
    """Puts large messages on the link, so that the event loop never waits for it."""
    replier: SenderThread
    """The same for calls and answers, so that they do not wait behind images for a reader that has stopped."""
    log: FilteringBoundLogger
    on_loop: Callable[..., None]
    """Runs a function on the event loop, from any thread."""
