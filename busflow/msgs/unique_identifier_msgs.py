"""`unique_identifier_msgs`: 1 message, from its definition files."""

# busflow interface generate unique_identifier_msgs --to busflow/msgs
# wrote this from unique_identifier_msgs 2.7.0 (BSD). The comments of its files are left out. The files:
#   msg/UUID.msg  RIHS01_1b8e8aca958cbea28fe6ef60bf6c19b683c97a9ef60bb34752067d0f2f7ab437

from typing import Annotated

from busflow.interfaces.message import Length, Message, UInt8Array, zeros

__all__ = ["UUID"]


class UUID(Message, package="unique_identifier_msgs"):
    """The message `unique_identifier_msgs/msg/UUID`."""

    uuid: Annotated[UInt8Array, Length(16)] = zeros(16)
