"""Run: puts a graph and its features together, in one way for every command, call and test.

The features attach in the order of `_STEPS`, and so begin in it; they end in the reverse order. `HABITS` says how the
kinds of a run differ. The features stand in layers above this one, so `_STEPS` names each by module and function. A run
imports no module of a feature that it does not have.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from enum import Enum
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from busflow import timeouts
from busflow.clock import Clock, SimClock
from busflow.errors import ExitCode, IncompleteRecording, NodeFailed, ProgramFailed, Stray
from busflow.launchfile.model.description import ClockMode, LaunchDescription
from busflow.launchfile.model.placement import Placement, ProcessLayout, placed
from busflow.launchfile.model.ros2 import Ros2Spec, Ros2Transport
from busflow.runner.graph import Graph, Wanted, What, described, is_simulated
from busflow.runner.loops.choice import chosen_loop
from busflow.runner.source import Source

if TYPE_CHECKING:
    from busflow.bus.dispatcher import Chooser
    from busflow.log import Sink
    from busflow.runner.loops.system import LoopFactory
    from busflow.runner.loops.virtual import VirtualLoop
    from busflow.runner.planning.preflight import Plan
    from busflow.runner.report import Report


class Kind(Enum):
    """Purpose of a run."""

    RUN = "run"
    """The whole program: `busflow run` and `busflow.run`."""
    LAUNCH = "launch"
    """A graph in a program with its own event loop: `busflow.launch`."""
    TEST = "test"
    """One seed of `busflow test`."""
    HARNESS = "harness"
    REPLAY = "replay"
    PLAN = "plan"
    """Nothing is run: `check`, `config` and `graph` look at the nodes."""


class Role(Enum):
    """Part of a process in its run."""

    ALONE = "alone"
    MAIN = "main"
    WORKER = "worker"


class Feature(Enum):
    """Feature of a run, in the order in which the features attach."""

    LINK = "link"
    TRACE = "trace"
    PROGRAMS = "programs"
    RECORDER = "recorder"


class Records(Enum):
    """Rule that says whether a run is recorded."""

    AS_STATED = "as stated"
    """As the launch file says, unless the options or keywords say otherwise."""
    SNAPSHOTS = "snapshots"
    """Only the snapshots of the launch file."""
    ASKED = "asked"
    """Only if the options or keywords ask for it."""
    NEVER = "never"


@dataclass(frozen=True, slots=True)
class Habits:
    """Differences between the kinds of a run."""

    records: Records
    has_link: bool = False
    """Whether other terminals can find it, if they may."""
    has_programs: bool = False
    owns_time: bool = False
    """Whether it makes the loop of simulated time itself; else its caller does."""
    embedded: bool = False
    """Whether a program around it publishes what no node does."""
    spreads: bool = False
    """Whether it may have other processes."""


HABITS: Mapping[Kind, Habits] = {
    Kind.RUN: Habits(Records.AS_STATED, has_link=True, has_programs=True, owns_time=True, spreads=True),
    Kind.LAUNCH: Habits(Records.AS_STATED, has_link=True, has_programs=True, embedded=True),
    Kind.TEST: Habits(Records.SNAPSHOTS, owns_time=True),
    Kind.HARNESS: Habits(Records.ASKED, embedded=True),
    Kind.REPLAY: Habits(Records.ASKED, embedded=True),
    Kind.PLAN: Habits(Records.NEVER, spreads=True),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """Values that the options of a command line give, or the keywords of a call."""

    args: Mapping[str, object] | None = None
    source: Source | None = None
    """The source of the launch file, for the run's other processes and for edits of the file."""
    outer: Mapping[str, str] = field(default_factory=dict[str, str])
    """The environment without the launch file's variables."""
    seed: int | None = None
    strict: bool = False
    clock: Clock | None = None
    simulated: bool = False
    """Whether it runs on simulated time, whatever the launch file says."""
    explore: Chooser | None = None
    log_level: str = "info"
    sinks: tuple[Sink, ...] = ()
    prints_failures: bool = False
    watchdog_s: float | None = None
    event_loop: str = "busflow"
    layout: ProcessLayout = ProcessLayout.FILE
    watch: bool = False
    """Whether it follows edits of the launch file."""
    inspect: bool | str = False
    """Whether other terminals can find it; a string is its name."""
    trace: Callable[[str], object] | None = None
    record: Wanted | None = None


