"""JointSnapshots: the snapshots of a run with several processes; each is a directory with one file for each process."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from busflow.errors import BagError, IncompleteRecording, NotRunning
from busflow.recording.bag.rosbag2_metadata import describe_recordings
from busflow.recording.recorder.destination import as_directory, foresee_snapshots, numbered, refusal
from busflow.recording.recorder.snapshot import MOST_AT_ONCE, FailureSnapshots
from busflow.runner.extension import Extension
from busflow.runner.report import SnapshotReport
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.launchfile.model.description import RecordSpec
    from busflow.processes.shares import Shares
    from busflow.runner.graph import Graph


class Writers(Protocol):
    """The processes that write their last moments."""

    def is_running(self, process: str) -> bool:
        """Return whether a process can write its last moments."""
        ...

    def start_snapshot(self, process: str, path: Path, reason: str, lacking: str) -> None:
        """Make a process write its last moments to a file, which also says in words what other processes have lost."""
        ...


@dataclass(slots=True)
class _Pending:
    """A snapshot whose files are being written."""

    directory: Path
    reason: str
    waiting: set[str] = field(default_factory=set[str])
    """The processes that have not reported yet."""
    reports: dict[str, Mapping[str, Any]] = field(default_factory=dict[str, Mapping[str, Any]])
    lost: list[str] = field(default_factory=list[str])
    """The moments that no file has, in words."""


class JointSnapshots(Extension):
    """Decides when all processes write their last moments, and collects what they have written."""

    def __init__(self, graph: Graph, spec: RecordSpec, shares: Shares, writers: Writers) -> None:
        self._graph, self._spec, self._shares, self._writers = graph, spec, shares, writers
        self._log = graph.log.bind("busflow")
        self._path: Path | None = None
        self._number = 0
        self._ended_ns: dict[str, int] = {}
        """The time at which a process ended last, by process."""
        self._failures = FailureSnapshots(self._log, self.snapshot)
        self._lock = threading.Lock()  # reports come in the threads that read the processes' pipes
        self._pending: dict[str, _Pending] = {}
        """The snapshots that are being written, by their directory."""
        self._reports: dict[Path, SnapshotReport] = {}
        """By directory, in the order of the requests; of what is being written, the report from its beginning."""

    def begin(self) -> None:
        """Check whether snapshots can be written.

        Raises:
            RecordingRefused: the path has a wrong placeholder or suffix, or its folder does not exist.
        """
        self._path = foresee_snapshots(self._spec.to, run=self._graph.name).absolute()

    def snapshot(self, reason: str) -> SnapshotReport | None:
        """Make all processes write their last moments; return None before the run.

        Raises:
            RecordingRefused: the directory cannot be made.
        """
        if self._path is None:
            return None
        with self._lock:
            pending = list(self._pending.values())
        if len(pending) >= MOST_AT_ONCE:
            self._log.warning(f"{MOST_AT_ONCE} snapshots are being written, so there is none of its own", reason=reason)
            return _joined(pending[-1], written=False)
        path, self._number = numbered(self._path, self._number + 1)
        directory = as_directory(path)
        try:
            directory.mkdir()
        except OSError as error:
            raise refusal(directory, error) from None
        running = tuple(filter(self._writers.is_running, self._shares.processes))
        made = _Pending(directory, reason, set(running), lost=list(self._lost(running)))
        with self._lock:
            self._pending[str(directory)] = made
            self._reports[directory] = _joined(made, written=False)
        self._log.info(f"the last moments are written to {printable(directory)}", reason=reason)
        lacking = "; ".join(made.lost)
        for process in running:
            file = directory / f"{self._shares.stems[process]}.mcap"
            self._writers.start_snapshot(process, file, reason, lacking)
        self._finish_ready()
        return _joined(made, written=False)

    def _lost(self, running: Sequence[str]) -> Iterator[str]:
        """Yield in words the last moments that ended with a process."""
        window_ns = 0 if self._spec.snapshot is None else round(self._spec.snapshot.window_s * 1e9)
        since_ns = self._graph.clock.monotonic_ns() - window_ns
        for process in self._shares.processes:
            if process not in running:
                yield f"there is nothing of the process {process}"
            elif self._ended_ns.get(process, since_ns) > since_ns:
                yield f"the moments of the process {process} before its restart are lost"

    def fail(self, reason: str) -> None:
        """Write the last moments before a failure."""
        self._failures.add(reason)

    def take(self, process: str, report: Mapping[str, Any]) -> None:
        """Store a process's report of the file that it has written; called in any thread."""
        with self._lock:
            pending = self._pending.get(str(Path(str(report["path"])).parent))
            if pending is None:
                return
            pending.reports[process] = report
            pending.waiting.discard(process)
        self._finish_ready()

    def lose(self, process: str) -> None:
        """Stop waiting for a process that has ended; its last moments are gone."""
        self._ended_ns[process] = self._graph.clock.monotonic_ns()
        with self._lock:
            for pending in self._pending.values():
                if process in pending.waiting:
                    pending.waiting.discard(process)
                    pending.lost.append(f"the process {process} ended before its file was whole")
        self._finish_ready()

    def finish(self) -> None:
        """Stop waiting for all processes; called when they have ended."""
        for process in self._shares.processes:
            self.lose(process)

    def sections(self) -> Mapping[str, object]:
        """Return the snapshots."""
        with self._lock:
            now = {each.directory: _joined(each, written=False) for each in self._pending.values()}
            return {"snapshots": tuple((self._reports | now).values())}

    def _finish_ready(self) -> None:
        with self._lock:
            ready = [each for each in self._pending.values() if not each.waiting]
            for each in ready:
                del self._pending[str(each.directory)]
        for each in ready:
            found = _joined(each, written=True)
            try:
                describe_recordings(each.directory, lacking="; ".join(each.lost))
            except (BagError, OSError) as error:
                found = replace(found, complete=False, why=found.why or str(error))
            with self._lock:
                self._reports[each.directory] = found
            self._settle(found)

    def _settle(self, found: SnapshotReport) -> None:
        if found.complete:
            return
        text = f"the snapshot {printable(found.path)} is incomplete: {printable(found.why)}"
        self._spec.on_drop.apply(text, warn=self._log.warning, fail=self._fail)

    def _fail(self, error: IncompleteRecording) -> None:
        """Fail the run; called in any thread."""
        try:
            self._graph.bus.call(partial(self._graph.course.give_up, error))
        except NotRunning:  # the run is over and cannot fail any more
            self._log.warning(str(error))


def _joined(pending: _Pending, *, written: bool) -> SnapshotReport:
    """Return the report of a snapshot, from the reports of its files."""
    reports = pending.reports.values()
    why = [f"{process}: {report['why']}" for process, report in pending.reports.items() if report["why"]]
    return SnapshotReport(
        path=str(pending.directory),
        reason=pending.reason,
        seconds=max((float(each["seconds"]) for each in reports), default=0.0),
        recorded=sum(int(each["recorded"]) for each in reports),
        missed=sum(int(each["missed"]) for each in reports),
        written=written,
        complete=written and not pending.lost and all(each["complete"] for each in reports),
        why="; ".join(pending.lost + why),
    )
