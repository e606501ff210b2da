"""PlaybackClock: the time of a recording that is played: faster, slower, paused, or set to another moment."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from functools import partial
from typing import Protocol


class Ticking(Protocol):
    """The clock that measures a playback's time: any clock of a run."""

    def monotonic_ns(self) -> int:
        """Nanoseconds that never go back nor jump."""
        ...

    def call_at(self, deadline_ns: int, callback: Callable[[], object]) -> asyncio.TimerHandle:
        """Have the running loop call back once `monotonic_ns` reaches the deadline."""
        ...


class PlaybackClock:
    """A moment of a recording, which moves with the time of a run as long as it is not paused.

    Nanoseconds are whole, and the rate is the exact fraction that its float stands for: nothing adds up to an error,
    however long it plays.
    """

    def __init__(self, source: Ticking, start_ns: int = 0, *, rate: float = 1.0, paused: bool = False) -> None:
        """Create a clock that starts at a moment of a recording.

        Raises:
            ValueError: No time passes at this rate.
        """
        self._source = source
        self._moment_ns, self._since_ns = start_ns, source.monotonic_ns()
        self._rate, self._paused = 1.0, paused
        self._sleepers: list[asyncio.Future[bool]] = []
        if not self.set_rate(rate):
            raise ValueError(f"a recording is played at a rate above 0, not at {rate!r}")

    @property
    def rate(self) -> float:
        """Seconds of the recording that pass in a second of the run."""
        return self._rate

    @property
    def is_paused(self) -> bool:
        """True if the playback's time is paused."""
        return self._paused

    def now_ns(self) -> int:
        """Return the moment of the recording that it is now."""
        if self._paused:
            return self._moment_ns
        numerator, denominator = self._rate.as_integer_ratio()
        return self._moment_ns + (self._source.monotonic_ns() - self._since_ns) * numerator // denominator

    def set_rate(self, rate: float) -> bool:
        """Play faster or slower from now on; False, and nothing changes, where no time would pass at that rate."""
        if not 0 < rate < math.inf:
            return False
        self._set(self.now_ns())
        self._rate = float(rate)
        return True

    def pause(self) -> None:
        """Let time stand still."""
        self._set(self.now_ns())
        self._paused = True

    def resume(self) -> None:
        """Let time go on from where it stands."""
        self._set(self.now_ns())
        self._paused = False

    def jump(self, moment_ns: int) -> None:
        """Set the clock to another moment, earlier or later."""
        self._set(moment_ns)

    async def sleep_until(self, moment_ns: int) -> bool:
        """Wait until it is a moment of the recording.

        Return False at once where the clock is paused, or as soon as it is paused, sped up, slowed down or set to
        another moment: the caller then looks again for the next message.
        """
        while (left_ns := moment_ns - self.now_ns()) > 0:
            if self._paused:
                return False
            numerator, denominator = self._rate.as_integer_ratio()
            due_ns = self._source.monotonic_ns() + -(-left_ns * denominator // numerator)
            if not await self._sleep(due_ns):
                return False
        return True

    async def changed(self) -> None:
        """Wait until it is paused, resumed, sped up, slowed down or set to another moment."""
        await self._sleep(None)

    async def _sleep(self, due_ns: int | None) -> bool:
        sleeper = asyncio.get_running_loop().create_future()
        handle = None if due_ns is None else self._source.call_at(due_ns, partial(_wake, sleeper))
        self._sleepers.append(sleeper)
        try:
            return await sleeper
        finally:
            self._sleepers.remove(sleeper)
            if handle is not None:
                handle.cancel()

    def _set(self, moment_ns: int) -> None:
        self._moment_ns, self._since_ns = moment_ns, self._source.monotonic_ns()
        for sleeper in self._sleepers:
            if not sleeper.done():
                sleeper.set_result(False)


def _wake(sleeper: asyncio.Future[bool]) -> None:
    if not sleeper.done():
        sleeper.set_result(True)
