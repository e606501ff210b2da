"""`SnapshotRecorder`: keeps the last moments of a run in memory, and writes them as a bag when asked, or on a failure.

Nothing is written to the disk before that. Each snapshot has a file, a thread and an account of its own: several may be
written at a time, and the failure of one does not affect the others.
"""

from __future__ import annotations

import threading
from functools import partial
from typing import TYPE_CHECKING

from busflow import timeouts
from busflow.errors import RecordingRefused
from busflow.recording.recorder.capture import Capture
from busflow.recording.recorder.destination import foresee_snapshots, numbered
from busflow.recording.recorder.last_moments import Kept, LastMoments
from busflow.recording.recorder.recording_file import graph_file_maker
from busflow.recording.recorder.snapshot_file import SnapshotFile
from busflow.runner.extension import Extension
from busflow.text import printable

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from busflow.bus.endpoint import Endpoint
    from busflow.bus.failure import Failure
    from busflow.interfaces.message import Message
    from busflow.launchfile.model.description import RecordSpec, SnapshotSpec
    from busflow.log import Logger
    from busflow.recording.recorder.channels import Track
    from busflow.recording.recorder.share import Share
    from busflow.runner.graph import Graph
    from busflow.runner.report import SnapshotReport

MOST_FOR_FAILURES = 10
"""The number of snapshots that failures cause in a run: a node that fails every second must not fill the disk."""
MOST_AT_ONCE = 4
"""The number of snapshots that may be written at a time; each may hold the messages of a whole window."""


class FailureSnapshots:
    """The snapshots that failures cause, up to a limit."""

    def __init__(self, log: Logger, snapshot: Callable[[str], object]) -> None:
        self._log, self._snapshot = log, snapshot
        self._failures = 0

    def add(self, reason: str) -> None:
        """Write the last moments before a failure; log a warning if that is not possible."""
        self._failures += 1
        if self._failures == MOST_FOR_FAILURES:
            self._log.warning(f"this is the last of {MOST_FOR_FAILURES} snapshots that failures cause in a run")
        if self._failures <= MOST_FOR_FAILURES:
            try:
                self._snapshot(reason)
            except RecordingRefused as error:
                self._log.error(f"the last moments cannot be written: {error}")


