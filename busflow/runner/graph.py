"""Graph: starts the nodes of a launch description together, watches over them, and stops them in order."""

from __future__ import annotations

import asyncio
from collections.abc import Collection, Mapping, Sequence
from contextlib import AsyncExitStack, ExitStack
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar, overload

from busflow import timeouts
from busflow.bus.bus import Bus
from busflow.bus.dispatcher import Chooser
from busflow.bus.failure import Failure
from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS
from busflow.bus.services.call import Pair, Req, Res
from busflow.bus.services.client import TIMEOUT_S
from busflow.bus.subscription import Subscription
from busflow.clock import Clock, SystemClock
from busflow.errors import (
    BusflowError,
    ExitCode,
    InvalidParameter,
    LaunchError,
    NodeFailed,
    NoSuchTarget,
    NotRunning,
    StopTimeout,
)
from busflow.interfaces.message import Message
from busflow.launchfile.model.description import LaunchDescription
from busflow.launchfile.model.problems import log_problems
from busflow.log import Log, Sink
from busflow.node.context import Surroundings
from busflow.node.node import Node, runtime_of
from busflow.runner.extension import Extension
from busflow.runner.host import Outside
from busflow.runner.orphan_tasks import OrphanTasks
from busflow.runner.planning.planned_node import PlannedNode
from busflow.runner.planning.preflight import Plan, Preflight
from busflow.runner.report import Report, SnapshotReport, used_topics
from busflow.runner.rosout import Rosout
from busflow.runner.sources import What, described, is_simulated, made_by_hand, set_clock
from busflow.runner.stuck_handlers import stuck_handlers_named
from busflow.runner.supervisor import Overseer, Supervisor, outlast
from busflow.runner.supervisors import Lives, node_among, stop_in_order, supervisors_of
from busflow.runner.watchdog import Watchdog

N = TypeVar("N", bound=Node)
M = TypeVar("M", bound=Message)


