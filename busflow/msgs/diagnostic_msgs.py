"""`diagnostic_msgs`: how the parts of a robot are doing."""

from collections.abc import Sequence
from typing import ClassVar

from busflow.interfaces.message import Message, ServiceType, byte
from busflow.msgs.std_msgs import Header

__all__ = ["AddDiagnostics", "DiagnosticArray", "DiagnosticStatus", "KeyValue", "SelfTest"]


class KeyValue(Message, package="diagnostic_msgs"):
    """A value worth watching, with its label."""

    key: str = ""
    value: str = ""


class DiagnosticStatus(Message, package="diagnostic_msgs"):
    """How one part is doing."""

    OK: ClassVar[byte] = 0
    WARN: ClassVar[byte] = 1
    ERROR: ClassVar[byte] = 2
    STALE: ClassVar[byte] = 3

    level: byte = 0
    """One of the constants."""
    name: str = ""
    """The part, or the test of it."""
    message: str = ""
    """What is the matter, for people."""
    hardware_id: str = ""
    """The very device: its serial number, for one."""
    values: Sequence[KeyValue] = ()


class DiagnosticArray(Message, package="diagnostic_msgs"):
    """How several parts are doing."""

    header: Header = Header()
    """`stamp` is when they were looked at."""
    status: Sequence[DiagnosticStatus] = ()


class AddDiagnostics(ServiceType, package="diagnostic_msgs"):
    """Asks the diagnostic aggregator for further analysers while it runs."""

    class Request(Message):
        """Which analysers."""

        load_namespace: str = ""
        """The namespace that holds their parameters, an absolute one: `/my_robot/analyzers`."""

    class Response(Message):
        """Whether it has them now."""

        success: bool = False
        message: str = ""
        """For people: why not, for one."""


class SelfTest(ServiceType, package="diagnostic_msgs"):
    """Asks a device to test itself."""

    class Request(Message):
        """Nothing."""

    class Response(Message):
        """What the tests found."""

        id: str = ""
        """The device."""
        passed: byte = 0
        """1 where all tests passed."""
        status: Sequence[DiagnosticStatus] = ()
        """Test by test."""
