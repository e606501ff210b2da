"""Restarting: a part of a run that lives once, and again as its policy says: a node, a process or a program."""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from contextlib import suppress
from enum import StrEnum
from typing import TYPE_CHECKING, TypeVar

import anyio

from busflow import timeouts
from busflow.launchfile.model.supervision import Condition, Restart, RestartPolicy
from busflow.node.supervision import Backoff

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from busflow.log import Logger

S = TypeVar("S", bound=StrEnum)
_CONDITIONS = tuple(Condition)  # iterating over a class of words is slow, and a run may have many nodes


def following(part: str, table: Mapping[S, Collection[S]], present: S, state: S) -> S:
    """Return the next state of a part of a run, which a table allows after the present one.

    Raises:
        RuntimeError: the table does not allow it, which is a mistake in busflow.
    """
    if state not in table[present]:
        raise RuntimeError(f"{part} cannot be {state} after {present}")
    return state


class Restarting(ABC):
    """A part of a run that others may wait for, and that is restarted. A life is the time from one start to its end."""

    _waits = "waits for another one"
    _other = "name"
    """The line of the log where it waits for long, and the key for the name of the other part."""

    def __init__(self, name: str, policy: RestartPolicy, seconds: Callable[[], float], log: Logger) -> None:
        """Prepare it; `live` starts it.

        Args:
            name: its full name.
            policy: when it is restarted, and how often.
            seconds: returns the run's time.
            log: the log for its restarts.
        """
        self.name: str = name
        self.policy: RestartPolicy = policy
        """Policy by which it is restarted."""
        self.needs: list[tuple[Restarting, Condition]] = []
        """The conditions of others for which it waits before its start."""
        self.met: set[Condition] = set()
        """Its own conditions that are met; others may wait for them."""
        self._seconds, self._log = seconds, log
        self._conditions = {condition: asyncio.Event() for condition in _CONDITIONS}
        self._backoff = Backoff(policy)
        self._prepare_lives()

    def _prepare_lives(self) -> None:
        """Prepare the first life, or the first one after its end."""
        self.ended: asyncio.Event = asyncio.Event()
        """Set when it has ended and is not restarted."""
        self._stopping = asyncio.Event()
        self._opening: anyio.CancelScope | None = None
        """The scope that a request to stop cancels: around the wait for others, and a node's `start`."""
        self._running_since_s: float | None = None

    @property
    def restarts(self) -> int:
        """Number of restarts, a scheduled one included."""
        return self._backoff.restarts

    async def live(self) -> None:
        """Live, and live again as the policy says, until it ends for good or is asked to stop."""
        try:
            with anyio.CancelScope() as self._scope:
                pause_s = await self._live_once()
                while pause_s is not None and not await self._is_stopped_within(pause_s):
                    pause_s = await self._live_once()
        finally:
            if not self.ended.is_set():
                self._finish()

    @abstractmethod
    async def _live_once(self) -> float | None:
        """Start it and wait for its end; return `_next_pause_s`, or None if it cannot start."""

    def _finish(self) -> None:
        """End for good; the wait of others for conditions ends too."""
        for event in (*self._conditions.values(), self.ended):
            event.set()

    def ask_to_stop(self) -> None:
        """Ask it to end, without a restart."""
        self._stopping.set()
        if self._opening is not None:
            self._opening.cancel()

    # Restarts.

    def _next_pause_s(self, *, failed: bool, mendable: bool = True) -> float | None:
        """Count a restart and return the pause before it, in seconds; None if no other life follows."""
        wanted = self.policy.when is Restart.ALWAYS or (failed and self.policy.when is Restart.ON_FAILURE)
        if not wanted or not mendable or self._stopping.is_set():
            return None
        now_s, since_s = self._seconds(), self._running_since_s
        self._running_since_s = None
        pause_s = self._backoff.next_s(lived_s=0.0 if since_s is None else now_s - since_s, now_s=now_s)
        if pause_s is None:
            self._log.error(self._limit)
        return pause_s

    @property
    def _limit(self) -> str:
        """Text for the log, after too many restarts."""
        return f"given up after {self.policy.most} restarts within {self.policy.window_s:g} s"

    async def _is_stopped_within(self, pause_s: float) -> bool:
        with suppress(TimeoutError):
            async with asyncio.timeout(pause_s):
                await self._stopping.wait()
        return self._stopping.is_set()

    # Conditions.

    def condition_event(self, condition: Condition) -> asyncio.Event:
        """Return the event that is set once a condition is met or can no longer be met; `met` shows which."""
        return self._conditions[condition]

    def depend(self, others: Mapping[str, Restarting], conditions: Mapping[str, Condition]) -> None:
        """Let it wait for conditions of others, by their names; for no condition of a name that is not among them."""
        self.needs = [(others[name], condition) for name, condition in conditions.items() if name in others]
        for other, condition in self.needs:
            other.condition_event(condition)  # the first message is observed only from here on

    def _meet(self, condition: Condition) -> None:
        self.met.add(condition)
        self._conditions[condition].set()

    async def _wait_for_others(self) -> bool:
        """Wait for its needs; return False if it is to stop, or if a condition can no longer be met."""
        if self._stopping.is_set():
            return False
        with anyio.CancelScope() as scope:
            self._opening = scope
            for other, condition in self.needs:
                event = other.condition_event(condition)
                with anyio.move_on_after(timeouts.current.waiting_warning):
                    await event.wait()
                if not event.is_set():
                    self._log.warning(self._waits, **{self._other: other.name}, condition=condition.value)
                    await event.wait()
                if condition not in other.met and not scope.cancel_called:
                    self._wait_in_vain(other.name, condition)
                    return False
        self._opening = None
        return not scope.cancel_called

    def _wait_in_vain(self, other: str, condition: Condition) -> None:
        """Fail, since another part of the run has ended before it met a condition."""
        raise NotImplementedError  # for a part that has no needs
