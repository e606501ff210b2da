"""Where a message type's description is found: the run says it, else busflow's own messages do."""

from __future__ import annotations

from typing import TYPE_CHECKING

from busflow.errors import NoSuchTarget, UnknownType

if TYPE_CHECKING:
    from busflow.wire.foreign import ForeignType
    from busflow.wire.peer import Peer


def known_type(peer: Peer, name: str) -> ForeignType:
    """The type of this name, `sensor_msgs/msg/Imu` or `sensor_msgs/Imu`.

    Raises:
        UnknownType: The run does not use it and busflow does not bring it.
    """
    full = name.replace("/", "/msg/") if name.count("/") == 1 else name
    try:
        return peer.type(full)
    except NoSuchTarget:
        return _own(full)


def _own(name: str) -> ForeignType:
    """A type that busflow brings; only now are its messages imported, which takes a while."""
    from busflow.message import Message, find_type
    from busflow.wire.foreign import ForeignType
    from busflow.wire.typesupport import TypeSupport

    found = find_type(name)
    if not issubclass(found, Message):
        raise UnknownType(f"{name} is a service; messages have a topic")
    support = TypeSupport(found)
    return ForeignType(support.name, support.type_hash, support.description)
