"""`Recorder`: writes a run into a file as it happens: messages, parameters, calls, log, and at the end the report.

It receives each message before any queue, and no node waits for it: a recording that fails changes nothing else in the
run. It numbers every message first, so that a missing one shows as a gap.
"""

from __future__ import annotations

import asyncio
import threading
from contextlib import suppress
from typing import TYPE_CHECKING

from busflow import timeouts
from busflow.errors import BagError
from busflow.recording.bag.rosbag2_metadata import describe_recordings
from busflow.recording.recorder.capture import Capture
from busflow.recording.recorder.destination import as_directory, named, new_directory
from busflow.recording.recorder.options import spec_of
from busflow.recording.recorder.recording_file import Latched, RecordingFile, SplitFile, graph_file_maker
from busflow.recording.recorder.snapshot import SnapshotRecorder
from busflow.recording.recorder.spool import Spool, reason_of
from busflow.runner.extension import Extension
from busflow.runner.report import RecordingReport
from busflow.text import printable

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from busflow.bus.endpoint import Endpoint
    from busflow.interfaces.message import Message
    from busflow.launchfile.model.description import RecordSpec
    from busflow.recording.recorder.channels import Track
    from busflow.recording.recorder.share import Share
    from busflow.runner.assembly import Run
    from busflow.runner.graph import Graph, Wanted


def record(run: Run) -> None:
    """Record a run of one process, as its options or keywords ask, or its launch file.

    Raises:
        InvalidParameter, InvalidName: as `record_graph`.
    """
    record_graph(run.graph, run.given.record)


def record_graph(graph: Graph, wanted: Wanted | None) -> None:
    """Record a graph that is yet to be started, until it has ended; None is as its launch file says.

    Raises:
        InvalidParameter: what is wanted cannot be, with every reason.
        InvalidName: one of the patterns is not valid.
    """
    spec = spec_of(wanted, next((each.record for each in graph.descriptions if each.record is not None), None))
    if spec is None:
        return
    if spec.snapshot is None:
        graph.attach(Recorder(graph, spec))
    else:
        graph.attach(SnapshotRecorder(graph, spec, spec.snapshot))


def record_share(graph: Graph, share: Share) -> None:
    """Record a graph that is yet to be started, being one process of a run of which each records itself.

    Raises:
        InvalidName: one of the patterns is not valid.
    """
    graph.attach(Recorder(graph, share.spec, share))


