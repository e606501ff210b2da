"""Look-up of a message type's description: from the run, else from busflow's own messages."""

from __future__ import annotations

from typing import TYPE_CHECKING

from busflow.errors import NoSuchTarget, UnknownType
from busflow.interfaces.encoding.builtin_types import builtin_types
from busflow.text import did_you_mean, printable

if TYPE_CHECKING:
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.wire.client.client import Peer


def known_type(peer: Peer, name: str, type_hash: str | None = None) -> ForeignType:
    """Return the type of this full name, such as `sensor_msgs/msg/Imu`, and of this hash if it is known.

    Raises:
        UnknownType: The run does not use it and busflow does not bring it.
    """
    try:
        return peer.type(name, type_hash)
    except NoSuchTarget:
        if "/" not in name:
            known = builtin_types().messages
            raise UnknownType(f"no type {printable(name)!r}; {did_you_mean(name, known)}") from None
        found = _own(name)
        if type_hash not in (None, found.type_hash):
            text = f"{printable(name)} is another version than busflow's, and the run does not say what it is"
            raise UnknownType(text) from None
        return found


def _own(name: str) -> ForeignType:
    """Return one of busflow's own types. Its messages are imported only now, because that takes a while."""
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.interfaces.encoding.typesupport import TypeSupport
    from busflow.interfaces.message import Message, find_type

    found = find_type(name)
    if not issubclass(found, Message):
        raise UnknownType(f"{name} is a service; messages have a topic")
    support = TypeSupport(found)
    return ForeignType(support.name, support.type_hash, support.description)
