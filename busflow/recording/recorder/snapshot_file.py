"""`SnapshotFile`: one snapshot of the last moments, from its first message to its end on the disk."""

from __future__ import annotations

import asyncio
import threading
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from busflow import timeouts
from busflow.recording.recorder.channels import Announcer, Track, Tracks
from busflow.recording.recorder.recording_file import MakeFile, RecordingFile, part_metadata
from busflow.recording.recorder.spool import MOST_BYTES, Spool, reason_of
from busflow.runner.report import SnapshotReport

if TYPE_CHECKING:
    from busflow.recording.recorder.last_moments import Kept, LastMoments


class SnapshotFile:
    """A bag of what was kept, and of what follows until it is concluded.

    Like a part of a recording it begins with repeats: the latched messages that are older.
    """

    def __init__(
        self,
        path: Path,
        reason: str,
        kept: LastMoments,
        *,
        make: MakeFile,
        tracks: Tracks,
        number: int,
        threaded: bool,
        lacking: str = "",
    ) -> None:
        """Make the file, and begin to write what is kept into it.

        Args:
            path: the file, which must not exist.
            reason: what the snapshot shows.
            kept: the last moments; nothing may be added to them meanwhile.
            make: makes the file.
            tracks: what is captured; those with a publisher are in the file, also without a message.
            number: the number of the next message.
            threaded: whether a thread writes, so that nothing waits for the disk.
            lacking: the losses of other processes, in words.

        Raises:
            RecordingRefused: the file cannot be made.
        """
        self.path: Path = path
        self._reason, self._threaded, self._lacking = reason, threaded, lacking
        recent, older = list(kept), kept.latched()
        self._first = recent[0].sequence if recent else number
        self._first_ns = self._last_ns = recent[0].time_ns if recent else 0
        repeated = Counter(each.track.topic for each in older)
        file = RecordingFile(*make(path, part_metadata(0, self._first, repeated, reason=reason)))
        self._spool = Spool(file, threaded=threaded, on_failure=lambda _error: None, most_bytes=MOST_BYTES)
        self._announcer, self._numbers = Announcer(), dict[str, int]()
        self._recorded = self._missed = 0
        self._why = ""
        self._is_whole = False
        self._closing: threading.Thread | None = None
        self.is_concluded: bool = False
        """True once nothing more is put into it."""
        self.is_written: bool = False
        """True once it is on the disk, or cannot be written."""
        for track in tracks.by_topic.values():
            if track.offered:
                self._announce(track)
        if older:
            self._repeat(older)
        self._put_all(recent)

    def put(self, message: Kept) -> None:
        """Write a message, after all earlier ones."""
        number = self._announce(message.track)
        if number and self._spool.put(number, message.sequence, message.time_ns, message.payload):
            self._recorded += 1
        self._first_ns = self._first_ns or message.time_ns
        self._last_ns = message.time_ns

    def note(self, why: str) -> None:
        """Take note of a reason why a message is not in it."""
        self._why = self._why or why

    def conclude(self, report: Mapping[str, Any], last: int) -> None:
        """Put nothing more into it but the account of the run; `last` is the number of the last message."""
        self.is_concluded = True
        recorded = self._recorded
        self._missed = last + 1 - self._first - recorded
        self._is_whole = self._spool.do(
            lambda file: file.conclude(report, recorded, self._missed, lacking=self._lacking)
        )

    def close(self, on_written: Callable[[SnapshotFile], None]) -> None:
        """Write what waits and close the file, without waiting for it; then call, on the event loop."""
        if not self._threaded:
            self._close()
            self._end(on_written)
            return
        loop = asyncio.get_running_loop()

        def close() -> None:
            self._close()
            with suppress(RuntimeError):  # the loop has ended: `wait` was called before
                loop.call_soon_threadsafe(self._end, on_written)

        self._closing = threading.Thread(target=close, name="busflow.snapshot", daemon=True)
        self._closing.start()

    def wait(self, on_written: Callable[[SnapshotFile], None], timeout_s: float) -> None:
        """Wait until a file that is being closed is on the disk."""
        if self._closing is not None:
            self._closing.join(timeout_s)
            if self._closing.is_alive():
                self.note(_TOO_SLOW)
        self._end(on_written)

    def report(self) -> SnapshotReport:
        """Return the state of the snapshot."""
        return SnapshotReport(
            path=str(self.path),
            reason=self._reason,
            seconds=max(0, self._last_ns - self._first_ns) / 1e9,
            recorded=self._recorded,
            missed=self._missed,
            written=self.is_written,
            complete=self.is_written and self._is_whole and not self._missed,
            why=self._why,
        )

    def _announce(self, track: Track) -> int:
        number = self._numbers.get(track.topic, 0)
        if not number:
            number = self._announcer.announce(self._spool, track.topic, track.support, track.offered, track.nodes)
            self._numbers[track.topic] = number
        return number

    def _repeat(self, older: Sequence[Kept]) -> None:
        rows = [(self._announce(each.track), each.time_ns, each.payload) for each in older]
        at_ns = self._first_ns or older[-1].time_ns
        self._spool.do(lambda file: file.repeat(rows, at_ns))

    def _put_all(self, messages: Sequence[Kept]) -> None:
        """Write all at once, in the thread: they are in memory anyhow, and need no room in its queue."""
        rows = [(self._announce(each.track), each.sequence, each.time_ns, each.payload) for each in messages]

        def write(file: RecordingFile) -> None:
            for row in rows:
                file.add_message(*row)

        self._spool.do(write)
        self._recorded = len(rows)
        self._last_ns = messages[-1].time_ns if messages else 0

    def _close(self) -> None:
        self._is_whole = self._spool.close(timeouts.current.snapshot_end) and self._is_whole
        if self._spool.failure is not None:
            self.note(reason_of(self._spool.failure))
        elif not self._is_whole:
            self.note(_TOO_SLOW)
        elif self._missed:
            self.note(reason_of(None))

    def _end(self, on_written: Callable[[SnapshotFile], None]) -> None:
        if not self.is_written:
            self.is_written = True
            on_written(self)


_TOO_SLOW = "its end could not be written in time"
