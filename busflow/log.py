"""Log: the structured log lines of one run, bound to nodes, written to the run's sinks.

Nothing global is configured. A sink is a function that takes one finished record. A sink that prints escapes the text
from outside.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TextIO, cast

from busflow.text import plain, printable
from busflow.validation.tracebacks import reason, user_line

if TYPE_CHECKING:
    from busflow.clock import Clock

LEVELS: Mapping[str, int] = {"debug": 10, "info": 20, "warning": 30, "error": 40, "critical": 50}
_COLOURS = {"debug": "2", "info": "32", "warning": "33", "error": "31", "critical": "1;31"}


@dataclass(frozen=True, slots=True)
class LogRecord:
    """One line of the log."""

    stamp_ns: int
    """Time of writing by the run's clock, in nanoseconds since 1970."""
    level: str
    node: str
    event: str
    values: Mapping[str, Any]
    """The keyword values of the line."""
    process: str = ""
    """The process of the node; empty for the process that shows the line."""


Sink = Callable[[LogRecord], None]
Write = Callable[[str, str, Mapping[str, Any], Mapping[str, Any]], None]
"""Writes a line of one node: its level, its text, the values of its logger, and its own."""


class Logger:
    """A logger of one node. A line is a text and named values; `exc_info=error` adds what was raised, and where."""

    __slots__ = ("_values", "_write")

    def __init__(self, write: Write, values: Mapping[str, Any] = MappingProxyType({})) -> None:
        self._write, self._values = write, values

    def bind(self, **values: Any) -> Logger:
        """Return a logger whose lines have these values too."""
        return Logger(self._write, {**self._values, **values})

    def debug(self, event: str, /, **values: Any) -> None:
        """Write a line of the level debug."""
        self._write("debug", event, self._values, values)

    def info(self, event: str, /, **values: Any) -> None:
        """Write a line of the level info."""
        self._write("info", event, self._values, values)

    def warning(self, event: str, /, **values: Any) -> None:
        """Write a line of the level warning."""
        self._write("warning", event, self._values, values)

    def error(self, event: str, /, **values: Any) -> None:
        """Write a line of the level error."""
        self._write("error", event, self._values, values)

    def critical(self, event: str, /, **values: Any) -> None:
        """Write a line of the level critical."""
        self._write("critical", event, self._values, values)

    def exception(self, event: str, /, **values: Any) -> None:
        """Write a line of the level error, with the exception that is being handled."""
        self._write("error", event, self._values, {"exc_info": True, **values})

    warn = warning  # rclpy's names for both
    fatal = critical


class Log:
    """The log of the nodes of a run, with the number of lines per level."""

    def __init__(self, clock: Clock, *, level: str = "info", sinks: tuple[Sink, ...] = ()) -> None:
        """Create a log that writes to `sinks`, the run's own output; others may be added to the attribute."""
        self.sinks: list[Sink] = list(sinks)
        self._first = tuple(sinks)
        self.counts: dict[str, int] = dict.fromkeys(LEVELS, 0)
        self.lost: int = 0
        """The number of lines a sink failed to write: a closed stream, a full disk."""
        self.level = level
        """The lowest level that is written, where none is set for a node."""
        self._clock = clock
        self._levels: dict[str, str] = {}

    def bind(self, node: str, *, to_all: bool = True) -> Logger:
        """Return the logger of one node; without `to_all`, its lines go only to sinks added later."""
        return Logger(partial(self._write, node, to_all))

    def level_of(self, node: str) -> str:
        """Return the lowest level that is written of a node."""
        return self._levels.get(node, self.level)

    def set_level(self, node: str, level: str) -> None:
        """Set the lowest level that is written of a node, also for the loggers that it has already."""
        self._levels[node] = level

    def pass_on(self, record: LogRecord) -> None:
        """Write a line of another process, from any thread; it was filtered there."""
        self.counts[record.level] = self.counts.get(record.level, 0) + 1
        self._show(record)

    def _write(
        self, node: str, to_all: bool, level: str, event: str, bound: Mapping[str, Any], given: Mapping[str, Any]
    ) -> None:
        if LEVELS[level] < LEVELS[self.level_of(node)]:
            return
        values = {**bound, **given}
        values |= _raised(values.pop("exc_info", None))
        self.counts[level] += 1
        record = LogRecord(self._clock.now().nanoseconds, level, node, str(event), values)
        self._show(record, without=() if to_all else self._first)

    def _show(self, record: LogRecord, without: Sequence[Sink] = ()) -> None:
        for sink in [each for each in self.sinks if each not in without]:
            try:
                sink(record)
            except (OSError, ValueError):  # a stream that was closed is no fault of the node that writes
                self.lost += 1


def _raised(exc_info: object) -> dict[str, str]:
    """Return the exception of `exc_info` as text, with the line that raised it."""
    error: object = exc_info
    if exc_info is True:
        error = sys.exc_info()[1]
    elif isinstance(exc_info, tuple):
        error = cast("tuple[object, object, object]", exc_info)[1]
    if not isinstance(error, BaseException):
        return {}
    place = user_line(error)
    return {"error": reason(error), **({"at": str(place)} if place else {})}


def values_text(values: Mapping[str, object]) -> str:
    """Return the values of a line as text for people, safe for a terminal."""
    return "".join(f" {printable(name)}={printable(plain(value), limit=400)}" for name, value in values.items())


def console_sink(stream: TextIO, *, colour: bool) -> Sink:
    """Create a sink of lines for people: time of day (UTC), level, node, text, values."""

    def write(record: LogRecord) -> None:
        seconds, nanoseconds = divmod(record.stamp_ns, 1_000_000_000)
        time_of_day = f"{seconds // 3600 % 24:02}:{seconds // 60 % 60:02}:{seconds % 60:02}"
        level = f"{record.level:<8}"
        if colour:
            level = f"\x1b[{_COLOURS.get(record.level, '0')}m{level}\x1b[0m"
        node, text = printable(record.node), printable(record.event) + values_text(record.values)
        where = f"[{printable(record.process)}] " if record.process else ""
        stream.write(f"{time_of_day}.{nanoseconds // 1_000_000:03} {level} {where}{node}: {text}\n")
        stream.flush()

    return write


def json_sink(stream: TextIO) -> Sink:
    """Create a sink of JSON lines: `stamp_ns`, `level`, `node`, `event`, `process` if another one, and the values."""

    def write(record: LogRecord) -> None:
        line = {"stamp_ns": record.stamp_ns, "level": record.level, "node": record.node, "event": record.event}
        line |= {"process": record.process} if record.process else {}
        try:
            text = json.dumps({**record.values, **line}, default=str, allow_nan=False)
        except (TypeError, ValueError):  # a key, a circle or a NaN that JSON cannot express
            text = json.dumps({**{name: str(value) for name, value in record.values.items()}, **line})
        stream.write(text + "\n")
        stream.flush()

    return write