class Recorder(Extension):
    """Writes one run, or a process's share of one, into a file, or a directory of parts."""

    def __init__(self, graph: Graph, spec: RecordSpec, share: Share | None = None) -> None:
        """Create a recorder of what `spec` says, which begins when the graph starts."""
        self._graph, self._spec, self._share = graph, spec, share
        self._clock, self._log = graph.clock, graph.log.bind("busflow")
        self.end_s: float = timeouts.current.recording_end
        self._capture = Capture(graph, spec, share, write=self._write, miss=self._miss)
        self._lock = threading.Lock()  # log lines may come from other threads
        self._sequence = 0
        self._missed = 0
        self._why = ""
        self._directory: Path | None = None
        """The directory of a recording that is split."""
        self._file: RecordingFile | None = None
        self._spool: Spool | None = None
        self._finished = self._failed = False

    # Its life.

    def begin(self) -> None:
        """Make the file, and listen from now on; called before the first endpoint is attached.

        Raises:
            RecordingRefused: the file is there already, or cannot be made.
        """
        graph, split = self._graph, self._spec.split
        path = named(self._spec.to, run=graph.name) if self._share is None else self._share.file
        process = "" if self._share is None else self._share.process
        make_file = graph_file_maker(graph, self._spec, process)
        threaded = self._clock.kind == "system"
        if split is None:
            self._file = RecordingFile(*make_file(path))
        elif self._share is not None:
            self._file = SplitFile(path, split, make_file, durable=threaded)
        else:
            with new_directory(as_directory(path)) as directory:
                self._file = SplitFile(directory / f"{directory.name}.mcap", split, make_file, durable=threaded)
            self._directory = directory
        self._loop, self._thread = asyncio.get_running_loop(), threading.get_ident()
        self._spool = Spool(self._file, threaded=threaded, on_failure=self._on_failure)
        self._capture.begin()

    def end(self) -> None:
        """End the file with the report of the run."""
        with self._lock:  # a line of another thread comes before the account, or not into the file
            spool, self._spool = self._spool, None
        if spool is None:
            return
        self._capture.end()
        tracks = self._capture.tracks
        for track in tracks.by_topic.values():
            if not track.number and track.offered:
                tracks.announce(spool, track)
        report = self._graph.report().without("recording").as_json()
        recorded, missed = self._sequence - self._missed, self._missed
        later = tracks.later_publishers()
        complete = spool.do(lambda file: file.conclude(report, recorded, missed, later))
        self._finished = spool.close() and complete
        if spool.failure is not None:
            self._on_failure(spool.failure)
        elif not self._finished:
            self._failed = True
            self._report_missing("its end could not be written in time")
        if self._directory is not None:
            self._describe(self._directory)

    def _describe(self, directory: Path) -> None:
        """Write the metadata by which readers find the parts."""
        try:
            describe_recordings(directory)
        except (BagError, OSError) as error:
            self._finished = False
            self._report_missing(str(error))

    def sections(self) -> Mapping[str, object]:
        """Return the state of the recording."""
        return {"recording": self.statistics()}

    def statistics(self) -> RecordingReport:
        """Return the state of the recording, so far or at the end; what waited when writing failed is missed."""
        file = self._file
        missed = self._sequence - file.written if self._failed and file is not None else self._missed
        return RecordingReport(
            path=str(self._directory or (file.path if file else self._spec.to)),
            recorded=self._sequence - missed,
            missed=missed,
            complete=self._finished and not missed,
            why=self._why,
        )

    # On its way to the file.

    def _write(self, track: Track, message: Message, publisher: Endpoint | None) -> None:
        problem = ""
        try:
            payload = track.encode(message)
        except Exception as error:  # noqa: BLE001  # a message that cannot be recorded is no fault of its publisher
            payload, problem = b"", f"a message on {track.topic} cannot be put into bytes: {error}"
        with self._lock:
            spool = self._spool
            if spool is None:
                return
            self._sequence += 1
            taken = not problem and (track.number or self._capture.tracks.announce(spool, track))
            time_ns = self._clock.now_ns()
            taken = taken and spool.put(track.number, self._sequence, time_ns, payload)
            if not taken:
                self._missed += 1
            elif publisher is not None:
                latched = Latched(publisher, track.number, self._sequence, time_ns, payload)
                spool.do(lambda file: file.add_latched(latched))
        if not taken:
            self._report_missing(problem or reason_of(spool.failure))

    def _miss(self, why: str) -> None:
        """Leave a gap for a message that is not recorded and should be."""
        with self._lock:
            self._sequence += 1
            self._missed += 1
        self._report_missing(why)

    # What goes wrong.

    def _on_failure(self, error: Exception) -> None:
        """Report that nothing more can be written; called in the spool's thread, if it has one."""
        self._failed = True
        self._report_missing(reason_of(error))

    def _report_missing(self, why: str) -> None:
        """Report once that the recording is not complete; called in any thread."""
        if threading.get_ident() != self._thread:
            with suppress(RuntimeError):  # the loop has ended: `end` reports it
                self._loop.call_soon_threadsafe(self._report_missing, why)
            return
        if self._why:
            return
        self._why = why
        text = f"the recording {printable(self.statistics().path)} is incomplete: {self._why}"
        self._spec.on_drop.apply(text, warn=self._log.warning, fail=self._graph.course.give_up)