class SnapshotRecorder(Extension):
    """Keeps the last moments of a graph."""

    def __init__(self, graph: Graph, spec: RecordSpec, snapshot: SnapshotSpec, share: Share | None = None) -> None:
        """Create a recorder that begins to keep messages when the graph starts."""
        self._graph, self._spec, self._snapshot = graph, spec, snapshot
        self._clock, self._log = graph.clock, graph.log.bind("busflow")
        self.end_s: float = timeouts.current.snapshot_end
        self._window = LastMoments(snapshot.most_bytes)
        self._capture = Capture(graph, spec, share, write=self._write, miss=self._miss)
        self._lock = threading.Lock()  # log lines may come from other threads
        self._sequence = self._number = 0
        self._failures = FailureSnapshots(self._log, self.snapshot)
        self._open: list[SnapshotFile] = []
        self._reports: dict[Path, SnapshotReport] = {}
        """By file, in the order of the requests; of a file that is being written, the report from its beginning."""
        self._path: Path | None = None
        self._is_over = self._is_short = False

    # Its life.

    def begin(self) -> None:
        """Keep messages from now on.

        Raises:
            RecordingRefused: the name has a wrong placeholder or suffix, or its folder is not there.
        """
        self._path = foresee_snapshots(self._spec.to, run=self._graph.name).absolute()
        self._make_file = graph_file_maker(self._graph, self._spec)
        self._capture.begin()

    def end(self) -> None:
        """Finish the snapshots that are being written; the last moments stay, for one more."""
        self._capture.end()
        self._is_over = True
        for each in tuple(self._open):
            self._conclude(each)
        for each in tuple(self._open):
            each.wait(self._on_written, timeouts.current.snapshot_end)

    def node_failed(self, failure: Failure) -> None:
        """Write the last moments before a node's failure."""
        self._failures.add(f"{failure.node} {failure.summary}")

    def snapshot(self, reason: str) -> SnapshotReport | None:
        """Write the last moments, and what follows them for the time that is set; None before the run.

        Raises:
            RecordingRefused: the file cannot be made.
        """
        if self._path is None:
            return None
        if len(self._open) >= MOST_AT_ONCE:
            last = self._open[-1].report()
            self._log.warning(f"{MOST_AT_ONCE} snapshots are being written, so there is none of its own", reason=reason)
            return last
        path, self._number = numbered(self._path, self._number + 1)
        return self._write_to(path, reason)

    def _write_to(self, path: Path, reason: str, lacking: str = "") -> SnapshotReport:
        """Write the last moments to a file; `lacking` says in words what other processes have lost.

        Raises:
            RecordingRefused: it cannot be made.
        """
        with self._lock:
            self._window.forget(self._clock.monotonic_ns())
            file = SnapshotFile(
                path,
                reason,
                self._window,
                make=self._make_file,
                tracks=self._capture.tracks,
                number=self._sequence + 1,
                threaded=self._clock.kind == "system" and not self._is_over,
                lacking=lacking,
            )
            self._open.append(file)
            self._reports[path] = file.report()
        self._log.info(f"the last moments are written to {printable(path)}", reason=reason)
        if self._is_over or not self._snapshot.after_s:
            self._conclude(file)
        else:
            due_ns = self._clock.monotonic_ns() + round(self._snapshot.after_s * 1e9)
            self._clock.call_at(due_ns, partial(self._conclude, file))
        return file.report()

    def sections(self) -> Mapping[str, object]:
        """Return the snapshots."""
        now = {each.path: each.report() for each in self._open}
        return {"snapshots": tuple((self._reports | now).values())}

    # What comes.

    def _write(self, track: Track, message: Message, publisher: Endpoint | None) -> None:
        try:
            payload = track.encode(message)
        except Exception as error:  # noqa: BLE001  # a message that cannot be recorded is no fault of its publisher
            self._miss(f"a message on {track.topic} cannot be put into bytes: {error}")
            return
        with self._lock:
            self._sequence += 1
            now_ns = self._clock.monotonic_ns()
            due_ns = now_ns + round(self._snapshot.window_s * 1e9)
            kept = Kept(track, self._sequence, self._clock.now_ns(), due_ns, payload, publisher)
            self._window.add(kept, now_ns)
            for each in self._open:
                if not each.is_concluded:
                    each.put(kept)
            lost = self._window.lost
        if lost and not self._is_short:
            self._is_short = True
            self._log.warning(
                f"{self._window.most_bytes} bytes are too few for what transient_local publishers keep, so snapshots "
                "have not all of it: raise bytes: under record:"
            )

    def _miss(self, why: str) -> None:
        """Leave a gap for a message that is not kept and should be."""
        with self._lock:
            self._sequence += 1
            for each in self._open:
                each.note(why)

    def _conclude(self, file: SnapshotFile) -> None:
        if not file.is_concluded:
            report = self._graph.report().without("recording", "snapshots").as_json()
            with self._lock:
                last = self._sequence
                file.conclude(report, last)
            file.close(self._on_written)

    def _on_written(self, file: SnapshotFile) -> None:
        """React to a snapshot that was written, or could not be."""
        with self._lock:
            self._open.remove(file)
        self._reports[file.path] = found = file.report()
        self._settle(found)

    def _settle(self, found: SnapshotReport) -> None:
        if found.complete:
            return
        text = f"the snapshot {printable(found.path)} is incomplete: {printable(found.why)}"
        self._spec.on_drop.apply(text, warn=self._log.warning, fail=self._graph.course.give_up)
