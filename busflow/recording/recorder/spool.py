"""`Spool`: the bounded queue between publishers and the file, and the thread that writes.

With a thread, a put costs an append: the thread compresses and writes, most of it without holding up the interpreter,
and a message without room in the queue is refused. Without a thread, a put writes at once, the same in every run.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import TypeAlias

from busflow import timeouts
from busflow.clock import perf_counter
from busflow.errors import BusflowError
from busflow.recording.mcap.writer import Payload, size_of
from busflow.recording.recorder.recording_file import RecordingFile

Work: TypeAlias = tuple[int, int, int, Payload] | Callable[[RecordingFile], None]
"""A message, as `RecordingFile.add_message` takes it, or a function that does something rarer with the file."""

MOST_BYTES = 64 * 1024 * 1024
"""The number of bytes that may wait to be written."""
CUT_S = 0.4
"""The time that a message may wait for others in its chunk: what a crash can lose, plus the time to write."""
_CUT_NS = 400_000_000
_PAUSE_S = 0.1
"""The time for which the thread lets messages gather, if they are few."""
_MANY_BYTES = 1024 * 1024
"""The number of new bytes that wakes the thread before that."""
_EACH_BYTES = 256
"""The size that a waiting message counts for beside its bytes."""


class Spool:
    """Queue of messages and other work for the file, done in order."""

    def __init__(
        self,
        file: RecordingFile,
        *,
        threaded: bool,
        on_failure: Callable[[Exception], None],
        most_bytes: int = MOST_BYTES,
    ) -> None:
        """Create a spool for a file, and start its thread.

        Args:
            file: the file on the disk.
            threaded: write in a thread and cut chunks by wall time; else write in the caller and cut by message time.
            on_failure: called once, in the thread, with the error after which nothing more is written.
            most_bytes: the number of bytes that may wait.
        """
        self.failure: Exception | None = None
        """The reason why nothing more is written."""
        self._file, self._on_failure = file, on_failure
        self._most_bytes = most_bytes
        self._waiting: deque[Work] = deque()
        # Bytes: the callers change the first count only, the thread the second only, so neither needs a lock.
        self._handed = self._taken = 0
        self._wake_at = 0
        self._opened = 0.0
        self._arrived = threading.Event()
        self._closed = False
        self._thread = threading.Thread(target=self._work, name="busflow.recorder", daemon=True) if threaded else None
        if self._thread is not None:
            self._thread.start()

    def put(self, channel_id: int, sequence: int, time_ns: int, payload: Payload) -> bool:
        """Queue or write a message; return False if there is no room for it, or writing has failed."""
        work = (channel_id, sequence, time_ns, payload)
        if self._thread is not None:
            return self._hand(work, size_of(payload) + _EACH_BYTES)
        if self.failure is None and self._file.open_chunk and time_ns - self._file.open_since >= _CUT_NS:
            self._try(self._file.cut)
        self._try(lambda: self._do(work))
        return self.failure is None

    def do(self, work: Callable[[RecordingFile], None]) -> bool:
        """Call a function with the file after all earlier work; return False as `put` does."""
        if self._thread is not None:
            return self._hand(work, _EACH_BYTES)
        self._try(lambda: self._do(work))
        return self.failure is None

    def close(self, timeout_s: float | None = None) -> bool:
        """Write what waits and close the file; return False if that failed or took longer than `timeout_s`.

        Without `timeout_s` the limit is `Timeouts.recording_end`. With a thread, the data is then safe on the
        disk. Without a thread it is not synced: a simulated run can be repeated.
        """
        self._closed = True
        if self._thread is None:
            self._try(self._file.cut)
        else:
            self._arrived.set()
            self._thread.join(timeouts.current.recording_end if timeout_s is None else timeout_s)
            if self._thread.is_alive():
                return False
        self._file.close()
        return self.failure is None

    def _hand(self, work: Work, size: int) -> bool:
        if self.failure is not None or self._handed + size - self._taken > self._most_bytes:
            return False
        self._waiting.append(work)
        self._handed += size
        if self._handed >= self._wake_at and not self._arrived.is_set():
            self._arrived.set()
        return True

    # In the thread.

    def _work(self) -> None:
        while not self._closed and self.failure is None:
            self._arrived.wait(self._pause())
            self._arrived.clear()
            self._wake_at = self._handed + _MANY_BYTES
            self._try(self._take_all)
        self._try(self._take_all)
        self._try(self._file.cut)
        self._try(self._file.secure)
        if self._closed:  # `close` may wait no longer, and cannot close a file that this thread still writes
            self._file.close()

    def _pause(self) -> float | None:
        """Return the seconds to wait for more; None (no limit) if nothing waits: any message then wakes the thread."""
        if self._file.open_chunk:
            return max(0.0, min(_PAUSE_S, self._opened + CUT_S - perf_counter()))
        self._wake_at = 0
        return 0.0 if self._waiting else None

    def _take_all(self) -> None:
        for _ in range(len(self._waiting)):
            work = self._waiting.popleft()
            idle = not self._file.open_chunk
            self._do(work)
            self._taken += _EACH_BYTES if callable(work) else _EACH_BYTES + size_of(work[3])
            if idle and self._file.open_chunk:
                self._opened = perf_counter()
        if self._file.open_chunk and perf_counter() - self._opened >= CUT_S:
            self._file.cut()

    # In the thread, or in the caller if there is none.

    def _do(self, work: Work) -> None:
        if callable(work):
            work(self._file)
            return
        self._file.add_message(*work)

    def _try(self, write: Callable[[], object]) -> None:
        if self.failure is not None:
            return
        try:
            write()
        except Exception as error:  # noqa: BLE001  # no caller is above, and the publisher is not at fault
            self.failure = error
            self._file.cut_off()
            if self._thread is not None:  # else the return value of `put` and `do` reports it
                self._on_failure(error)


def reason_of(failure: Exception | None) -> str:
    """Return the reason why a message was not recorded."""
    if failure is None:
        return "messages come faster than they can be written"
    if isinstance(failure, OSError):
        reason = failure.strerror
    else:
        reason = str(failure) if isinstance(failure, BusflowError) else f"{type(failure).__name__}: {failure}"
    return f"nothing more can be written to it: {reason}"
