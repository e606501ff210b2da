"""Log messages and the levels of loggers."""

from collections.abc import Sequence
from typing import ClassVar

from busflow.interfaces.message import Message, ServiceType, uint8, uint32
from busflow.msgs.builtin_interfaces import Time


class Log(Message, package="rcl_interfaces"):
    """One line of a log, as published on `/rosout`."""

    DEBUG: ClassVar[uint8] = 10
    INFO: ClassVar[uint8] = 20
    WARN: ClassVar[uint8] = 30
    ERROR: ClassVar[uint8] = 40
    FATAL: ClassVar[uint8] = 50

    stamp: Time = Time()
    level: uint8 = 0
    """One of the constants."""
    name: str = ""
    """The logger."""
    msg: str = ""
    """The text."""
    file: str = ""
    """The source file that logged."""
    function: str = ""
    """The function that logged."""
    line: uint32 = 0
    """The line that logged."""


class LoggerLevel(Message, package="rcl_interfaces"):
    """From which level on a logger writes."""

    LOG_LEVEL_UNKNOWN: ClassVar[uint8] = 0
    LOG_LEVEL_DEBUG: ClassVar[uint8] = 10
    LOG_LEVEL_INFO: ClassVar[uint8] = 20
    LOG_LEVEL_WARN: ClassVar[uint8] = 30
    LOG_LEVEL_ERROR: ClassVar[uint8] = 40
    LOG_LEVEL_FATAL: ClassVar[uint8] = 50

    name: str = ""
    """The logger."""
    level: uint32 = 0
    """One of the constants."""


class SetLoggerLevelsResult(Message, package="rcl_interfaces"):
    """Whether a logger took its level."""

    successful: bool = False
    reason: str = ""
    """Why, or why not."""


class GetLoggerLevels(ServiceType, package="rcl_interfaces"):
    """Asks for the levels of loggers."""

    class Request(Message):
        """Which loggers."""

        names: Sequence[str] = ()

    class Response(Message):
        """Their levels."""

        levels: Sequence[LoggerLevel] = ()
        """In the order asked; LOG_LEVEL_UNKNOWN where none was set."""


class SetLoggerLevels(ServiceType, package="rcl_interfaces"):
    """Sets the levels of loggers."""

    class Request(Message):
        """The loggers and their levels."""

        levels: Sequence[LoggerLevel] = ()

    class Response(Message):
        """What came of each."""

        results: Sequence[SetLoggerLevelsResult] = ()
        """In the order asked."""