class Graph:
    """The nodes of one run, on one bus.

    Use it as `async with launch(...) as graph`, or call `start` and `stop` yourself (in a notebook). A node that
    fails ends the graph, and the `async with` block, with `NodeFailed`.
    """

    exit_code: ExitCode = ExitCode.OK
    given_up: BusflowError | None = None
    """Reason for the end, where that is no node's fault."""
    descriptions: list[LaunchDescription]
    seed: int
    grace_s: float
    watchdog: Watchdog | None
    _host_called = False
    _host_cancelling = 0
    _duration_s: float | None = None
    _asked_early: ExitCode | None = None

    def __init__(
        self,
        what: Sequence[What],
        *,
        args: Mapping[str, object] | None = None,
        seed: int | None = None,
        strict: bool = False,
        clock: Clock | None = None,
        log_level: str = "info",
        sinks: tuple[Sink, ...] = (),
        explore: Chooser | None = None,
        embedded: bool = False,
        prints_failures: bool = False,
        watchdog_s: float | None = None,
    ) -> None:
        self.descriptions = [described(each, args) for each in what if isinstance(each, str | Path | LaunchDescription)]
        self.name: str = next((each.name for each in self.descriptions), "graph")
        self.seed = seed if seed is not None else next((s.seed for s in self.descriptions if s.seed is not None), 0)
        graces_s = [s.shutdown_grace_s for s in self.descriptions if s.shutdown_grace_s is not None]
        self.grace_s: float = graces_s[0] if graces_s else timeouts.current.grace
        self.clock: Clock = clock or SystemClock()
        set_clock(self.clock, self.descriptions)
        self.log: Log = Log(self.clock, level=log_level, sinks=sinks)
        self.bus: Bus = Bus(self.clock, explore=explore)
        """The topics and services of this process."""
        self.watchdog = Watchdog(watchdog_s, self.log) if watchdog_s and self.clock.kind == "system" else None
        self.rosout: Rosout = Rosout(self.bus, self.log, to_ros2=any(each.ros2 for each in self.descriptions))
        self.supervisors: list[Supervisor] = []
        self.extensions: list[Extension] = []
        """Extensions of the run; used by busflow itself."""
        self._begun = ExitStack()
        """Stack that ends the extensions that have begun, the last one first."""
        self.failures: list[Failure] = []
        self.strict = strict
        self.embedded = embedded
        """Whether a program is around it, which may publish what no node does; used by busflow itself."""
        self.prints_failures = prints_failures
        """Whether the program prints the failures at the end, so that the console need not; used by busflow itself."""
        self._nodes = [made_by_hand(each) for each in what if not isinstance(each, str | Path | LaunchDescription)]
        self._plan: Plan | None = None
        self._outside = Outside(self.bus, Surroundings(self.clock, self.log, self.seed))
        self._main: asyncio.Task[None] | None = None
        self._host: asyncio.Task[Any] | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self.ending: asyncio.Event = asyncio.Event()
        """Set once the graph is to end, for whatever reason; used by busflow itself."""
        self._ready = asyncio.Event()
        self.held: frozenset[str] = frozenset()
        """Nodes that were stopped by hand in an earlier life, and are not started; used by busflow itself."""
        self._lives: Lives | None = None

    # Life.

    def attach(self, extension: Extension) -> None:
        """Add an extension to the run; it begins after those that were attached before it, and ends first.

        Raises:
            NotRunning: the graph was started already.
        """
        if self._main is not None:
            raise NotRunning(f"the graph {self.name} was started before; attach an extension to one that is not")
        self.extensions.append(extension)

    @property
    def end_s(self) -> float:
        """Wall time that the extensions may take to end, beyond the grace of the nodes; used by busflow itself."""
        return sum(each.end_s for each in self.extensions)

    def plan(self) -> Plan:
        """Build and check the nodes, once, without starting them; used by busflow itself."""
        if self._plan is None:
            preflight = Preflight(self.clock, self.log, seed=self.seed, strict=self.strict)
            self._plan = preflight.plan(self.descriptions, self._nodes)
        return self._plan

    async def start(self) -> Self:
        """Check the graph and start its nodes; returns the graph when every `start` has returned.

        Raises:
            LaunchError: the graph cannot run, with every problem.
            NodeFailed: a node failed while starting; everything is stopped again.
        """
        if self._main is not None:
            raise NotRunning(f"the graph {self.name} was started before; launch another one")
        if self.clock.kind != "sim" and any(is_simulated(each) for each in self.descriptions):
            raise NotRunning(
                f"{self.name} asks for simulated time (clock: mode: sim), and this event loop has real time; "
                "use busflow run, busflow.run(...), or busflow.testing.harness(...) in a test"
            )
        plan = self.plan()
        if plan.errors:
            raise LaunchError(plan.errors)
        log_problems(plan.problems, self.log.bind("busflow"), embedded=self.embedded)
        self.supervisors += supervisors_of(plan.nodes, self._overseer(), self.extensions)
        self.bus.open()  # this thread is the bus's from now on, whichever made the graph
        loop = asyncio.get_running_loop()
        with ExitStack() as begun:
            tasks = OrphanTasks.of(loop) or OrphanTasks(loop, guest=True)
            tasks.on_orphan.append(self.give_up)
            begun.callback(tasks.leave, self.give_up)
            for extension in self.extensions:
                extension.begin()
                begun.callback(extension.end)
            for supervisor in self.supervisors:
                supervisor.runtime.connect(self.bus)
                if supervisor.name in self.held:
                    supervisor.hold()
            self._begun = begun.pop_all()
        self._loop = loop
        if self._asked_early is not None:
            self.ask_to_stop(self._asked_early)
        self._main = self._loop.create_task(self._live(), name=f"busflow.{self.name}")
        try:
            await self._ready.wait()
        except asyncio.CancelledError:  # a cancelled wait must not leave the nodes running
            await self.stop()
            raise
        if self.failures or self._duration_s is not None:
            await self.stop()
            await self.wait()
        return self

    async def dismiss(self, names: Collection[str]) -> None:
        """Stop some of the nodes for good, while the others go on; used by busflow itself."""
        leaving = [each for each in self.supervisors if each.name in names]
        self.supervisors = [each for each in self.supervisors if each not in leaving]
        await stop_in_order(leaving, self.clock, self.grace_s)
        for supervisor in leaving:
            for extension in self.extensions:
                extension.node_dismissed(supervisor)

    def admit(self, nodes: Sequence[PlannedNode]) -> None:
        """Start nodes beside those that run; used by busflow itself."""
        if self._lives is None or self.ending.is_set():
            return
        supervisors = supervisors_of(nodes, self._overseer(), self.extensions, self.supervisors)
        self.supervisors += supervisors
        for supervisor in supervisors:
            supervisor.runtime.connect(self.bus)
        self._lives.begin(supervisors)

    async def stop_by_hand(self, supervisors: Sequence[Supervisor]) -> None:
        """Stop some of the nodes until they are started by hand, while the others go on; used by busflow itself."""
        for supervisor in supervisors:
            supervisor.stop_by_hand()
        await stop_in_order(supervisors, self.clock, timeouts.current.start)

    async def start_by_hand(self, supervisor: Supervisor) -> None:
        """Start a node that has ended, while the others go on; used by busflow itself.

        Raises:
            NotRunning: the graph ends, or code of the node still runs.
        """
        has_left = self._lives is None or await self._lives.has_left(supervisor)
        if self._lives is None or self.ending.is_set() or not has_left:
            why = "the run ends" if has_left else "its code still runs: no cancellation has ended it"
            raise NotRunning(f"{supervisor.name} cannot be started: {why}")
        supervisor.renew()
        self._lives.begin([supervisor])

    def _overseer(self) -> Overseer:
        return Overseer(
            self._on_failure, self._on_pause, self._on_restart, lambda _supervisor: self.ask_to_stop(), self._on_end
        )

    async def wait(self) -> None:
        """Wait until the graph has ended.

        Raises:
            NodeFailed: a node failed; the first failure's exception is the cause.
        """
        if self._main is None:
            raise NotRunning(f"the graph {self.name} is not started; await start(), or use async with")
        await asyncio.shield(self._main)
        self.check()

    def check(self) -> None:
        """Raise what has failed so far, as `wait` does."""
        if self.failures:
            raise NodeFailed(self.failures[0].render()) from self.failures[0].error
        if self.given_up is not None:
            raise self.given_up

    async def stop(self) -> None:
        """Stop the nodes in reverse order; returns when all have ended, and not before that when it is cancelled."""
        if self._main is not None:
            self.ask_to_stop()
            await outlast(self._main)

    def ask_to_stop(self, code: ExitCode = ExitCode.OK) -> None:
        """Ask the graph to end, without waiting; `code` says why unless a node has failed."""
        if not self.ending.is_set():
            self.conclude(code)
            self.ending.set()
            for supervisor in self.supervisors:  # while one blocks the loop, the others have no time to stop
                if self.watchdog and supervisor.name in self.watchdog.blocking:
                    supervisor.ask_to_stop()

    def conclude(self, code: ExitCode) -> None:
        """Set the exit code, unless one is already set; used by busflow itself."""
        self.exit_code = self.exit_code or code

    def end_if_finished(self) -> None:
        """End the graph if all its nodes have ended, and no extension waits; used by busflow itself."""
        if self.has_finished and all(each.is_finished() for each in self.extensions):
            self.ask_to_stop()

    def give_up(self, error: BusflowError) -> None:
        """End the graph, and its waiters' wait, for a reason outside of its nodes; used by busflow itself."""
        if self.given_up is None:
            self.given_up = error
            self.ask_to_stop()
            self.conclude(error.exit_code)  # also where the end has begun
            self._call_host()

    def _call_host(self) -> None:
        """End the block that runs the graph, once."""
        if self._host is not None and not self._host_called:
            self._host_called = True
            self._host.cancel()

    async def __aenter__(self) -> Self:
        await self.start()
        self._host = asyncio.current_task()
        self._host_cancelling = self._host.cancelling() if self._host else 0
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        host, self._host = self._host, None
        # A failure cancelled the block, which is undone here; the task may have been cancelled by another caller too.
        taken_back = host is not None and self._host_called and host.uncancel() <= self._host_cancelling
        await self.stop()
        if (self.failures or self.given_up) and (error is None or (kind is asyncio.CancelledError and taken_back)):
            await self.wait()

    async def _live(self) -> None:
        try:
            async with AsyncExitStack() as around:
                around.enter_context(stuck_handlers_named())
                for extension in self.extensions:
                    await around.enter_async_context(extension.surround())
                await self._live_through()
        finally:
            self._duration_s = self._duration_s or 0.0
            if self.watchdog is not None:
                self.watchdog.close()
            self._outside.close()
            try:
                self._begun.close()
            finally:
                self.bus.close()
                self._ready.set()

    async def _live_through(self) -> None:
        self.clock.begin()
        try:
            async with asyncio.TaskGroup() as tasks:
                lives = self._lives = Lives(self.ending.set)
                lives.begin([each for each in self.supervisors if not each.is_held])
                tasks.create_task(self._await_starts(), name=f"busflow.{self.name}.starts")
                try:
                    await self.ending.wait()
                    await stop_in_order(self.supervisors, self.clock, self.grace_s)
                except asyncio.CancelledError:
                    lives.cancel()
                    raise
                finally:
                    await lives.wait()
        finally:
            self._duration_s = self.clock.seconds()

    async def _await_starts(self) -> None:
        for supervisor in self.supervisors:
            await supervisor.started.wait()
        self._ready.set()
        for extension in self.extensions:
            extension.nodes_started()
        if self.watchdog is not None and not self.ending.is_set():  # opening a device may block, once
            self.watchdog.begin()

    def _on_failure(self, failure: Failure) -> None:
        self.failures.append(failure)
        if self.exit_code is ExitCode.OK or not isinstance(failure.error, StopTimeout):
            self.exit_code = ExitCode.FAILED  # a run that Ctrl-C ends stays one, also where a node will not stop
        self.ending.set()
        self._call_host()
        self.log.bind(failure.node, to_all=not self.prints_failures).error(failure.summary)
        self._notify_failed(failure)

    def _on_pause(self, supervisor: Supervisor, failure: Failure | None, pause_s: float) -> None:
        log = self.log.bind(supervisor.name)
        if failure is not None:
            log.error(failure.summary)
            self._notify_failed(failure)
        log.warning("restarts", after_s=pause_s, restart=supervisor.restarts)

    def _notify_failed(self, failure: Failure) -> None:
        for extension in self.extensions:
            extension.node_failed(failure)

    def _on_restart(self, supervisor: Supervisor) -> None:
        for extension in self.extensions:
            extension.node_rebuilt(supervisor)

    def _on_end(self, supervisor: Supervisor) -> None:
        if supervisor in self.supervisors:
            self.end_if_finished()

    @property
    def has_finished(self) -> bool:
        """Whether all its nodes have ended; one that was stopped by hand may be started again, until the end begins."""
        return all(each.ended.is_set() and (self.ending.is_set() or not each.is_held) for each in self.supervisors)

    # What the program around the graph does.

    def publish(self, topic: str, message: Message) -> None:
        """Publish a message from outside, from any thread, as a publisher with the topic's default QoS.

        Raises:
            NoSuchTarget: the topic is unknown, and its name like that of another; `advertise` creates it all the same.
        """
        self.outside().publish(topic, message)

    def advertise(self, message_type: type[M], topic: str, *, qos: QoS | None = None) -> Publisher[M]:
        """Create a publisher outside of nodes, for what `publish` cannot do: `send`, or a QoS of one's own."""
        return self.outside().advertise(message_type, topic, qos=qos)

    def subscribe(self, message_type: type[M], topic: str, *, qos: QoS | None = None) -> Subscription[M]:
        """Subscribe from outside of nodes: `async for message in graph.subscribe(Float64, "balance_state")`.

        Raises:
            NoSuchTarget: as `publish`.
        """
        return self.outside().subscribe(message_type, topic, qos=qos)

    async def call(
        self,
        service_type: type[Pair[Req, Res]],
        service: str,
        request: Req | None = None,
        *,
        timeout: float | None = TIMEOUT_S,  # noqa: ASYNC109  # as Client.call
    ) -> Res:
        """Call a service from outside: `await graph.call(Trigger, "sensor_publisher/reset")`.

        Raises:
            ServiceError: there is no answer, as `Client.call` says.
        """
        return await self.outside().client(service_type, service).call(request, timeout=timeout)

    def set_parameters(
        self, which: Node | type[Node] | str, changes: Mapping[str, object] | None = None, /, **values: object
    ) -> tuple[str, ...]:
        """Set parameters of a node, all or none, from any thread; returns the names of those that changed.

        Raises:
            InvalidParameter: with every reason why none was set.
        """
        if self._duration_s is not None:
            raise NotRunning(f"the graph {self.name} has ended; launch another one")
        node = which if isinstance(which, Node) else node_among(self.supervisors, which)
        result = self.bus.call(lambda: runtime_of(node).parameters.set({**(changes or {}), **values}))
        if result.faults:
            raise InvalidParameter(result.faults)
        return tuple(change.name for change in result.changed)

    @overload
    def node(self, which: type[N]) -> N: ...
    @overload
    def node(self, which: str) -> Node: ...
    def node(self, which: type[N] | str) -> N | Node:
        """Return the node of a class, or of a name; relative names are below `/`."""
        return node_among(self.supervisors, which)

    def report(self) -> Report:
        """Return the report of the run: so far, or final once it has ended."""
        report = Report(
            name=self.name,
            seed=self.seed,
            clock=self.clock.kind,
            duration_s=self.clock.seconds() if self._duration_s is None else self._duration_s,
            exit_code=self.exit_code,
            nodes=tuple(each.statistics() for each in self.supervisors),
            topics=used_topics(counts := self.bus.statistics()),
            services=counts.services,
            timers=tuple(timer.statistics() for each in self.supervisors for timer in each.runtime.endpoints.timers),
            inbox_dropped=counts.inbox.dropped,
            inbox_refused=counts.inbox.refused,
            blocks=self.watchdog.statistics() if self.watchdog else (),
            log_lines_lost=self.log.lost,
        )
        for extension in self.extensions:
            report = extension.report(report)
        return report

    def snapshot(self, reason: str = "asked for") -> SnapshotReport:
        """Write the last moments of the run as a bag, with what follows them for the time that is set.

        It returns at once, with the name of the file; `report().snapshots` says when it is written.

        Raises:
            NoSuchTarget: the run keeps no last moments.
            RecordingRefused: the file cannot be made.
        """
        for extension in self.extensions:
            found = self.bus.call(partial(extension.snapshot, reason))
            if found is not None:
                return found
        raise NoSuchTarget(f"{self.name} keeps no last moments: write record: {{snapshot: 60s}} in its launch file")

    def outside(self) -> Outside:
        """Return what the program around the graph has on its bus."""
        if self._main is None:
            raise NotRunning(f"the graph {self.name} is not started; await start(), or use async with")
        if self._duration_s is not None:
            raise NotRunning(f"the graph {self.name} has ended; launch another one")
        return self._outside

    def ask_to_stop_from_thread(self, code: ExitCode) -> None:
        """Ask the graph to end, from another thread or before it is started; used by busflow itself."""
        self._asked_early = code
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self.ask_to_stop, code)
