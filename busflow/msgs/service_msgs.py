"""`service_msgs`: what is told about a call of a service, which the hash of each service's type includes."""

from typing import Annotated, ClassVar

from busflow.interfaces.message import CharArray, Length, Message, int64, uint8, zeros
from busflow.msgs.builtin_interfaces import Time

__all__ = ["ServiceEventInfo"]


class ServiceEventInfo(Message, package="service_msgs"):
    """One step of one call."""

    REQUEST_SENT: ClassVar[uint8] = 0
    REQUEST_RECEIVED: ClassVar[uint8] = 1
    RESPONSE_SENT: ClassVar[uint8] = 2
    RESPONSE_RECEIVED: ClassVar[uint8] = 3

    event_type: uint8 = 0
    """One of the constants."""
    stamp: Time = Time()
    client_gid: Annotated[CharArray, Length(16)] = zeros(16)
    """Which client called, as long as it runs."""
    sequence_number: int64 = 0
    """Which of the client's calls it was."""
