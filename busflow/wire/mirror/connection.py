"""Connection: what every end that crosses between a bus and a Zenoh session works with."""

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
    """A bus and a session, and the ways between their threads."""

    bus: Bus
    session: zenoh.Session
    supports: Supports
    sender: SenderThread
    """Puts large messages on the link, so that the loop never waits for it."""
    replier: SenderThread
    """The same for calls and answers, which are not to wait behind the images of somebody who has stopped reading."""
    log: FilteringBoundLogger
    on_loop: Callable[..., None]
    """Runs a function on the event loop, from any thread."""