class Others(Protocol):
    """The other processes of a run, as its main process sees them."""

    @property
    def failures(self) -> Sequence[str]:
        """Failures as texts for people."""
        ...

    def run_report(self) -> Report:
        """Return the report of the whole run."""
        ...

    def finish(self) -> object:
        """Finish the recording of an ended run."""
        ...


class Run(AbstractContextManager["Run"]):
    """A run that is put together by `build`; leaving its context frees a loop of simulated time that did not run."""

    def __init__(
        self,
        what: Sequence[What],
        kind: Kind,
        given: Given | None = None,
        *,
        role: Role | None = None,
        own: Mapping[Feature, Callable[[Run], object]] | None = None,
    ) -> None:
        """Read the launch files and place their nodes; nothing is built yet.

        Args:
            what: launch files, descriptions, node classes and instances.
            kind: the purpose of the run.
            given: options or keywords.
            role: the part of this process; by default ALONE, or MAIN if the launch file places nodes elsewhere.
            own: features that the caller attaches itself, in their place: a worker process's.

        Raises:
            LaunchError: a file cannot be read, with every problem, or there is no such event loop.
        """
        self.kind: Kind = kind
        self.given: Given = given or Given()
        self._own = own or {}
        habits = self._habits = HABITS[kind]
        args = self.given.args
        self._what = [described(each, args) if isinstance(each, str | Path) else each for each in what]
        self.descriptions: list[LaunchDescription] = [
            each for each in self._what if isinstance(each, LaunchDescription)
        ]
        self.simulated: bool = self.given.simulated or any(map(is_simulated, self.descriptions))
        self.follows: bool = any(each.clock.mode is ClockMode.FOLLOW for each in self.descriptions)
        # Simulated time needs one process: several have only the system's time in common.
        layout = self.given.layout if habits.spreads and not self.simulated else ProcessLayout.ONE
        self.placements: list[Placement] = [placed(each, layout) for each in self.descriptions]
        here = any(each.here is not None for each in self.descriptions)
        is_spread = habits.spreads and (here or any(each.others for each in self.placements))
        self.role: Role = role or (Role.MAIN if is_spread else Role.ALONE)
        self.others: Others | None = None
        """The run's other processes, if this is its main process."""
        self.owns_loop: bool = self.simulated and habits.owns_time
        """Whether it makes a loop of simulated time itself."""
        self._virtual_loop: VirtualLoop | None = None
        self.graph: Graph
        """The graph, once it is built."""
        self.loop_factory: LoopFactory = chosen_loop(self.given.event_loop, simulated=self.simulated)

    @property
    def ros2(self) -> Ros2Spec | None:
        """How nodes of ROS 2 take part; None if they do not."""
        return next((each.ros2 for each in self.descriptions if each.ros2 is not None), None)

    @property
    def is_shown(self) -> bool:
        """Whether other terminals can find it.

        Of simulated runs this is only one that follows `/clock`: it lasts as long as the publisher of `/clock`. Any
        other is over before they could look, and has to be the same every time.
        """
        lasts = self.follows or not self.owns_loop
        return self._habits.has_link and self.given.inspect is not False and lasts

    @property
    def is_recorded(self) -> bool:
        """Whether it is recorded, or keeps its last moments."""
        record = self.given.record
        stated = next((each.record for each in self.descriptions if each.record is not None), None)
        match self._habits.records:
            case Records.AS_STATED:
                return bool(record) or (record is None and stated is not None)
            case Records.SNAPSHOTS:
                return record is None and stated is not None and stated.snapshot is not None
            case Records.ASKED:
                return bool(record)
            case Records.NEVER:
                return False

    @property
    def has_programs(self) -> bool:
        """Whether this process starts programs: they live in real time alone."""
        stated = any(each.programs.get(each.main) for each in self.placements)
        real = self.follows or not self.simulated
        return self._habits.has_programs and stated and real

    def build(self) -> Graph:
        """Put the run together, once; return its graph, ready to start.

        Raises:
            LaunchError: the graph cannot run; without other processes its start says so.
            InvalidParameter, InvalidName: the recording cannot be made as requested.
        """
        given, clock = self.given, self.given.clock
        if self.owns_loop:
            clock = SimClock(loop=self.virtual_loop)
            self.loop_factory = lambda: self.virtual_loop
        graph = self.graph = Graph(
            self._what,
            seed=given.seed,
            strict=given.strict,
            clock=clock,
            log_level=given.log_level,
            sinks=given.sinks,
            explore=given.explore,
            embedded=self._habits.embedded,
            prints_failures=given.prints_failures,
            watchdog_s=given.watchdog_s,
        )
        if given.watch and given.source is not None:
            from busflow.runner.live_edit import FileWatch

            graph.attach(FileWatch(graph, self.descriptions[0], partial(given.source.read, given.outer)))
        for feature in Feature:
            if feature in self._own:
                self._own[feature](self)
                continue
            for step in _STEPS:
                if step.feature is feature and step.is_of(self):
                    step.attach(self)
        return graph

    @property
    def virtual_loop(self) -> VirtualLoop:
        """The loop of simulated time, which the run makes itself."""
        if self._virtual_loop is None:
            from busflow.runner.loops.virtual import VirtualLoop

            rate = next((each.clock.rate for each in self.descriptions if each.clock.rate is not None), None)
            limit_s = timeouts.current.run_thread
            self._virtual_loop = VirtualLoop(rate=rate, follows=self.follows, thread_s=limit_s, ends_handlers=False)
        return self._virtual_loop

    def plan(self) -> Plan:
        """Build and check the nodes, without starting them; the plan has every problem."""
        return self.build().plan()

    def go(
        self,
        show: Callable[[str], object],
        *,
        for_s: float | None = None,
        last_act: Callable[[ExitCode], object] = lambda _code: None,
    ) -> ExitCode:
        """Run the graph to its end as the whole program; return the exit code.

        Args:
            show: gets each failure of the run as a text.
            for_s: the time after which it ends.
            last_act: called on another thread before a run that does not end is ended by force.

        Raises:
            LaunchError: the graph cannot run.
        """
        from busflow.runner.run import run_graph

        graph = self.graph
        try:
            run_graph(graph, for_s=for_s, loop_factory=self.loop_factory, last_act=last_act)
        except NodeFailed:
            for failure in graph.failures:
                show(failure.render())
        except (IncompleteRecording, ProgramFailed, Stray) as error:
            show(str(error))
        finally:
            if self.others is not None:
                self.others.finish()
                for text in self.others.failures:
                    show(text)
        return graph.exit_code

    def report(self) -> Report:
        """Return the report of the whole run."""
        return self.graph.report() if self.others is None else self.others.run_report()

    def __exit__(self, *_: object) -> None:
        if self._virtual_loop is not None:
            self._virtual_loop.close()


