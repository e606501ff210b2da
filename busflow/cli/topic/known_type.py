"""Where a message type's description is found: the run says it, else busflow's own messages do."""

from __future__ import annotations

from typing import TYPE_CHECKING

from busflow.cli.joining import full_type
from busflow.errors import NoSuchTarget, UnknownType
from busflow.text import did_you_mean, printable
from busflow.wire.shipped import shipped_types

if TYPE_CHECKING:
    from busflow.wire.foreign import ForeignType
    from busflow.wire.peer import Peer


def known_type(peer: Peer, name: str) -> ForeignType:
    """The type of this name, `sensor_msgs/msg/Imu` or `sensor_msgs/Imu`.

    Raises:
        UnknownType: The run does not use it and busflow does not bring it.
    """
    full = full_type(name)
    try:
        return peer.type(full)
    except NoSuchTarget:
        if "/" not in full:
            known = shipped_types().messages
            raise UnknownType(f"no type {printable(full)!r}; {did_you_mean(full, known)}") from None
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
