"""OpaqueMessage: a message whose type has no class here, and that is passed on as the bytes that it came as."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, cast

from busflow.interfaces.message import Message, UInt8Array

if TYPE_CHECKING:
    from busflow.interfaces.encoding.foreign import ForeignType


class OpaqueMessage(Message, package="busflow"):
    """Bytes of a type that is known by its description alone."""

    payload: UInt8Array

    if TYPE_CHECKING:  # pydantic would take them for fields
        foreign: ClassVar[ForeignType]


def opaque(foreign: ForeignType) -> type[OpaqueMessage]:
    """A class of messages of a type; another one each time, since a topic goes by the class."""
    made = type("Opaque", (OpaqueMessage,), {"__module__": __name__}, package="busflow")
    made.__ros_name__ = foreign.name
    cls = cast("type[OpaqueMessage]", made)
    type.__setattr__(cls, "foreign", foreign)
    return cls
