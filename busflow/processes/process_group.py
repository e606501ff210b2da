"""ProcessGroup: starts a run's processes, delays their nodes until all are linked, and ends the processes together."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import AsyncGenerator, Mapping, Sequence
from contextlib import asynccontextmanager, nullcontext, suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from busflow import timeouts
from busflow.errors import ExitCode, IncompleteRecording, LaunchError, NotRunning, ProcessFailed
from busflow.launchfile.model.placement import Placement
from busflow.launchfile.model.supervision import Restart
from busflow.processes.assignment import Assignment
from busflow.processes.crossing import crossing_problems, keep_main
from busflow.processes.machines import Machines
from busflow.processes.report import merged
from busflow.processes.shares import Shares
from busflow.processes.worker_process import ProcessOutcome, WorkerProcess, WorkerState
from busflow.ros2 import attach_successor, ros2_network
from busflow.runner.extension import Extension
from busflow.runner.source import Source
from busflow.text import printable
from busflow.wire.mirror.membership import Membership, card_of
from busflow.wire.zenoh.held_port import HeldPort
from busflow.wire.zenoh.run_directory import RunDirectory
from busflow.wire.zenoh.session import SOCKET, require_unix_sockets

if TYPE_CHECKING:
    from busflow.processes.joint_recording import JointRecording
    from busflow.processes.joint_snapshots import JointSnapshots
    from busflow.recording.recorder.snapshot_share import SnapshotShare
    from busflow.runner.assembly import Run
    from busflow.runner.planning.preflight import Plan
    from busflow.runner.report import Report
    from busflow.wire.mirror.barrier import Barrier


def start_others(run: Run) -> None:
    """Let a run start its other processes, and join other machines.

    Raises:
        LaunchError, RecordingRefused, InvalidName: as `ProcessGroup`.
    """
    run.others = group = ProcessGroup(run)
    run.graph.attach(group)
    attach_successor(run.graph)


def record_all(run: Run) -> None:
    """Record all processes of a run."""
    if isinstance(run.others, ProcessGroup):
        run.others.record()


class ProcessGroup(Extension):
    """The worker processes of a run, as an extension of the main process's graph."""

    def __init__(self, run: Run) -> None:
        """Prepare the processes that start with the graph of the main process, and join the run then.

        Raises:
            LaunchError: the graph cannot run in these processes; the error lists every problem.
            RecordingRefused, InvalidName: the recording cannot be made as requested.
        """
        graph, given, description, placement = run.graph, run.given, run.descriptions[0], run.placements[0]
        source = given.source or Source(description.files[0], args=given.args or {})
        self._graph, self._outer, self._source = graph, given.outer, source.absolute()
        self._name = given.inspect if isinstance(given.inspect, str) else graph.name
        self._event_loop, self._log = given.event_loop, graph.log.bind("busflow")
        plan = graph.plan()
        plan.problems += crossing_problems(plan, placement)
        if plan.errors:
            raise LaunchError(plan.errors)
        self._stated = [variable for each in graph.descriptions for variable in each.environment]
        self._node_order = [each.runtime.full_name for each in plan.nodes]
        self._prepare_recording(run, placement, plan)
        keep_main(plan, placement)
        self._main = placement.main
        network = description.network if description.here is not None else None
        self._machines = Machines(network, placement.machine, self._log, graph.clock.seconds) if network else None
        self.workers: list[WorkerProcess] = [
            self._worker(placement, process, f"{number}.sock") for number, process in enumerate(placement.others, 1)
        ]
        self._by_name = {worker.name: worker for worker in self.workers}
        self._recording_failures: list[str] = []  # of a recording with `on_drop: fail`
        self._prepare_membership()

    def _prepare_recording(self, run: Run, placement: Placement, plan: Plan) -> None:
        """Prepare the recording of all processes, or their snapshots; the plan still has the nodes of all processes."""
        self._recording: JointRecording | None = None
        self._snapshots: JointSnapshots | None = None
        self._own_snapshots: SnapshotShare | None = None
        self._shares: Shares | None = None
        if not run.is_recorded:
            return
        from busflow.recording.recorder.options import spec_of

        record = spec_of(run.given.record, run.descriptions[0].record)
        if record is None:
            return
        self._shares = Shares(record, placement, plan)
        if record.snapshot is None:
            from busflow.processes.joint_recording import JointRecording

            self._recording = JointRecording(record, self._shares, self._log, run=self._graph.name)
        else:
            from busflow.processes.joint_snapshots import JointSnapshots

            self._snapshots = JointSnapshots(self._graph, record, self._shares, self)

    def _prepare_membership(self) -> None:
        self._directory: RunDirectory | None = None
        self._ports: dict[str, HeldPort] = {}  # by socket of a worker process; empty without nodes of ROS 2
        self._ros2_dials: tuple[str, ...] = ()
        self._membership: Membership | None = None
        limits = timeouts.current
        self._kill_s = limits.around + limits.process_kill
        if self._shares is not None:
            self._kill_s += limits.recording_end
        self.end_s: float = self._kill_s + limits.last_reports

    def record(self) -> None:
        """Attach the recording or snapshots of all processes, and the main process's own share of them."""
        graph, snapshots, shares = self._graph, self._snapshots, self._shares
        if self._recording is not None:
            from busflow.recording.recorder.recorder import record_share

            graph.attach(self._recording)
            record_share(graph, self._recording.share(self._main))
        elif snapshots is not None and shares is not None:
            graph.attach(snapshots)
            share = shares.of(self._main, Path())
            if share.spec.snapshot is not None:
                from busflow.recording.recorder.snapshot_share import SnapshotShare

                self._own_snapshots = SnapshotShare(
                    graph,
                    share,
                    share.spec.snapshot,
                    want=snapshots.fail,
                    on_report=lambda report: snapshots.take(self._main, asdict(report)),
                )
                graph.attach(self._own_snapshots)

    def is_running(self, process: str) -> bool:
        """Return whether a process can write its last moments."""
        worker = self._by_name.get(process)
        return process == self._main if worker is None else worker.reads_commands

    def start_snapshot(self, process: str, path: Path, reason: str, lacking: str) -> None:
        """Make a process write its last moments to a file, which also says in words what other processes have lost."""
        worker = self._by_name.get(process)
        if worker is not None:
            worker.send_command(snapshot={"path": str(path), "reason": reason, "lacking": lacking})
        elif self._own_snapshots is not None:
            self._own_snapshots.write(path, reason, lacking)

    def on_snapshot(self, worker: WorkerProcess, message: Mapping[str, Any]) -> None:
        """React to a process's message about a snapshot: it wants one, or it has written its file."""
        snapshots = self._snapshots
        if snapshots is None:
            return
        if "report" in message:
            snapshots.take(worker.name, message["report"])
        else:
            with suppress(NotRunning):  # the run has ended
                self._graph.bus.call(lambda: snapshots.fail(f"{worker.name}: {message['wanted']}"))

    def _worker(self, placement: Placement, process: str, socket: str) -> WorkerProcess:
        spec, nodes = placement.specs[process], placement.nodes[process]
        return WorkerProcess(self._graph, spec, nodes, socket, environment=os.environ, owner=self)

    @property
    def failures(self) -> list[str]:
        """Failures of the worker processes, and of a recording that had to be complete, as texts for people."""
        return [failure for worker in self.workers for failure in worker.failures] + self._recording_failures

    def run_report(self) -> Report:
        """Return the report of the whole run, once all its processes have ended."""
        report = merged(self._graph.report(), self.workers, self._node_order, name=self._main)
        if self._recording is None:
            return report
        whole = self._recording.so_far(self._recorded())
        return replace(report, sections={**report.sections, "recording": whole})

    def finish(self) -> ExitCode:
        """Finish the recording of an ended run; return the exit code, which a failed process or file may change."""
        graph, recording = self._graph, self._recording
        if self._snapshots is not None:
            self._snapshots.finish()
        if recording is not None:
            recording.finish(self.run_report().without("recording"), self._recorded())
            self._report_incomplete(recording)
        if graph.exit_code is ExitCode.OK and any(worker.state is WorkerState.FAILED for worker in self.workers):
            graph.course.conclude(ExitCode.FAILED)
        return graph.exit_code

    def _report_incomplete(self, recording: JointRecording) -> None:
        """Report an incomplete recording: as a failure with `on_drop: fail`, else as a warning."""
        outcome = recording.outcome
        if outcome is None or not outcome.why:
            return
        text = f"the recording {printable(outcome.path)} is incomplete: {printable(outcome.why)}"
        recording.on_drop.apply(text, warn=self._log.warning, fail=self._fail_ended)

    def _fail_ended(self, error: IncompleteRecording) -> None:
        """Fail a run whose nodes have ended, unless it has failed already."""
        if self._graph.exit_code is ExitCode.OK:
            self._graph.course.conclude(error.exit_code)
            self._recording_failures.append(str(error))

    def _recorded(self) -> Sequence[Mapping[str, Any]]:
        """Return the recording reports of all processes, those from before a restart included."""
        main = self._graph.report().recording
        recordings = [asdict(main)] if main is not None else []
        for worker in self.workers:
            reports = (*(each.report for each in worker.outcomes), worker.report)
            recordings += [report["recording"] for report in reports if report is not None and "recording" in report]
        return recordings

    def begin(self) -> None:
        """Create the run directory and join the run, so that the worker processes can connect.

        Raises:
            InspectionUnavailable: no safe directory can be made, or nodes of ROS 2 cannot be let in.
        """
        require_unix_sockets(", or run all nodes in this process: --one-process")
        graph = self._graph
        if self._machines is not None:
            self._machines.on_doubled = lambda: graph.ask_to_stop(ExitCode.FAILED)
        linked = self._machines.network if self._machines else None
        find_network = ros2_network(graph.descriptions, linked)
        network = linked if find_network is None else find_network()
        if network is not None and network.ros2 is not None:
            self._ports = {worker.socket: HeldPort() for worker in self.workers}
            self._ros2_dials = tuple(network.ros2.dials)
        self._directory = RunDirectory.claim(self._name)
        name = self._directory.path.name
        card = card_of(graph, name, self._main, since_ns=graph.clock.now().nanoseconds, network=network)
        addresses = (*card.ros2_addresses, *(port.address for port in self._ports.values()))
        self._card = replace(card, ros2_addresses=addresses)
        self._membership = Membership(
            graph,
            self._directory.inside,
            self._card,
            process=self._main,
            socket=SOCKET,
            network=network,
            about=self._about,
            on_change=self._on_presence,
            on_version=self._machines.on_version if self._machines else None,
        )
        try:
            self._membership.begin()
            self._directory.write_card(self._card)
            if network is not None and network.ros2 is not None:
                self._log.info(str(network.ros2))
        except BaseException:
            self.end()
            raise
        if name != self._name:
            self._log.info(f"other terminals find this run as {name}")

    def end(self) -> None:
        """Leave the run and remove its directory; other terminals no longer find it."""
        membership, self._membership = self._membership, None
        directory, self._directory = self._directory, None
        for port in self._ports.values():
            port.close()
        with nullcontext() if directory is None else directory.ending():
            if membership is not None:
                membership.end()

    @asynccontextmanager
    async def surround(self) -> AsyncGenerator[None]:
        """Start the worker processes, delay the nodes until all are ready, and end the processes with the graph."""
        if self._membership is None:
            raise RuntimeError("the graph has not started")
        self._membership.barrier.begin()
        problem: ProcessFailed | None = None
        async with asyncio.TaskGroup() as tasks:
            for worker in self.workers:
                tasks.create_task(worker.live(), name=f"busflow.process.{worker.name}")
            tasks.create_task(self._end_with_graph(), name="busflow.processes")
            watching = tasks.create_task(self._machines.watch(), name="busflow.machines") if self._machines else None
            try:
                await self._all_ready(self._membership.barrier)
            except ProcessFailed as error:
                problem = error
                self._graph.ask_to_stop(ExitCode.FAILED)
            else:
                yield
            if watching is not None:
                watching.cancel()
        if problem is not None:
            raise problem

    async def _all_ready(self, barrier: Barrier) -> None:
        names = list(self._by_name)
        first_s, all_s = timeouts.current.processes_warning, timeouts.current.processes_start
        passed = asyncio.create_task(barrier.passed(names, unless=self._graph.course.ending))
        try:
            for limit_s in (first_s, all_s - first_s):
                await asyncio.wait([passed], timeout=limit_s)
                if passed.done():
                    return
                self._log.warning("the nodes wait", reason="; ".join(barrier.lacking(names)))
            lacking = "; ".join(barrier.lacking(names))
            raise ProcessFailed(f"not all processes were ready within {all_s:g} s: {lacking}")
        finally:
            passed.cancel()

    async def _end_with_graph(self) -> None:
        """Stop the worker processes when the graph ends, the last one first, and kill those that take too long."""
        await self._graph.course.ending.wait()
        for worker in reversed(self.workers):
            worker.ask_to_stop(self._graph.exit_code)
        await asyncio.sleep(0)
        kill_s = self._graph.grace_s + self._kill_s
        for worker in self.workers:
            asyncio.get_running_loop().call_later(kill_s, worker.kill, "did not stop in time")

    # Called by the worker processes.

    @property
    def inherited(self) -> tuple[int, ...]:
        """Files that each worker process has open from its start: the run's directory."""
        return (self._directory.descriptor,) if self._directory else ()

    def first_line(self, worker: WorkerProcess) -> bytes:
        """Return a worker's assignment: it waits for all other processes, or for the running ones after a restart."""
        others = [each.name for each in self.workers if each is not worker]
        earlier = [SOCKET, *(each.socket for each in self.workers[: self.workers.index(worker)])]
        if worker.restarts > 0:
            others = [name for name in others if self._by_name[name].state is WorkerState.RUNNING]
            # Zenoh does not always connect again to a socket that was gone for a moment; so this process does.
            there = self._directory.path.glob("*.sock") if self._directory else ()
            earlier += [path.name for path in there if path.name not in {*earlier, worker.socket}]
        return Assignment(
            process=worker.name,
            socket=worker.socket,
            earlier=tuple(earlier),
            directory=str(self._directory.inside) if self._directory else "",
            card=self._card,
            nodes=worker.nodes,
            others=(self._main, *others),
            seed=self._graph.seed,
            log_level=self._graph.log.level,
            ros2_listens=self._ports[worker.socket].address if self._ports else "",
            ros2_dials=self._ros2_dials,
            restarts=worker.restarts,
            nice=worker.spec.nice,
            env=worker.spec.env,
            outer={variable: self._outer.get(variable) for variable in (*self._stated, *worker.spec.env)},
            watchdog_s=self._graph.watchdog.bound_s if self._graph.watchdog else None,
            prints_failures=self._graph.course.prints_failures and worker.policy.when is Restart.NEVER,
            path=tuple(sys.path),
            memory=worker.memory,
            source=self._source,
            event_loop=self._event_loop,
            timeouts=timeouts.current.changed(),
            record=self._share_data(worker.name),
        ).line()

    def _share_data(self, process: str) -> Mapping[str, Any] | None:
        """Return a process's share of the recording or snapshots for its coming start, as plain data."""
        if self._recording is not None:
            return self._recording.share(process).as_json()
        return None if self._shares is None else self._shares.of(process, Path()).as_json()

    def on_outcome(self, worker: WorkerProcess, outcome: ProcessOutcome) -> None:
        """Handle each end of a process: an incomplete recording with `on_drop: fail` ends the run."""
        if self._snapshots is not None:
            self._snapshots.lose(worker.name)
            # A process that reported its end has asked for a snapshot itself, when its node failed.
            if outcome.failure and not outcome.reported_end:
                self._snapshots.fail(outcome.failure)
        recording: Mapping[str, Any] = (outcome.report or {}).get("recording") or {}
        if self._recording is not None and not recording.get("complete"):
            why = outcome.failure or f"the process {worker.name} has not finished its file"
            text = f"the recording {printable(self._recording.path)} is incomplete: {why}"
            # A warning waits for `finish`, which examines all files.
            self._recording.on_drop.apply(text, warn=lambda _text: None, fail=self._graph.course.give_up)

    def _about(self) -> Mapping[str, Any]:
        """Return facts about the worker processes and machines, which may be unable to answer themselves."""
        workers = [
            {"process": worker.name, "pid": worker.pid, "nodes": len(worker.nodes), "restarts": worker.restarts}
            | {"states": {worker.state.value: len(worker.nodes)}}
            for worker in self.workers
        ]
        return {"restarts": 0, "members": workers, **(self._machines.about() if self._machines else {})}

    def about(self) -> Mapping[str, Any]:
        """Return what the main process knows of other sessions."""
        return {} if self._membership is None else self._membership.about()

    def is_finished(self) -> bool:
        """Return whether every worker process has ended too."""
        return all(worker.state is WorkerState.ENDED for worker in self.workers)

    def _on_presence(self, process: str, there: bool) -> None:
        worker = self._by_name.get(process)
        if worker is not None:
            worker.on_presence(there=there)
        elif self._machines is not None:
            self._machines.on_presence(process, there=there)
