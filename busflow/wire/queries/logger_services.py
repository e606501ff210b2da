"""LoggerServices: ROS 2's two services to read and set the log level of a node, answered by its run's log.

A node has one logger, of its own name, written as in a graph (`/left/arm`) or as ROS 2 names loggers (`left.arm`).
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from busflow.interfaces.message import Message, ServiceType
from busflow.log import LEVELS
from busflow.msgs.rcl_interfaces import GetLoggerLevels, LoggerLevel, SetLoggerLevels, SetLoggerLevelsResult
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.log import Log

Answer = Callable[[Any], Awaitable[Message]]
NAMES = ("get_logger_levels", "set_logger_levels")
_WORDS: Mapping[int, str] = {number: word for word, number in LEVELS.items()}


class LoggerServices:
    """The logger services of one node."""

    def __init__(self, log: Log, node: str) -> None:
        self._log, self._node = log, node

    def all(self) -> Iterator[tuple[str, type[ServiceType], Answer]]:
        """Yield each service's final name, its type and its handler."""
        for name, service_type, answer in zip(
            NAMES, (GetLoggerLevels, SetLoggerLevels), (self.get, self.set), strict=True
        ):
            yield f"{self._node}/{name}", service_type, answer

    async def get(self, request: GetLoggerLevels.Request) -> GetLoggerLevels.Response:
        """Return the levels of loggers; that of a logger of another name is LOG_LEVEL_UNKNOWN."""
        level = LEVELS[self._log.level_of(self._node)]
        return GetLoggerLevels.Response(
            levels=[LoggerLevel(name=name, level=level if self._is_own(name) else 0) for name in request.names]
        )

    async def set(self, request: SetLoggerLevels.Request) -> SetLoggerLevels.Response:
        """Set the levels of loggers, each independently."""
        return SetLoggerLevels.Response(results=[self._set(each) for each in request.levels])

    def _set(self, wanted: LoggerLevel) -> SetLoggerLevelsResult:
        if not self._is_own(wanted.name):
            reason = f"the node has one logger, {self._node}, and none called {printable(wanted.name)}"
        elif wanted.level not in _WORDS:
            known = ", ".join(f"{number} ({word})" for number, word in _WORDS.items())
            reason = f"a level is one of {known}, not {wanted.level}"
        else:
            self._log.set_level(self._node, _WORDS[wanted.level])
            return SetLoggerLevelsResult(successful=True)
        return SetLoggerLevelsResult(successful=False, reason=reason)

    def _is_own(self, name: str) -> bool:
        return name.strip("/").replace("/", ".") == self._node.strip("/").replace("/", ".")
