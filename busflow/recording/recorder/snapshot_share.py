"""`SnapshotShare`: the last moments of one process of several, written when the main process orders it."""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from busflow import timeouts
from busflow.errors import RecordingRefused
from busflow.recording.recorder.recording_file import graph_file_maker
from busflow.recording.recorder.snapshot import SnapshotRecorder
from busflow.runner.report import SnapshotReport

if TYPE_CHECKING:
    from busflow.bus.failure import Failure
    from busflow.launchfile.model.description import SnapshotSpec
    from busflow.recording.recorder.share import Share
    from busflow.runner.graph import Graph


class SnapshotShare(SnapshotRecorder):
    """Keeps the last moments of a process's share of a run.

    One process decides about the snapshots of all, so that they have one name and one time.
    """

    def __init__(
        self,
        graph: Graph,
        share: Share,
        snapshot: SnapshotSpec,
        *,
        want: Callable[[str], None],
        on_report: Callable[[SnapshotReport], None],
    ) -> None:
        """Create a recorder that begins to keep messages when the graph starts.

        Args:
            graph: what runs in this process.
            share: what this process records; its file is not used.
            snapshot: how much is kept.
            want: asks for a snapshot of the whole run, for a reason.
            on_report: takes the report of each snapshot once it is written, or cannot be.
        """
        super().__init__(graph, share.spec, snapshot, share)
        self._want, self._on_report, self._process = want, on_report, share.process
        self._orders: deque[tuple[Path, str, str]] = deque()
        self._ordered = threading.Event()
        self._is_waiting = False

    def begin(self) -> None:
        """Keep messages from now on."""
        self._loop = asyncio.get_running_loop()
        self._make_file = graph_file_maker(self._graph, self._spec, self._process)
        self._capture.begin()

    def end(self) -> None:
        """Finish the snapshots that are being written, and the one that a failure has just caused."""
        if self._is_waiting:
            self._ordered.wait(timeouts.current.snapshot_order)
        self._obey()
        super().end()

    def node_failed(self, failure: Failure) -> None:
        """Ask for a snapshot of the moments before a node's failure."""
        self._ordered.clear()
        self._is_waiting = True
        self._want(f"{failure.node} {failure.summary}")

    def snapshot(self, reason: str) -> SnapshotReport | None:  # noqa: ARG002  # as Extension has it
        """Return None: another extension writes the snapshots of all processes."""
        return None

    def sections(self) -> Mapping[str, object]:
        """Return no section: another extension has the snapshots of all processes."""
        return {}

    def write(self, path: Path, reason: str, lacking: str = "") -> None:
        """Write the last moments to a new file, and what other processes have lost; called in any thread."""
        self._orders.append((path, reason, lacking))
        self._ordered.set()
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._obey)

    def _obey(self) -> None:
        """Write what is ordered."""
        self._is_waiting = self._is_waiting and not self._orders
        while self._orders:
            path, reason, lacking = self._orders.popleft()
            try:
                self._write_to(path, reason, lacking)
            except RecordingRefused as error:
                self._on_report(
                    SnapshotReport(str(path), reason, 0.0, 0, 0, written=True, complete=False, why=str(error))
                )

    def _settle(self, found: SnapshotReport) -> None:
        self._on_report(found)
