"""NodeLifetime: a node between a start and its end: if it is open, which tasks it runs, and where its failures go."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from contextlib import suppress
from inspect import iscoroutine
from typing import Any

import anyio.abc

from busflow.bus.dispatcher import Dispatcher
from busflow.bus.failure import Failure, is_failure
from busflow.bus.services.call import Activity, set_activity
from busflow.errors import NotRunning
from busflow.interfaces.message import Message
from busflow.log import Logger

TASK_NODE = "busflow_node"
"""Attribute of a task of a node, or that code of users has made: the lifetime of its node, or None."""


class NodeLifetime:
    """State of a node between start and end, for the code that calls its handlers."""

    log: Logger
    """The run's log, bound to the node; there from its declaration on."""
    dispatcher: Dispatcher
    """The dispatcher that calls its handlers and delivers at once what it publishes; set once it is connected."""

    def __init__(self, kind: str, name: str, close: Callable[[], None]) -> None:
        """Create the lifetime of a node of this class and name; `close` is called when it fails, to deliver no more."""
        self.kind = kind
        self.name = name
        """Its full name, from its declaration on."""
        self.starting: Activity = Activity(f"start() of {name}")
        """The activity of its `start`: callers of its services wait until it has returned."""
        self.is_open = False
        """True if messages are handed over and timers tick."""
        self.has_spawned = False
        """True if there may be tasks to cancel at the end."""
        self.on_failure: Callable[[Failure], None] | None = None
        self.on_task_end: Callable[[], None] | None = None
        self.on_end: Callable[[], None] | None = None
        """A callback after its `stop` that looks for tasks left behind."""
        self._close = close
        self._running = 0
        self._tasks: anyio.abc.TaskGroup | None = None
        self._awaited: list[Awaitable[None]] = []
        """The awaitables of the node's own code that are being awaited."""

    def be_called(self, name: str, log: Logger) -> None:
        """Set the node's full name and its log."""
        self.name: str = name
        self.starting.name = f"start() of {name}"
        self.log = log

    def adopt_tasks(self, tasks: anyio.abc.TaskGroup | None) -> None:
        """Run what the node spawns in this task group; without one it can spawn nothing."""
        self._tasks = tasks

    @property
    def tasks(self) -> int:
        """The number of spawned tasks that still run."""
        return self._running

    def spawn(self, coroutine: Coroutine[Any, Any, None], name: str) -> None:
        """Run a coroutine in the node's task group; its failure is the node's."""
        if self._tasks is None:
            coroutine.close()
            raise NotRunning(f"{self.name} has no tasks before its start() and from its stop() on")
        self.has_spawned: bool = True
        self._running += 1
        self._tasks.start_soon(self._guarded, coroutine, name, name=f"{self.name}.{name}")

    def own_current_task(self) -> None:
        """Mark the running task as the node's; a handler that is a plain function may run in another node's task."""
        setattr(asyncio.current_task(), TASK_NODE, self)

    async def _guarded(self, coroutine: Coroutine[Any, Any, None], name: str) -> None:
        set_activity(None)  # not its creator's
        self.own_current_task()
        try:
            await self.awaited(coroutine)
        except BaseException as error:
            if not is_failure(error):
                raise
            self.fail(f"{self.kind} (task {name})", error)
        finally:
            self._running -= 1
            if self.on_task_end is not None:
                self.on_task_end()

    async def awaited(self, own: Awaitable[None]) -> None:
        """Await code of the node, so that `close_tasks` can end it."""
        self._awaited.append(own)
        try:
            await own
        finally:
            self._awaited.remove(own)

    def close_tasks(self) -> None:
        """End what the node awaits as Python ends a generator, where it catches its cancellation and goes on."""
        for own in tuple(self._awaited):
            if iscoroutine(own):
                with suppress(RuntimeError):  # it catches even this
                    own.close()

    def fail(self, origin: str, error: BaseException, message: Message | None = None) -> None:
        """Report the node's failure to its supervisor, and deliver nothing more to it."""
        self._close()
        if self.on_failure is not None:
            self.on_failure(Failure(self.name, origin, error, message))
