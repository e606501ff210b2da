"""Playing: hands over each message of a bag when a playback's clock reaches its time."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING

from busflow.recording.player.playback_clock import PlaybackClock, Ticking

if TYPE_CHECKING:
    from busflow.recording.bag.channel import Entry
    from busflow.recording.player.ordered_messages import OrderedMessages


class Playing:
    """The messages of a playback, its clock, and the function that receives each message."""

    def __init__(
        self,
        messages: OrderedMessages,
        source: Ticking,
        publish: Callable[[Entry], Awaitable[None]],
        *,
        rate: float = 1.0,
        paused: bool = False,
    ) -> None:
        """Get ready to play from the first message.

        Args:
            messages: What is played.
            source: The time of the run in which it is played.
            publish: Is given each message.
            rate: Seconds of the recording in a second of the run.
            paused: Do not begin before `resume`.
        """
        self.clock: PlaybackClock = PlaybackClock(source, messages.start_ns, rate=rate, paused=paused)
        self.played: int = 0
        self._messages, self._publish = messages, publish
        self._from_ns = messages.start_ns
        self._stopped = False

    @property
    def position_ns(self) -> int:
        """The moment of the recording that is being played, within the bounds of what is played."""
        return min(max(self.clock.now_ns(), self._messages.start_ns), self._messages.end_ns)

    @property
    def span_ns(self) -> tuple[int, int]:
        """The first and the last moment that are played."""
        return self._messages.start_ns, self._messages.end_ns

    async def play(self) -> bool:
        """Play to the end, from where it stands; False where it was stopped before.

        At the end it stands at the beginning again, unless it is paused there: then it waits for what comes.
        """
        self._stopped = False
        await self._messages.look()  # no time passes before there is something to play
        self.clock.jump(self._from_ns)
        while not self._stopped:
            if self.clock.is_paused:
                await self.clock.changed()
                continue
            entry = await self._messages.look()
            if self._stopped or self.clock.is_paused:
                continue  # since it was looked for
            if entry is None:
                self._stand_at(self._messages.start_ns)
                return True
            if await self.clock.sleep_until(entry.log_time_ns) and self._messages.is_next(entry):
                await self._hand_over()
        return False

    def stop(self) -> None:
        """Let `play` return."""
        self._stopped = True
        self.clock.jump(self.clock.now_ns())

    async def play_next(self) -> bool:
        """While paused, hand over one message without waiting; False where there is none, or where it is not paused."""
        if not self.clock.is_paused:
            return False
        entry = await self._messages.look()
        if entry is None or not self.clock.is_paused:
            return False
        self._from_ns = entry.log_time_ns
        self.clock.jump(entry.log_time_ns)
        await self._hand_over()
        return True

    async def again(self) -> bool:
        """Return whether there is something to play from here on."""
        return await self._messages.look() is not None

    async def burst(self, count: int) -> int:
        """While paused, hand over so many messages without waiting between them; how many there were."""
        done = 0
        while done < count and await self.play_next():
            done += 1
        return done

    def seek(self, moment_ns: int) -> None:
        """Go on from a moment of the recording, its own messages included."""
        self._messages.seek(moment_ns)
        self._from_ns = max(moment_ns, self._messages.start_ns)
        self.clock.jump(self._from_ns)

    def _stand_at(self, moment_ns: int) -> None:
        self._messages.seek(moment_ns)
        self._from_ns = moment_ns

    async def _hand_over(self) -> None:
        entry = self._messages.take()
        self.played += 1
        await self._publish(entry)
        # Receivers run before the next message: what was not lost when it was recorded is not lost now.
        await asyncio.sleep(0)
