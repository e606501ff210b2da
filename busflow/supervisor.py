"""Unit: one node's life in a run, from start to stop, and what became of it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from enum import StrEnum

import anyio
import anyio.abc

from busflow.errors import StartTimeout
from busflow.failure import Failure, is_failure
from busflow.node import Node, runtime_of

START_TIMEOUT_S = 10.0
"""How long a node's `start` may take, in wall time."""


class NodeState(StrEnum):
    """Where a node is in its life."""

    BUILT = "built"
    STARTING = "starting"
    RUNNING = "running"
    STOPPING = "stopping"
    STOPPED = "stopped"
    FAILED = "failed"


class Unit:
    """A node and the task that carries it through its life."""

    def __init__(self, node: Node, *, plugin: str, on_failure: Callable[[Failure], None]) -> None:
        """A unit that `live` will carry; `on_failure` hears of whatever the node raises."""
        self.node = node
        self.plugin = plugin
        self.runtime = runtime_of(node)
        self.state = NodeState.BUILT
        self.failures: list[Failure] = []
        self.started = asyncio.Event()
        self.ended = asyncio.Event()
        self._stop_asked = asyncio.Event()
        self._scope = anyio.CancelScope()
        self._starting: anyio.CancelScope | None = None
        self._tell = on_failure
        self.runtime.on_failure = self._failed

    @property
    def name(self) -> str:
        """The node's full name."""
        return self.runtime.full_name

    async def live(self) -> None:
        """Start the node, let it run until `ask_to_stop` or a failure, and stop it."""
        try:
            with self._scope:
                try:
                    async with anyio.create_task_group() as tasks:
                        await self._start_and_run(tasks)
                        if self.runtime.has_spawned:  # most have not, and to cancel is dear
                            tasks.cancel_scope.cancel()
                finally:  # also when it is given up: what stop() does before it first awaits is done
                    self.runtime.close()
                    self.runtime.adopt_tasks(None)
                    if not self.failures:
                        self.state = NodeState.STOPPING
                    await self._guard(self.node.stop, "stop")
        finally:
            self.runtime.disconnect()
            self.state = NodeState.FAILED if self.failures else NodeState.STOPPED
            self.started.set()
            self.ended.set()

    async def _start_and_run(self, tasks: anyio.abc.TaskGroup) -> None:
        self.runtime.adopt_tasks(tasks)
        if await self._start():
            self.runtime.open()
            if type(self.node).run is not Node.run:  # most have none, and a task is dear
                self.runtime.spawn(self._guard(self.node.run, "run"), "run")
        self.started.set()
        await self._stop_asked.wait()
        self.runtime.close()

    def ask_to_stop(self) -> None:
        """Let the node leave `start` or `run` and go through its `stop`."""
        self._stop_asked.set()
        if self._starting is not None and not self.started.is_set():
            self._starting.cancel()

    def give_up(self) -> None:
        """Do not wait for the node's `stop` any longer."""
        self._scope.cancel()

    async def _start(self) -> bool:
        self.state = NodeState.STARTING
        patience: anyio.CancelScope | None = None
        if type(self.node).start is not Node.start:
            self._starting = anyio.CancelScope()
            if self._stop_asked.is_set():
                self._starting.cancel()
            limit = self.runtime.surroundings.clock.wall_timeout(START_TIMEOUT_S)
            with self._starting, limit as patience, self.runtime.starting.current():
                await self._guard(self.node.start, "start")
        if patience is not None and patience.cancelled_caught:
            late = StartTimeout(f"start() of {self.name} did not return within {START_TIMEOUT_S:g} s")
            self.runtime.fail(f"{type(self.node).__name__}.start", late)
        if self._stop_asked.is_set():
            return False
        self.state = NodeState.RUNNING
        return True

    async def _guard(self, hook: Callable[[], Awaitable[None]], name: str) -> None:
        """Run one of the node's own methods: it may raise anything, and the run decides what follows."""
        try:
            await hook()
        except BaseException as error:
            if not is_failure(error):
                raise
            self.runtime.fail(f"{type(self.node).__name__}.{name}", error)

    def _failed(self, failure: Failure) -> None:
        self.failures.append(failure)
        self.state = NodeState.FAILED
        self._tell(failure)
        self.ask_to_stop()

    def __repr__(self) -> str:
        return f"<Unit {self.name} {self.state}>"


async def outlast(task: asyncio.Task[None]) -> None:
    """Wait until a task has ended; a cancellation meanwhile is passed on only then."""
    cancelled = None
    with anyio.CancelScope(shield=True):  # a scope of anyio's would cancel every await until it is left
        while not task.done():
            try:
                await asyncio.wait([task])
            except asyncio.CancelledError as error:
                cancelled = error
    if cancelled is not None:
        raise cancelled
    task.result()