@dataclass(frozen=True, slots=True)
class _Step:
    """A function that attaches a feature, or a part of one, to the runs that have it."""

    feature: Feature
    role: Role | None
    """The process that has it; None for ALONE and MAIN."""
    name: str
    """Module and function."""
    wanted: Callable[[Run], bool]

    def is_of(self, run: Run) -> bool:
        return run.role is (self.role or run.role) and run.role is not Role.WORKER and self.wanted(run)

    def attach(self, run: Run) -> None:
        module, _, name = self.name.partition(":")
        getattr(import_module(module), name)(run)


def _speaks_dds(run: Run) -> bool:
    return run.is_shown and run.ros2 is not None and run.ros2.transport is Ros2Transport.DDS


_STEPS = (
    _Step(Feature.LINK, Role.ALONE, "busflow.wire.mirror.membership:show", lambda run: run.is_shown and not run.ros2),
    _Step(Feature.LINK, Role.ALONE, "busflow.ros2:show", lambda run: run.is_shown and run.ros2 is not None),
    _Step(Feature.LINK, Role.MAIN, "busflow.processes.process_group:start_others", lambda run: run.is_shown),
    _Step(Feature.LINK, None, "busflow.dds:attach_bridge", _speaks_dds),
    _Step(Feature.LINK, Role.ALONE, "busflow.runner.simulation:follow", lambda run: run.follows and run.owns_loop),
    _Step(Feature.TRACE, None, "busflow.testing.trace:trace", lambda run: run.given.trace is not None),
    _Step(Feature.PROGRAMS, None, "busflow.programs:attach_programs", lambda run: run.has_programs),
    _Step(Feature.RECORDER, Role.ALONE, "busflow.recording.recorder.recorder:record", lambda run: run.is_recorded),
    _Step(Feature.RECORDER, Role.MAIN, "busflow.processes.process_group:record_all", lambda run: run.is_recorded),
)
"""Everything that attaches, in order; a worker process attaches its own features."""
