"""Graph: starts the nodes of a launch description together, watches over them, and stops them in order."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from functools import partial
from inspect import signature
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeAlias, TypeVar, overload

from busflow import timeouts
from busflow.bus.bus import Bus
from busflow.bus.dispatcher import Chooser
from busflow.bus.failure import Failure
from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS
from busflow.bus.services.call import Pair, Req, Res
from busflow.bus.services.client import TIMEOUT_S
from busflow.bus.subscription import Subscription
from busflow.clock import Clock, SimClock, SystemClock, Time
from busflow.errors import (
    BusflowError,
    ExitCode,
    InvalidDeclaration,
    InvalidParameter,
    LaunchError,
    NoSuchTarget,
    NotRunning,
)
from busflow.interfaces.message import Message
from busflow.launchfile.model.description import ClockMode, LaunchDescription, RecordSpec
from busflow.launchfile.model.problems import log_problems
from busflow.launchfile.model.supervision import Supervision
from busflow.log import Log, Sink
from busflow.node.context import Surroundings
from busflow.node.node import NO_INIT, Node, runtime_of
from busflow.node.supervision import Supervised
from busflow.runner.course import Course, node_among
from busflow.runner.extension import Extension
from busflow.runner.host import Outside
from busflow.runner.planning.preflight import Plan, Preflight
from busflow.runner.report import Report, SnapshotReport, used_topics
from busflow.runner.rosout import Rosout
from busflow.runner.supervisor import Supervisor
from busflow.runner.watchdog import Watchdog

Wanted: TypeAlias = str | Path | Mapping[str, object] | RecordSpec | bool
"""A file to record to; the keys of a launch file's `record:`; True for what the launch file says, False for nothing."""
What: TypeAlias = str | Path | LaunchDescription | Node | type[Node] | Supervised
N = TypeVar("N", bound=Node)
M = TypeVar("M", bound=Message)


