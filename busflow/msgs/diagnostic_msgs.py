"""`diagnostic_msgs`: the condition of the parts of a robot."""

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
    """The condition of one part."""

    OK: ClassVar[byte] = 0
    WARN: ClassVar[byte] = 1
    ERROR: ClassVar[byte] = 2
    STALE: ClassVar[byte] = 3

    level: byte = 0
    """One of the constants."""
    name: str = ""
    """The part, or the test of it."""
    message: str = ""
    """The condition as text for people."""
    hardware_id: str = ""
    """The identity of the device, for example its serial number."""
    values: Sequence[KeyValue] = ()


class DiagnosticArray(Message, package="diagnostic_msgs"):
    """The condition of several parts."""

    header: Header = Header()
    """`stamp` is the time of the check."""
    status: Sequence[DiagnosticStatus] = ()


class AddDiagnostics(ServiceType, package="diagnostic_msgs"):
    """Asks the diagnostic aggregator for further analysers while it runs."""

    class Request(Message):
        """The analysers to load."""

        load_namespace: str = ""
        """The namespace that holds their parameters, an absolute one: `/my_robot/analyzers`."""

    class Response(Message):
        """Whether it has loaded them."""

        success: bool = False
        message: str = ""
        """Text for people, for example why not."""


class SelfTest(ServiceType, package="diagnostic_msgs"):
    """Asks a device to test itself."""

    class Request(Message):
        """Nothing."""

    class Response(Message):
        """The results of the tests."""

        id: str = ""
        """The device."""
        passed: byte = 0
        """1 where all tests passed."""
        status: Sequence[DiagnosticStatus] = ()
        """Test by test."""
