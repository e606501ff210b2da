"""Look-up of a message type's description: from the run, else from definition files and busflow's own messages."""

from __future__ import annotations

from typing import TYPE_CHECKING

from busflow.errors import NoSuchTarget, UnknownType
from busflow.interfaces.encoding.builtin_types import builtin_types
from busflow.launchfile.model.interface_folders import library
from busflow.text import did_you_mean, printable

if TYPE_CHECKING:
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.wire.client.client import Peer


def known_type(peer: Peer, name: str, type_hash: str | None = None) -> ForeignType:
    """Return the type of this full name, such as `sensor_msgs/msg/Imu`, and of this hash if it is known.

    Raises:
        UnknownType: The run does not use it, no folder of definition files has it, and busflow does not bring it.
        InvalidDefinition: Its definition file has mistakes.
    """
    try:
        return peer.type(name, type_hash)
    except NoSuchTarget:
        files = library()
        if "/msg/" not in name and name in (*files.names, *builtin_types().names):
            raise UnknownType(
                f"{name} is {'an action' if '/action/' in name else 'a service'}; messages have a topic"
            ) from None
        if name not in files and name not in builtin_types():
            known = [each for each in (*files.names, *builtin_types().messages) if "/msg/" in each]
            raise UnknownType(f"no type {printable(name)!r}; {did_you_mean(name, known)}") from None
        found = files.foreign(name) if name in files else _own(name)
        if type_hash not in (None, found.type_hash):
            whose = "that of the definition files" if name in files else "busflow's"
            text = f"{printable(name)} is another version than {whose}, and the run does not say what it is"
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
