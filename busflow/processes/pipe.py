"""PipeWriter: sends a worker process's log, its reports and its end to the main process.

The pipe carries lines of JSON and nothing else, so that no output of a node can be taken for them. While the pipe has
room, a line is in it when `send` returns: it reaches the main process even if this process is killed then. A thread
writes the other lines, so that a suspended or busy main process never delays a node here. If too many lines wait, the
oldest are lost and counted.
"""

from __future__ import annotations

import json
import os
import select
import threading
from collections import deque
from collections.abc import Mapping
from typing import Any

from busflow import timeouts
from busflow.log import LogRecord

_DEPTH = 10_000
"""Limit of the waiting lines; a further line displaces the oldest."""
_VALUE_CHARACTERS = 4096


class PipeWriter:
    """Writes lines to a pipe, those that must wait in a thread."""

    def __init__(self, pipe: int) -> None:
        """Take the writing end of a pipe; processes that this one starts do not inherit it."""
        os.set_inheritable(pipe, False)
        os.set_blocking(pipe, False)
        self.lost: int = 0
        self._pipe = pipe
        self._lines: deque[bytes] = deque()
        self._rest = b""
        """The rest of the line that is being written; empty if nothing waits."""
        self._arrived = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(target=self._write, name="busflow.pipe", daemon=True)
        self._thread.start()

    def send(self, **values: Any) -> None:
        """Send values as one line, from any thread, without waiting."""
        line = json.dumps(values, default=str).encode() + b"\n"
        with self._arrived:
            if not self._rest:  # nothing waits
                self._rest = self._written(line)
            elif len(self._lines) < _DEPTH:
                self._lines.append(line)
            else:
                self._lines.popleft()
                self._lines.append(line)
                self.lost += 1
            if self._rest:
                self._arrived.notify()

    def log(self, record: LogRecord) -> None:
        """Send a log record, as a sink of the log."""
        values = {name: _short(value) for name, value in record.values.items()}
        self.send(log=[record.stamp_ns, record.level, record.node, _short(record.event), values])

    def close(self) -> None:
        """Write the remaining lines, as far as the main process reads them in time."""
        with self._arrived:
            self._closed = True
            self._arrived.notify()
        self._thread.join(timeouts.current.pipe_end)

    def _write(self) -> None:
        room = select.poll()
        room.register(self._pipe, select.POLLOUT)
        while True:
            with self._arrived:
                while not self._rest:
                    if self._closed:
                        return  # the pipe stays open, because its end would mean that this process has ended
                    self._arrived.wait()
            room.poll()
            with self._arrived:
                self._rest = self._written(self._rest)
                while not self._rest and self._lines:
                    self._rest = self._written(self._lines.popleft())

    def _written(self, line: bytes) -> bytes:
        """Write as much of a line as the pipe has room for; return the rest."""
        try:
            return line[os.write(self._pipe, line) :]
        except BlockingIOError:
            return line
        except OSError:  # the main process has ended, so this one will end too
            return b""


def record_of(line: Any, process: str) -> LogRecord:
    """Return the log record of a line that `PipeWriter.log` sent.

    Raises:
        ValueError: the line is not a log record.
    """
    match line:
        case [int(stamp_ns), str(level), str(node), str(event), {**values}]:
            kept: Mapping[str, Any] = {str(name): value for name, value in values.items()}
            return LogRecord(stamp_ns, level, node, event, kept, process)
        case _:
            raise ValueError("not a log record")


def _short(value: Any) -> Any:
    """Return a value that JSON can hold, cut to a readable length."""
    if value is None or isinstance(value, bool | int):
        return value
    if isinstance(value, float):
        return value if value - value == 0 else str(value)  # JSON has no infinity, and no NaN
    text = str(value)
    return text if len(text) <= _VALUE_CHARACTERS else text[: _VALUE_CHARACTERS - 1] + "…"