class Graph:
    """The nodes of one run, on one bus.

    Use it as `async with launch(...) as graph`, or call `start` and `stop` yourself (in a notebook). A node that
    fails ends the graph, and the `async with` block, with `NodeFailed`.
    """

    descriptions: list[LaunchDescription]
    seed: int
    watchdog: Watchdog | None
    _host_called = False
    _host_cancelling = 0

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
        self.clock: Clock = clock or SystemClock()
        set_clock(self.clock, self.descriptions)
        self.log: Log = Log(self.clock, level=log_level, sinks=sinks)
        self.bus: Bus = Bus(self.clock, explore=explore)
        """The topics and services of this process."""
        self.watchdog = Watchdog(watchdog_s, self.log) if watchdog_s and self.clock.kind == "system" else None
        self.rosout: Rosout = Rosout(self.bus, self.log, to_ros2=any(each.ros2 for each in self.descriptions))
        graces_s = [s.shutdown_grace_s for s in self.descriptions if s.shutdown_grace_s is not None]
        self.course: Course = Course(
            self.name,
            self.bus,
            self.log,
            self.watchdog,
            grace_s=graces_s[0] if graces_s else timeouts.current.grace,
            prints_failures=prints_failures,
        )
        """Course of the graph's nodes and extensions; used by busflow itself."""
        self.course.on_failed = self._call_host
        self.strict = strict
        self._embedded = embedded
        """Whether a program is around it, which may publish what no node does."""
        self._nodes = [made_by_hand(each) for each in what if not isinstance(each, str | Path | LaunchDescription)]
        self._plan: Plan | None = None
        self._outside = Outside(self.bus, Surroundings(self.clock, self.log, self.seed))
        self._host: asyncio.Task[Any] | None = None

    @property
    def exit_code(self) -> ExitCode:
        """The exit code of the run so far."""
        return self.course.exit_code

    @property
    def failures(self) -> list[Failure]:
        """The failures of nodes that were not restarted."""
        return self.course.failures

    @property
    def given_up(self) -> BusflowError | None:
        """Reason for the end, where that is no node's fault."""
        return self.course.given_up

    @property
    def grace_s(self) -> float:
        """Seconds that the nodes have to stop."""
        return self.course.grace_s

    @property
    def supervisors(self) -> list[Supervisor]:
        """The nodes with their states, in order."""
        return self.course.supervisors

    # Life.

    def attach(self, extension: Extension) -> None:
        """Add an extension to the run; it begins after those that were attached before it, and ends first.

        Raises:
            NotRunning: the graph was started already.
        """
        if self.course.has_begun:
            raise NotRunning(f"the graph {self.name} was started before; attach an extension to one that is not")
        self.course.extensions.append(extension)

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
        if self.course.has_begun:
            raise NotRunning(f"the graph {self.name} was started before; launch another one")
        if self.clock.kind != "sim" and any(is_simulated(each) for each in self.descriptions):
            raise NotRunning(
                f"{self.name} asks for simulated time (clock: mode: sim), and this event loop has real time; "
                "use busflow run, busflow.run(...), or busflow.testing.harness(...) in a test"
            )
        plan = self.plan()
        if plan.errors:
            raise LaunchError(plan.errors)
        log_problems(plan.problems, self.log.bind("busflow"), embedded=self._embedded)
        await self.course.begin(plan.nodes, at_end=self._outside.close)
        return self

    async def wait(self) -> None:
        """Wait until the graph has ended.

        Raises:
            NodeFailed: a node failed; the first failure's exception is the cause.
        """
        if not self.course.has_begun:
            raise NotRunning(f"the graph {self.name} is not started; await start(), or use async with")
        await self.course.wait()

    def check(self) -> None:
        """Raise what has failed so far, as `wait` does."""
        self.course.check()

    async def stop(self) -> None:
        """Stop the nodes in reverse order; returns when all have ended, and not before that when it is cancelled."""
        await self.course.stop()

    def ask_to_stop(self, code: ExitCode = ExitCode.OK) -> None:
        """Ask the graph to end, without waiting; `code` says why unless a node has failed."""
        self.course.ask_to_stop(code)

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
        if self.course.duration_s is not None:
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
        return Report(
            name=self.name,
            seed=self.seed,
            clock=self.clock.kind,
            duration_s=self.clock.seconds() if self.course.duration_s is None else self.course.duration_s,
            exit_code=self.exit_code,
            nodes=tuple(each.statistics() for each in self.supervisors),
            topics=used_topics(counts := self.bus.statistics()),
            services=counts.services,
            timers=tuple(timer.statistics() for each in self.supervisors for timer in each.runtime.endpoints.timers),
            inbox_dropped=counts.inbox.dropped,
            inbox_refused=counts.inbox.refused,
            blocks=self.watchdog.statistics() if self.watchdog else (),
            log_lines_lost=self.log.lost,
            sections=dict(item for each in self.course.extensions for item in each.sections().items()),
        )

    def snapshot(self, reason: str = "asked for") -> SnapshotReport:
        """Write the last moments of the run as a bag, with what follows them for the time that is set.

        It returns at once, with the name of the file; `report().snapshots` says when it is written.

        Raises:
            NoSuchTarget: the run keeps no last moments.
            RecordingRefused: the file cannot be made.
        """
        for extension in self.course.extensions:
            found = self.bus.call(partial(extension.snapshot, reason))
            if found is not None:
                return found
        raise NoSuchTarget(f"{self.name} keeps no last moments: write record: {{snapshot: 60s}} in its launch file")

    def outside(self) -> Outside:
        """Return what the program around the graph has on its bus."""
        if not self.course.has_begun:
            raise NotRunning(f"the graph {self.name} is not started; await start(), or use async with")
        if self.course.duration_s is not None:
            raise NotRunning(f"the graph {self.name} has ended; launch another one")
        return self._outside


def described(what: str | Path | LaunchDescription, args: Mapping[str, object] | None) -> LaunchDescription:
    """Return the description of a launch file, or the one that is given.

    Raises:
        LaunchError: the file cannot be read, with every problem.
    """
    if isinstance(what, LaunchDescription):
        return what
    from busflow.launchfile.load.load import load
    from busflow.node.plugins import names

    return load(Path(what), args=args or {}, plugins=names)


def made_by_hand(what: Any) -> tuple[Node, Supervision]:
    """Return the node that is given, or one of the class that is, and what is asked for it.

    Raises:
        InvalidDeclaration: it is neither, or the class needs arguments.
    """
    node, supervision = (what.node, what.supervision) if isinstance(what, Supervised) else (what, Supervision())
    if isinstance(node, Node):
        return node, supervision
    if isinstance(node, type) and issubclass(node, Node):
        try:
            signature(node).bind()
        except TypeError as error:
            raise InvalidDeclaration(f"{node.__name__} cannot be built: {error}; {NO_INIT}") from None
        return node(), supervision
    raise InvalidDeclaration(f"a graph is made of launch files, Node classes and instances, not {what!r}")


def set_clock(clock: Clock, descriptions: Sequence[LaunchDescription]) -> None:
    """Set the start of a simulated clock as a launch file says."""
    start_s = next((each.clock.start_s for each in descriptions if each.clock.start_s is not None), None)
    if start_s is not None and isinstance(clock, SimClock):
        clock.start_at(Time(seconds=start_s))


def is_simulated(description: LaunchDescription) -> bool:
    """Return whether a launch file asks for simulated time."""
    return description.clock.mode is not ClockMode.SYSTEM
