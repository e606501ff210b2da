"""Heartbeat: whether a run answers, found within a second: a handler that blocks its event loop says nothing itself."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import TYPE_CHECKING

from busflow.clock import SystemClock
from busflow.errors import BusflowError
from busflow_ui import timeouts

if TYPE_CHECKING:
    from busflow.commands import Peer

_BEAT_S = 0.25


class Heartbeat:
    """Asks a run again and again for a sign of life, while a page looks."""

    def __init__(self, peer: Peer, is_watched: Callable[[], bool], on_change: Callable[[float | None], None]) -> None:
        """Watch a run.

        Args:
            peer: a member of it.
            is_watched: whether it is worth asking.
            on_change: is given the seconds of silence while it lasts, and None once the run answers again.
        """
        self._peer, self._is_watched, self._on_change = peer, is_watched, on_change
        self._clock = SystemClock()
        self._is_silent = False
        self._asking = ThreadPoolExecutor(1, "busflow-ui-heartbeat")

    async def keep(self) -> None:
        """Watch until cancelled."""
        while True:
            await self._clock.sleep(_BEAT_S)
            if self._is_watched():
                await self._beat()

    async def _beat(self) -> None:
        asked_s = self._clock.seconds()
        asking = asyncio.get_running_loop().run_in_executor(self._asking, self._ask)
        while not asking.done():
            await asyncio.wait([asking], timeout=timeouts.current.silence)
            if not asking.done():
                self._is_silent = True
                self._on_change(round(self._clock.seconds() - asked_s, 1))
        if self._is_silent and asking.result():  # the question of a long silence fails; a later one is answered
            self._is_silent = False
            self._on_change(None)

    def _ask(self) -> bool:
        with suppress(BusflowError):
            return bool(self._peer.ask("run"))
        return False

    def close(self) -> None:
        """Ask no more."""
        self._asking.shutdown(wait=False, cancel_futures=True)
