"""Course: the nodes and extensions of a graph, from the first that begins to the last that ends."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection, Sequence
from contextlib import AsyncExitStack, ExitStack, suppress
from functools import partial
from typing import TYPE_CHECKING

from busflow import timeouts
from busflow.bus.names import absolute_name
from busflow.clock import Clock, perf_counter
from busflow.errors import BusflowError, ExitCode, NodeFailed, NotRunning, StopTimeout
from busflow.node.node import Node
from busflow.node.supervision import stop_order
from busflow.runner.orphan_tasks import OrphanTasks
from busflow.runner.stuck_handlers import stuck_handlers_named
from busflow.runner.supervisor import Overseer, Supervisor, outlast
from busflow.text import did_you_mean

if TYPE_CHECKING:
    from busflow.bus.bus import Bus
    from busflow.bus.failure import Failure
    from busflow.log import Log
    from busflow.runner.extension import Extension
    from busflow.runner.planning.planned_node import PlannedNode
    from busflow.runner.restarting import Restarting
    from busflow.runner.watchdog import Watchdog


def supervisors_of(
    nodes: Sequence[PlannedNode],
    overseer: Overseer,
    extensions: Sequence[Extension] = (),
    beside: Sequence[Supervisor] = (),
) -> list[Supervisor]:
    """Make a supervisor for each node. It may wait for the others, those `beside`, and what the extensions have.

    A name that is found nowhere belongs to a program that does not run, e.g. on simulated time: no node waits for it.
    """
    supervisors = [Supervisor(each, overseer) for each in nodes]
    others = (each for extension in extensions for each in extension.prerequisites())
    by_name: dict[str, Restarting] = {each.name: each for each in (*others, *beside, *supervisors)}
    for supervisor in supervisors:
        supervisor.depend(by_name, supervisor.supervision.depends_on)
    return supervisors


def node_among(supervisors: Sequence[Supervisor], which: type[Node] | str) -> Node:
    """Return the node of a class, or of a name; relative names are below `/`.

    Raises:
        NotRunning: the graph has no such node, or several nodes of the class.
    """
    if isinstance(which, str):
        full = absolute_name(which)
        found = [each.node for each in supervisors if each.name == full]
    else:
        found = [each.node for each in supervisors if isinstance(each.node, which)]
    shown = which if isinstance(which, str) else which.__name__
    names = [each.name for each in supervisors]
    if not found:
        raise NotRunning(f"there is no node {shown} in this graph; {did_you_mean(shown, names, none='it has none')}")
    if len(found) > 1:
        raise NotRunning(f"{len(found)} nodes are a {shown}; ask for one by name: {', '.join(names)}")
    return found[0]


async def stop_in_order(supervisors: Sequence[Supervisor], clock: Clock, grace_s: float) -> None:
    """Stop nodes, the last one first; none is given up before the grace of all has passed."""
    end = perf_counter() + grace_s
    by_name = {each.name: each for each in supervisors}
    order = stop_order(list(by_name), {each.name: each.supervision.depends_on for each in supervisors})
    for left, supervisor in zip(range(len(order), 0, -1), map(by_name.__getitem__, order), strict=True):
        ends_at_once = supervisor.ends_at_once
        supervisor.ask_to_stop()
        if ends_at_once:  # waiting takes turns of the loop, which are long where many nodes run
            continue
        # A slow node costs the others the order of stopping, not their own stop().
        with clock.wall_timeout((end - perf_counter()) / left):
            await supervisor.ended.wait()
    for supervisor in [each for each in supervisors if not each.ended.is_set()]:
        with clock.wall_timeout(end - perf_counter()):
            await supervisor.ended.wait()
    late = [each for each in supervisors if not each.ended.is_set()]
    for supervisor in late:
        supervisor.give_up(grace_s)
    for resort in (Supervisor.close_tasks, Supervisor.leave):
        with clock.wall_timeout(timeouts.current.last_resort):
            for supervisor in late:
                await supervisor.ended.wait()
        for supervisor in [each for each in late if not each.ended.is_set()]:
            resort(supervisor)


class Lives:
    """One task for each node that runs; no task group, which could leave none behind."""

    def __init__(self, on_fault: Callable[[], None]) -> None:
        """Create it without tasks; `on_fault` is called when one ends in an error, which is a mistake in busflow."""
        self._on_fault = on_fault
        self._tasks: dict[Supervisor, asyncio.Task[None]] = {}

    def begin(self, supervisors: Sequence[Supervisor]) -> None:
        """Start to run these nodes."""
        for supervisor in supervisors:
            self._tasks[supervisor] = asyncio.get_running_loop().create_task(supervisor.live(), name=supervisor.name)
            self._tasks[supervisor].add_done_callback(partial(self._on_end, supervisor))

    async def has_left(self, supervisor: Supervisor) -> bool:
        """Return whether no code of an ended node runs any more; wait for it for a moment."""
        if supervisor in self._tasks:  # it has ended in this turn of the loop, or nothing ends it
            await asyncio.wait([self._tasks[supervisor]], timeout=timeouts.current.last_resort)
        return supervisor not in self._tasks

    def cancel(self) -> None:
        """Cancel all tasks."""
        for task in self._tasks.values():
            task.cancel()

    async def wait(self) -> None:
        """Wait until all nodes have ended, and raise the error of a task that ended in one."""
        for supervisor, task in tuple(self._tasks.items()):
            await supervisor.ended.wait()
            if task.done() and not task.cancelled():
                task.result()

    def _on_end(self, supervisor: Supervisor, task: asyncio.Task[None]) -> None:
        supervisor.ended.set()  # where it was cancelled before its first step
        if task.cancelled() or task.exception() is None:
            del self._tasks[supervisor]
        else:
            self._on_fault()


class Course:
    """The nodes and extensions of a graph, from the first that begins to the last that ends; for busflow itself."""

    exit_code: ExitCode = ExitCode.OK
    given_up: BusflowError | None = None
    """Reason for the end, where that is no node's fault."""
    duration_s: float | None = None
    """How long it took; None before its end."""
    _asked_early: ExitCode | None = None

    def __init__(
        self, name: str, bus: Bus, log: Log, watchdog: Watchdog | None, *, grace_s: float, prints_failures: bool
    ) -> None:
        self.name: str = name
        self.bus: Bus = bus
        self.log: Log = log
        self.watchdog: Watchdog | None = watchdog
        self.grace_s: float = grace_s
        self.clock: Clock = bus.clock
        self.prints_failures = prints_failures
        """Whether the program prints the failures at the end, so that the console need not."""
        self.on_failed: Callable[[], object] = lambda: None
        """Called when a node has failed, or the run was given up."""
        self.supervisors: list[Supervisor] = []
        self.extensions: list[Extension] = []
        self.failures: list[Failure] = []
        self.ending: asyncio.Event = asyncio.Event()
        """Set once the graph is to end, for whatever reason."""
        self._begun = ExitStack()
        """Stack that ends the extensions that have begun, the last one first."""
        self._main: asyncio.Task[None] | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ready = asyncio.Event()
        self._held: frozenset[str] = frozenset()
        self._lives: Lives | None = None

    @property
    def has_begun(self) -> bool:
        """Whether it was started, if only to fail."""
        return self._main is not None

    @property
    def end_s(self) -> float:
        """Wall time that the extensions may take to end, beyond the grace of the nodes."""
        return sum(each.end_s for each in self.extensions)

    def hold(self, names: Collection[str]) -> None:
        """Start none of these nodes, which were stopped by hand in an earlier life of the process."""
        self._held = frozenset(names)

    async def begin(self, nodes: Sequence[PlannedNode], *, at_end: Callable[[], object]) -> None:
        """Start the extensions and these nodes; return when every `start` has returned.

        Args:
            nodes: planned without an error.
            at_end: called when the nodes have ended, before the extensions end.

        Raises:
            NodeFailed: a node failed while starting; everything is stopped again.
        """
        self.supervisors += supervisors_of(nodes, self._overseer(), self.extensions)
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
                if supervisor.name in self._held:
                    supervisor.hold()
            begun.callback(at_end)
            self._begun = begun.pop_all()
        self._loop = loop
        if self._asked_early is not None:
            self.ask_to_stop(self._asked_early)
        self._main = loop.create_task(self._live(), name=f"busflow.{self.name}")
        try:
            await self._ready.wait()
        except asyncio.CancelledError:  # a cancelled wait must not leave the nodes running
            await self.stop()
            raise
        if self.failures or self.duration_s is not None:
            await self.stop()
            await self.wait()

    async def wait(self) -> None:
        """Wait until it has ended, and raise what has failed."""
        if self._main is not None:
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

    async def dismiss(self, names: Collection[str]) -> None:
        """Stop some of the nodes for good, while the others go on."""
        leaving = [each for each in self.supervisors if each.name in names]
        self.supervisors = [each for each in self.supervisors if each not in leaving]
        await stop_in_order(leaving, self.clock, self.grace_s)
        for supervisor in leaving:
            for extension in self.extensions:
                extension.node_dismissed(supervisor)

    def admit(self, nodes: Sequence[PlannedNode]) -> None:
        """Start nodes beside those that run."""
        if self._lives is None or self.ending.is_set():
            return
        supervisors = supervisors_of(nodes, self._overseer(), self.extensions, self.supervisors)
        self.supervisors += supervisors
        for supervisor in supervisors:
            supervisor.runtime.connect(self.bus)
        self._lives.begin(supervisors)

    async def stop_by_hand(self, supervisors: Sequence[Supervisor]) -> None:
        """Stop some of the nodes until they are started by hand, while the others go on."""
        for supervisor in supervisors:
            supervisor.stop_by_hand()
        await stop_in_order(supervisors, self.clock, timeouts.current.start)

    async def start_by_hand(self, supervisor: Supervisor) -> None:
        """Start a node that has ended, while the others go on.

        Raises:
            NotRunning: the run ends, or code of the node still runs.
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

    def ask_to_stop(self, code: ExitCode = ExitCode.OK) -> None:
        """Ask the graph to end, without waiting; `code` says why unless a node has failed."""
        if not self.ending.is_set():
            self.conclude(code)
            self.ending.set()
            for supervisor in self.supervisors:  # while one blocks the loop, the others have no time to stop
                if self.watchdog and supervisor.name in self.watchdog.blocking:
                    supervisor.ask_to_stop()

    def conclude(self, code: ExitCode) -> None:
        """Set the exit code, unless one is already set."""
        self.exit_code = self.exit_code or code

    def end_if_finished(self) -> None:
        """End the graph if all its nodes have ended, and no extension waits."""
        if self.has_finished and all(each.is_finished() for each in self.extensions):
            self.ask_to_stop()

    def give_up(self, error: BusflowError) -> None:
        """End the graph, and its waiters' wait, for a reason outside of its nodes."""
        if self.given_up is None:
            self.given_up = error
            self.ask_to_stop()
            self.conclude(error.exit_code)  # also where the end has begun
            self.on_failed()

    def ask_to_stop_from_thread(self, code: ExitCode) -> None:
        """Ask the graph to end, from another thread or before it is started; the first code holds."""
        self._asked_early = code if self._asked_early is None else self._asked_early
        if self._loop is not None:
            with suppress(RuntimeError):  # the loop has ended: nothing is left to stop
                self._loop.call_soon_threadsafe(self.ask_to_stop, code)

    async def _live(self) -> None:
        try:
            async with AsyncExitStack() as around:
                around.enter_context(stuck_handlers_named())
                for extension in self.extensions:
                    await around.enter_async_context(extension.surround())
                await self._live_through()
        finally:
            self.duration_s = self.duration_s or 0.0
            if self.watchdog is not None:
                self.watchdog.close()
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
            self.duration_s = self.clock.seconds()

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
        self.on_failed()
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
