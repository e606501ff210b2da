"""`service_msgs`: events of service calls, which the type hash of each service includes."""

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
    """The identifier of the calling client, valid while it runs."""
    sequence_number: int64 = 0
    """The number of the call within its client."""
