"""Supervisor: starts one node of a run, restarts and stops it by its policies, and keeps its state and failures."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Collection
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Protocol

import anyio
import anyio.abc

from busflow import timeouts
from busflow.bus.failure import Failure, is_failure
from busflow.errors import DependencyEnded, RestartLimit, StartTimeout, StopTimeout
from busflow.node.factory import rebuild
from busflow.node.lifetime import CURRENT
from busflow.node.node import Node
from busflow.node.runtime import NodeRuntime
from busflow.node.supervision import Backoff, Condition, OnExit, Restart, Supervision
from busflow.runner.report import NodeReport

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


class Prerequisite(Protocol):
    """What a node may depend on: another node, or what an extension of the graph has."""

    @property
    def name(self) -> str:
        """Its full name."""
        ...

    @property
    def met(self) -> Collection[Condition]:
        """Conditions that are met."""
        ...

    def condition_event(self, condition: Condition) -> asyncio.Event:
        """Return the event that is set once a condition is met or can no longer be met; `met` shows which."""
        ...


class Supervisor:
    """Supervisor of one node: starts, restarts and stops it. A life is the time from one start to its stop."""

    def __init__(self, planned: PlannedNode, overseer: Overseer) -> None:
        """Prepare the node; `live` runs it."""
        self.node: Node = planned.node
        self.plugin: str = planned.plugin
        self.supervision: Supervision = planned.supervision
        self.runtime: NodeRuntime = planned.runtime
        self.state: NodeState = NodeState.BUILT
        self.failure: Failure | None = None
        """The last failure."""
        self.failure_count: int = 0
        self.stopped_by_hand: int = 0
        """How often it was stopped while the others went on, to restart it included."""
        self.started_by_hand: int = 0
        """How often it was started after its end."""
        self.needs: list[tuple[Prerequisite, Condition]] = []
        """What it waits for before a start, where the conditions are not met; the graph finds it."""
        self.met: set[Condition] = set()
        """Conditions of this node that are met; other supervisors may wait for them."""
        self.started: asyncio.Event = asyncio.Event()
        """Set once the start of the graph need not wait for it any longer."""
        self.ended: asyncio.Event = asyncio.Event()
        self._condition_events = {Condition.READY: asyncio.Event()}
        self._overseer, self._backoff = overseer, Backoff(self.supervision.restart)
        self._lives_before = self.runtime.surroundings.life
        self._stop_asked = asyncio.Event()
        self._by_hand = False
        """True from when it is stopped by hand until it is started by hand."""
        self._scope = anyio.CancelScope()
        self._starting: anyio.CancelScope | None = None
        self._begin_life()
        self.runtime.life.on_failure = self._failed

    def _begin_life(self) -> None:
        self._over = asyncio.Event()
        """Set when this life is to end."""
        self._settled = False
        """True once it is decided if another life follows."""
        self._pause_s: float | None = None
        """Seconds until the next life; None if there is none."""
        self._returned = False
        """True once `run` has returned."""
        self._running_since_s: float | None = None

    @property
    def name(self) -> str:
        """The node's full name."""
        return self.runtime.full_name

    @property
    def restarts(self) -> int:
        """The number of restarts, a scheduled one included."""
        return self._backoff.restarts

    @property
    def is_held(self) -> bool:
        """Whether it is stopped by hand, and not yet started again."""
        return self._by_hand

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

    async def live(self) -> None:
        """Start the node, let it run until it ends, fails or is asked to stop; stop it; restart it by its policy."""
        try:
            with self._scope:
                begun = not self.started_by_hand or (not self._stop_asked.is_set() and self._begin_anew())
                begun = begun and (not self.needs or await self._wait_for_others())
                while begun or self._pause_s is not None:
                    if begun:
                        await self._live_once()
                    if self._pause_s is None or not await self._pause(self._pause_s):
                        break
                    begun = self._begin_anew()
        finally:
            if not self.ended.is_set():
                self._end()

    def _end(self) -> None:
        if self._by_hand:
            self.runtime.discard_queued("stopped by hand")
        self.runtime.disconnect()
        if self.state is not NodeState.FAILED:
            self.state = NodeState.STOPPED_BY_HAND if self._by_hand else NodeState.STOPPED
        # What waits for a node that was stopped by hand goes on waiting: it may be started again.
        conditions = () if self._by_hand else self._condition_events.values()
        for event in (*conditions, self.started, self.ended):
            event.set()
        self._overseer.on_end(self)

    # By hand.

    def stop_by_hand(self) -> None:
        """Count a stop by hand, before `ask_to_stop`; what waits for this node then goes on waiting."""
        self._by_hand = True
        self.stopped_by_hand += 1

    def hold(self) -> None:
        """Leave a node stopped that was stopped by hand in an earlier life of its process."""
        self._by_hand = True
        self.runtime.close()
        self._end()

    def renew(self) -> None:
        """Count a start by hand of a node that has ended; `live` then runs it again."""
        self._by_hand = False
        self.started_by_hand += 1
        self._stop_asked = asyncio.Event()
        self._scope = anyio.CancelScope()
        self.ended.clear()
        self.state = NodeState.STARTING

    async def _live_once(self) -> None:
        CURRENT.set(self.runtime.life)
        try:
            async with anyio.create_task_group() as tasks:
                await self._start_and_run(tasks)
                if self.runtime.life.has_spawned:  # most nodes have not, and a cancellation is expensive
                    tasks.cancel_scope.cancel()
        finally:  # also when it is given up: then stop() runs up to its first await
            self.runtime.close()
            self.runtime.life.adopt_tasks(None)
            if self.state not in {NodeState.FAILED, NodeState.RESTARTING}:
                self.state = NodeState.STOPPING
            await self._stop()
            if self.runtime.life.on_end is not None:
                self.runtime.life.on_end()
            self.runtime.end()

    async def _start_and_run(self, tasks: anyio.abc.TaskGroup) -> None:
        self.runtime.life.adopt_tasks(tasks)
        if await self._start():
            self.runtime.life.on_task_end = self._check_ended
            self.runtime.open()
            self._running_since_s = self.runtime.surroundings.clock.seconds()
            self._meet(Condition.READY)
            if type(self.node).run is not Node.run:  # most nodes have none, and a task is expensive
                self.runtime.life.spawn(self._run(), "run")
        if self._pause_s is None:
            self.started.set()
        await self._over.wait()
        self.runtime.close()

    def ask_to_stop(self) -> None:
        """End the node's `start` or `run` and call its `stop`; it is not restarted."""
        self._stop_asked.set()
        self._end_life()
        self.runtime.close()  # at once: a blocking handler would be called again before any other callback

    def _end_life(self) -> None:
        self._over.set()
        if self._starting is not None:
            self._starting.cancel()

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
        self._end()

    async def _start(self) -> bool:
        self.state = NodeState.STARTING
        self._meet(Condition.STARTED)
        patience: anyio.CancelScope | None = None
        if type(self.node).start is not Node.start:
            self._starting = anyio.CancelScope()
            if self._over.is_set():
                self._starting.cancel()
            limit = self.runtime.surroundings.clock.wall_timeout(timeouts.current.start)
            with self._starting, limit as patience, self.runtime.life.starting.current():
                await self._guard(self.node.start, "start")
            self._starting = None
        if patience is not None and patience.cancelled_caught:
            late = StartTimeout(f"start() of {self.name} did not return within {timeouts.current.start:g} s")
            self.runtime.life.fail(f"{type(self.node).__name__}.start", late)
        if self._over.is_set():
            return False
        self.state = NodeState.RUNNING
        return True

    async def _stop(self) -> None:
        if type(self.node).stop is Node.stop:
            return
        if self._stop_asked.is_set():  # limited by the grace of the graph
            await self._guard(self.node.stop, "stop")
            return
        with self.runtime.surroundings.clock.wall_timeout(timeouts.current.start) as patience:
            await self._guard(self.node.stop, "stop")
        if patience.cancelled_caught:
            late = StopTimeout(f"stop() of {self.name} did not return within {timeouts.current.start:g} s")
            self.runtime.life.fail(f"{type(self.node).__name__}.stop", late)

    async def _run(self) -> None:
        self._returned = await self._guard(self.node.run, "run")

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

    # Conditions: those of this node, and those of others that it waits for.

    def condition_event(self, condition: Condition) -> asyncio.Event:
        """Return the event that is set once a condition is met or can no longer be met; `met` shows which."""
        if condition not in self._condition_events:
            self._condition_events[condition] = asyncio.Event()
            if condition is Condition.FIRST_MESSAGE:
                self._observe_first_message()
        return self._condition_events[condition]

    def _observe_first_message(self) -> None:
        self.runtime.endpoints.on_first = lambda: self._meet(Condition.FIRST_MESSAGE)
        # Of a running node, if a node that was added later waits for it.
        for publisher in self.runtime.endpoints.publishers:
            if publisher.published:
                self._meet(Condition.FIRST_MESSAGE)
            publisher.on_first = self.runtime.endpoints.on_first
            publisher.adjust()

    def _meet(self, condition: Condition) -> None:
        self.met.add(condition)
        if condition in self._condition_events:
            self._condition_events[condition].set()

    async def _wait_for_others(self) -> bool:
        """Wait for all that the node depends on; False if it is to stop, or a condition can no longer be met."""
        self.state = NodeState.WAITING
        self._starting = anyio.CancelScope()
        with self._starting:
            for other, condition in self.needs:
                event = other.condition_event(condition)
                with anyio.move_on_after(timeouts.current.waiting_warning):
                    await event.wait()
                if not event.is_set():
                    self.runtime.log.warning("waits for another node", node=other.name, condition=condition.value)
                    await event.wait()
                if condition not in other.met and not self._stop_asked.is_set():
                    lacking = (
                        "without a message" if condition is Condition.FIRST_MESSAGE else f"before it was {condition}"
                    )
                    in_vain = DependencyEnded(f"{other.name} has ended {lacking}")
                    self._failed(Failure(self.name, "depends_on", in_vain), mendable=False)
        self._starting = None
        return not self._over.is_set()

    # The end of a life, and the restart.

    def _check_ended(self) -> None:
        """If `run` has returned, end the run or this life as the policies say; called after each task of the node."""
        if not self._returned or self._over.is_set():
            return
        if self.supervision.restart.when is Restart.ALWAYS:
            self._settle(None)
        elif self.supervision.on_exit is OnExit.SHUTDOWN:
            self._overseer.on_exit(self)
        elif not self.runtime.is_busy:
            self._settle(None)

    def _failed(self, failure: Failure, *, mendable: bool = True) -> None:
        self.failure = failure
        self.failure_count += 1
        if not self._settled:
            self._settle(failure, mendable=mendable)
        elif (self._pause_s is None or self._stop_asked.is_set()) and not self._is_tolerated:
            self.state = NodeState.FAILED
            self._overseer.on_failure(failure)
        else:
            self.runtime.log.error(failure.summary)

    @property
    def _is_tolerated(self) -> bool:
        """Whether a failure on the way out is no reason to end the run: its policy would have restarted the node."""
        return self._by_hand and self.supervision.restart.when is not Restart.NEVER

    def _settle(self, failure: Failure | None, *, mendable: bool = True) -> None:
        """Decide if the node is restarted, now that it has failed or ended."""
        self._settled = True
        policy = self.supervision.restart
        wanted = policy.when is Restart.ALWAYS or (policy.when is Restart.ON_FAILURE and failure is not None)
        if wanted and mendable and not self._stop_asked.is_set():
            now_s = self.runtime.surroundings.clock.seconds()
            lived_s = 0.0 if self._running_since_s is None else now_s - self._running_since_s
            self._pause_s = self._backoff.next_s(lived_s=lived_s, now_s=now_s)
            if self._pause_s is not None:
                self.state = NodeState.RESTARTING
                self._overseer.on_pause(self, failure, self._pause_s)
            else:
                limit = RestartLimit(f"given up after {policy.most} restarts within {policy.window_s:g} s")
                self.runtime.log.error(str(limit))
                failure = failure or Failure(self.name, f"{type(self.node).__name__}.run", limit)
        if self._pause_s is None and failure is not None:
            if self._is_tolerated:
                self.runtime.log.error(failure.summary)
            else:
                self.state = NodeState.FAILED
                self._overseer.on_failure(failure)
        self._end_life()

    async def _pause(self, pause_s: float) -> bool:
        """Wait for the next life; return False if the node is to stop instead."""
        with suppress(TimeoutError):
            async with asyncio.timeout(pause_s):
                await self._stop_asked.wait()
        return not self._stop_asked.is_set()

    def _begin_anew(self) -> bool:
        """Build the node again from its current parameters; return False if that fails, which counts as a life."""
        predecessor = self.runtime
        self._begin_life()
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
