"""RouterSuccessor: takes the place of the router of ROS 2 that has ended, so that nodes go on finding each other.

A session of Zenoh cannot become a router, nor listen at a further address. So the run opens a second one, which carries
nothing of the run itself: the run's own session and those of ROS 2 connect to it as to any router, and link directly.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Any

from busflow.errors import InspectionUnavailable
from busflow.runner.extension import Extension
from busflow.wire.zenoh.session import open_router

if TYPE_CHECKING:
    from busflow.clock import Clock
    from busflow.launchfile.model.network import NetworkAddress
    from busflow.log import Logger

_PERIOD_S = 1.0
"""Interval of the checks whether the router has ended; a router that is started again has as long to come first."""


class RouterSuccessor(Extension):
    """The router that a run opens when the one that it has joined has ended."""

    def __init__(self, router: NetworkAddress, clock: Clock, log: Logger) -> None:
        """Prepare to take the place of the router at an address."""
        self._router, self._clock, self._log = router, clock, log
        self._session: Any = None

    @asynccontextmanager
    async def surround(self) -> AsyncGenerator[None]:
        """Look whether the router has ended, as long as the run lasts."""
        watching = asyncio.get_running_loop().create_task(self._watch(), name="busflow.ros2.router")
        try:
            yield
        finally:
            watching.cancel()

    def end(self) -> None:
        """Stand in no more; nodes of ROS 2 keep the links that they have."""
        if self._session is not None:
            self._session.close()

    async def _watch(self) -> None:
        host, port, loop = self._router.host, self._router.port, asyncio.get_running_loop()
        try:  # once, and in a thread: it may take long
            ((family, *_, end), *_) = await loop.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        except OSError:
            return  # a name of no machine
        while self._session is None:
            await self._clock.sleep(_PERIOD_S)
            if _can_listen(family, end):
                with suppress(InspectionUnavailable):  # another run was faster
                    self._session = open_router(str(self._router))
                    self._log.info(f"the router of ROS 2 has ended: this run takes its place at {self._router}")


def _can_listen(family: int, end: tuple[object, ...]) -> bool:
    """Return whether nothing listens at an address of this machine, without a connection to what may listen."""
    try:
        with socket.socket(family) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(end)
            return True
    except OSError:
        return False
