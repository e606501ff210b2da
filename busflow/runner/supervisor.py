"""Supervisor: starts one node of a run, restarts and stops it by its policies, and keeps its state and failures."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Collection, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

import anyio
import anyio.abc

from busflow import timeouts
from busflow.bus.failure import Failure, is_failure
from busflow.errors import DependencyEnded, RestartLimit, StartTimeout, StopTimeout
from busflow.launchfile.model.supervision import Condition, OnExit, Restart, Supervision
from busflow.node.factory import rebuild
from busflow.node.node import Node
from busflow.node.runtime import NodeRuntime
from busflow.runner.report import NodeReport
from busflow.runner.restarting import Restarting, following

if TYPE_CHECKING:
    from busflow.runner.planning.planned_node import PlannedNode


class NodeState(StrEnum):
    """State of a node in a run."""

    BUILT = "built"
    WAITING = "waiting"
    """It waits for the nodes that it depends on."""
    STARTING = "starting"
    RUNNING = "running"
    STOPPING = "stopping"
    STOPPED = "stopped"
    FAILED = "failed"
    RESTARTING = "restarting"
    """It failed or ended, and will be restarted."""
    STOPPED_BY_HAND = "stopped by hand"
    """It was stopped while the others went on, and runs again only when it is started by hand."""


@dataclass(frozen=True, slots=True)
class Overseer:
    """Callbacks of a graph, notified of the states of its nodes."""

    on_failure: Callable[[Failure], None]
    """A node has failed and is not restarted."""
    on_pause: Callable[[Supervisor, Failure | None, float], None]
    """A node has failed or ended, and will be restarted after this number of seconds."""
    on_restart: Callable[[Supervisor], None]
    """A node was built anew, and is about to start."""
    on_exit: Callable[[Supervisor], None]
    """The `run()` of a node with `on_exit: shutdown` has returned."""
    on_end: Callable[[Supervisor], None]
    """A node has ended for any reason, and is not restarted."""


_LIVING = {NodeState.BUILT, NodeState.WAITING, NodeState.STARTING, NodeState.RUNNING}
"""States of a life that nothing has ended yet."""
_OUT = {NodeState.STOPPING, NodeState.FAILED}
TRANSITIONS: Mapping[NodeState, Collection[NodeState]] = {
    NodeState.BUILT: {NodeState.WAITING, NodeState.STARTING, *_OUT},
    NodeState.WAITING: {NodeState.STARTING, NodeState.RESTARTING, *_OUT},
    NodeState.STARTING: {NodeState.WAITING, NodeState.RUNNING, NodeState.RESTARTING, *_OUT},
    NodeState.RUNNING: {NodeState.RESTARTING, *_OUT},
    NodeState.RESTARTING: {NodeState.WAITING, NodeState.STARTING, NodeState.STOPPING},
    NodeState.STOPPING: {NodeState.STOPPED, NodeState.STOPPED_BY_HAND, NodeState.FAILED},
    # Started by hand; or its code, e.g. a thread, fails after the end.
    NodeState.STOPPED: {NodeState.STARTING, NodeState.FAILED},
    NodeState.STOPPED_BY_HAND: {NodeState.STARTING, NodeState.FAILED},
    NodeState.FAILED: set(),
}
"""The states that may follow each state of a node."""


class Supervisor(Restarting):
    """Supervisor of one node: starts, restarts and stops it."""

    _waits, _other = "waits for another node", "node"

    def __init__(self, planned: PlannedNode, overseer: Overseer) -> None:
        """Prepare the node; `live` runs it."""
        self.node: Node = planned.node
        self.plugin: str = planned.plugin
        self.supervision: Supervision = planned.supervision
        self.runtime: NodeRuntime = planned.runtime
        self.state: NodeState = NodeState.BUILT
        """The state of the node; changed by `_become` alone."""
        self.failure: Failure | None = None
        """The last failure."""
        self.failure_count: int = 0
        self.stopped_by_hand: int = 0
        """How often it was stopped while the others went on, to restart it included."""
        self.started_by_hand: int = 0
        """How often it was started after its end."""
        self.started: asyncio.Event = asyncio.Event()
        """Set once the start of the graph need not wait for it any longer."""
        self._overseer = overseer
        self._final = NodeState.STOPPED
        """The state in which it ends unless it fails; from a stop by hand to a start by hand another one."""
        self._pause_s = 0.0
        """Seconds until the next life, while it is `restarting`."""
        self._over = asyncio.Event()
        """Set while it has no life, or its life is to end."""
        runtime = self.runtime
        super().__init__(runtime.full_name, self.supervision.restart, runtime.surroundings.clock.seconds, runtime.log)
        self._lives_before = runtime.surroundings.life
        runtime.life.on_failure = self._failed

    def _become(self, state: NodeState) -> None:
        """Change the state, as `TRANSITIONS` allows."""
        was, self.state = self.state, following(self.name, TRANSITIONS, self.state, state)
        if was in _LIVING and state not in _LIVING:
            self._over.set()
            if self._opening is not None:
                self._opening.cancel()
        if state in {NodeState.RUNNING, NodeState.STOPPING, NodeState.FAILED}:
            self.started.set()

    @property
    def is_held(self) -> bool:
        """Whether it is stopped by hand, and not yet started again."""
        return self._final is NodeState.STOPPED_BY_HAND

    @property
    def ends_at_once(self) -> bool:
        """Whether none of the node's own code runs at its end: it runs, and has no `stop` and no tasks."""
        has_stop = type(self.node).stop is not Node.stop
        return self.state is NodeState.RUNNING and not has_stop and not self.runtime.life.has_spawned

    def statistics(self) -> NodeReport:
        """Return the node's line of the report."""
        return NodeReport(
            name=self.name,
            plugin=self.plugin,
            state=self.state.value,
            parameters_set=self.runtime.parameters.times_set,
            restarts=self.restarts,
            stopped_by_hand=self.stopped_by_hand,
            started_by_hand=self.started_by_hand,
            failures=self.failure_count,
            last_failure=self.failure and self.failure.summary,
        )

    def _finish(self) -> None:
        if self.is_held:
            self.runtime.discard_queued("stopped by hand")
        self.runtime.disconnect()
        if self.state is not NodeState.FAILED:
            if self.state is not NodeState.STOPPING:
                self._become(NodeState.STOPPING)
            self._become(self._final)
        if self.is_held:  # others go on waiting for its conditions: it may be started again
            self.ended.set()
        else:
            super()._finish()
        self._overseer.on_end(self)

    # By hand.

    def stop_by_hand(self) -> None:
        """Count a stop by hand, before `ask_to_stop`; what waits for this node then goes on waiting."""
        self._final = NodeState.STOPPED_BY_HAND
        self.stopped_by_hand += 1

    def hold(self) -> None:
        """Leave a node stopped that was stopped by hand in an earlier life of its process."""
        self._final = NodeState.STOPPED_BY_HAND
        self.runtime.close()
        self._finish()

    def renew(self) -> None:
        """Count a start by hand of a node that has ended; `live` then runs it again."""
        self._become(NodeState.STARTING)
        self._final = NodeState.STOPPED
        self.started_by_hand += 1
        self._prepare_lives()

    # A life.

    async def _live_once(self) -> float | None:
        first = NodeState.WAITING if self.needs else NodeState.STARTING
        if self.state not in {first, NodeState.STOPPING}:  # started by hand; asked to stop before the first step
            self._become(first)
        is_first = not self.restarts and not self.started_by_hand
        built = is_first or (not self._stopping.is_set() and self._build_anew())
        if built and (not self.needs or await self._wait_for_others()):
            await self._start_and_stop()
        return self._pause_s if self.state is NodeState.RESTARTING else None

    def _build_anew(self) -> bool:
        """Build the node again from its current parameters; return False if that fails, which counts as a life."""
        predecessor = self.runtime
        self._over.clear()
        try:
            life = self._lives_before + self.restarts + self.started_by_hand
            self.runtime = rebuild(predecessor, predecessor.node.parameters, life)
            self.runtime.life.on_failure = self._failed
            if Condition.FIRST_MESSAGE not in self.met:
                self.runtime.endpoints.on_first = predecessor.endpoints.on_first
            self.node = self.runtime.node
            self._overseer.on_restart(self)
            self.runtime.connect(predecessor.bus, predecessor)
        except BaseException as error:
            if not is_failure(error):
                raise
            self._failed(Failure(self.name, f"{type(self.node).__name__} (built anew)", error))
            return False
        return True

    async def _start_and_stop(self) -> None:
        self.runtime.life.own_current_task()
        try:
            async with anyio.create_task_group() as tasks:
                await self._start_and_run(tasks)
                if self.runtime.life.has_spawned:  # most nodes have not, and a cancellation is expensive
                    tasks.cancel_scope.cancel()
        finally:  # also when it is given up: then stop() runs up to its first await
            self.runtime.close()
            self.runtime.life.adopt_tasks(None)
            if self.state in _LIVING:
                self._become(NodeState.STOPPING)
            await self._stop()
            if self.runtime.life.on_end is not None:
                self.runtime.life.on_end()
            self.runtime.end()

    async def _start_and_run(self, tasks: anyio.abc.TaskGroup) -> None:
        self.runtime.life.adopt_tasks(tasks)
        if await self._start():
            self.runtime.open()
            self._running_since_s = self._seconds()
            self._meet(Condition.READY)
            if type(self.node).run is not Node.run:  # most nodes have none, and a task is expensive
                self.runtime.life.spawn(self._run(), "run")
        await self._over.wait()
        self.runtime.close()

    def ask_to_stop(self) -> None:
        """End the node's `start` or `run` and call its `stop`; it is not restarted."""
        super().ask_to_stop()
        if self.state in _LIVING or self.state is NodeState.RESTARTING:
            self._become(NodeState.STOPPING)
        self.runtime.close()  # at once: a blocking handler would be called again before any other callback

    def give_up(self, after_s: float) -> None:
        """Cancel a node that did not stop in time; this is a failure."""
        late = StopTimeout(f"{self.name} did not stop within {after_s:g} s, and is given up")
        self._failed(Failure(self.name, f"{type(self.node).__name__}.stop", late))
        self._scope.cancel()

    def close_tasks(self) -> None:
        """End the tasks of a node that catches its cancellation and goes on, as Python ends a generator."""
        self.runtime.life.on_failure = None  # it has failed already, and this is the consequence
        self.runtime.life.close_tasks()

    def leave(self) -> None:
        """Let the graph end without a node that nothing ends; its task stays on the loop."""
        self.runtime.log.error("left behind: no cancellation ends it; let CancelledError pass, and shield nothing")
        self._finish()

    async def _start(self) -> bool:
        if self.state is NodeState.WAITING:
            self._become(NodeState.STARTING)
        self._meet(Condition.STARTED)
        patience: anyio.CancelScope | None = None
        if type(self.node).start is not Node.start:
            self._opening = anyio.CancelScope()
            if self.state is not NodeState.STARTING:
                self._opening.cancel()
            limit = self.runtime.surroundings.clock.wall_timeout(timeouts.current.start)
            with self._opening, limit as patience, self.runtime.life.starting.current():
                await self._guard(self.node.start, "start")
            self._opening = None
        if patience is not None and patience.cancelled_caught:
            late = StartTimeout(f"start() of {self.name} did not return within {timeouts.current.start:g} s")
            self.runtime.life.fail(f"{type(self.node).__name__}.start", late)
        if self.state is not NodeState.STARTING:
            return False
        self._become(NodeState.RUNNING)
        return True

    async def _stop(self) -> None:
        if type(self.node).stop is Node.stop:
            return
        if self._stopping.is_set():  # limited by the grace of the graph
            await self._guard(self.node.stop, "stop")
            return
        with self.runtime.surroundings.clock.wall_timeout(timeouts.current.start) as patience:
            await self._guard(self.node.stop, "stop")
        if patience.cancelled_caught:
            late = StopTimeout(f"stop() of {self.name} did not return within {timeouts.current.start:g} s")
            self.runtime.life.fail(f"{type(self.node).__name__}.stop", late)

    async def _run(self) -> None:
        if await self._guard(self.node.run, "run"):
            self.runtime.life.on_task_end = self._check_ended

    async def _guard(self, hook: Callable[[], Awaitable[None]], name: str) -> bool:
        """Run one of the node's own methods; return False, and fail the node, if it raises."""
        try:
            await self.runtime.life.awaited(hook())
        except BaseException as error:
            if not is_failure(error):
                raise
            self.runtime.life.fail(f"{type(self.node).__name__}.{name}", error)
            return False
        return True

    # Conditions.

    def condition_event(self, condition: Condition) -> asyncio.Event:
        """Return the event that is set once a condition is met or can no longer be met; `met` shows which."""
        if condition is Condition.FIRST_MESSAGE and self.runtime.endpoints.on_first is None:
            self._observe_first_message()
        return super().condition_event(condition)

    def _observe_first_message(self) -> None:
        self.runtime.endpoints.on_first = lambda: self._meet(Condition.FIRST_MESSAGE)
        # Of a running node, if a node that was added later waits for it.
        for publisher in self.runtime.endpoints.publishers:
            if publisher.published:
                self._meet(Condition.FIRST_MESSAGE)
            publisher.on_first = self.runtime.endpoints.on_first
            publisher.adjust()

    def _wait_in_vain(self, other: str, condition: Condition) -> None:
        lacking = "without a message" if condition is Condition.FIRST_MESSAGE else f"before it was {condition}"
        in_vain = DependencyEnded(f"{other} has ended {lacking}")
        self._failed(Failure(self.name, "depends_on", in_vain), mendable=False)

    # The end of a life.

    def _check_ended(self) -> None:
        """End the run or this life as the policies say; called after each task of the node once `run` has returned."""
        if self.state is not NodeState.RUNNING:
            return
        if self.policy.when is Restart.ALWAYS:
            self._settle(None)
        elif self.supervision.on_exit is OnExit.SHUTDOWN:
            self._overseer.on_exit(self)
        elif not self.runtime.is_busy:
            self._settle(None)

    def _failed(self, failure: Failure, *, mendable: bool = True) -> None:
        self.failure = failure
        self.failure_count += 1
        if self.state in _LIVING:
            self._settle(failure, mendable=mendable)
        elif self.state is NodeState.RESTARTING:
            self.runtime.log.error(failure.summary)
        else:
            self._fail(failure)

    def _settle(self, failure: Failure | None, *, mendable: bool = True) -> None:
        """Decide if the node is restarted, now that it has failed or ended."""
        pause_s = self._next_pause_s(failed=failure is not None, mendable=mendable)
        if pause_s is not None:
            self._pause_s = pause_s
            self._become(NodeState.RESTARTING)
            self._overseer.on_pause(self, failure, pause_s)
            return
        if failure is None and self.policy.when is Restart.ALWAYS:
            failure = Failure(self.name, f"{type(self.node).__name__}.run", RestartLimit(self._limit))
        if failure is not None:
            self._fail(failure)
        if self.state in _LIVING:
            self._become(NodeState.STOPPING)

    def _fail(self, failure: Failure) -> None:
        """End the run with a failure; one during a stop by hand is only logged if the policy restarts the node."""
        if self.is_held and self.policy.when is not Restart.NEVER:
            self.runtime.log.error(failure.summary)
            return
        if self.state is not NodeState.FAILED:
            self._become(NodeState.FAILED)
        self._overseer.on_failure(failure)

    def __repr__(self) -> str:
        return f"<Supervisor {self.name} {self.state}>"


async def outlast(task: asyncio.Task[None]) -> None:
    """Wait until a task has ended; a cancellation meanwhile is raised only after that."""
    cancelled = None
    with anyio.CancelScope(shield=True):  # else an outer cancelled anyio scope would cancel every await
        while not task.done():
            try:
                await asyncio.wait([task])
            except asyncio.CancelledError as error:
                cancelled = error
    if cancelled is not None:
        raise cancelled
    task.result()
