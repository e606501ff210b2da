"""Look-up of types by name: from the run, else from definition files and busflow's own types."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from busflow.actions.names import action_type_of
from busflow.definitions.folders import library
from busflow.errors import NoSuchTarget, UnknownType
from busflow.interfaces.encoding.builtin_types import builtin_types
from busflow.text import did_you_mean, printable
from busflow.wire.zenoh.keys import HUMBLE

if TYPE_CHECKING:
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.wire.client.client import Peer, ServiceKind
    from busflow.wire.client.graph_view import TopicView


def known_type(peer: Peer, name: str, type_hash: str | None = None, *, definition: str = "") -> ForeignType:
    """Return the message type of this full name, such as `sensor_msgs/msg/Imu`, and of this hash if it is known.

    Args:
        peer: A client of the run.
        name: The name.
        type_hash: The hash.
        definition: Its text as ROS 2 writes it, of which the type is made if nothing else knows it.

    Raises:
        UnknownType: The run does not use it, no folder of definition files has it, and busflow does not bring it.
        InvalidDefinition: Its definition file has mistakes.
        MalformedMessage: The definition has.
    """
    try:
        return peer.type(name, type_hash)
    except NoSuchTarget:
        files = library()
        if "/msg/" not in name and name in (*files.names, *builtin_types().names):
            raise UnknownType(
                f"{name} is {'an action' if '/action/' in name else 'a service'}; messages have a topic"
            ) from None
        found = files.foreign(name) if name in files else _shipped(name) or _defined(name, definition)
        _require_version(name, type_hash, found.type_hash)
        return found


def known_service(peer: Peer, service: TopicView) -> ServiceKind:
    """Return the types of a service of the run, which a program may answer that is not busflow's.

    Raises:
        UnknownType: As `known_type`.
        InvalidDefinition: Its definition file has mistakes.
    """
    try:
        found = peer.service(service.name)
    except NoSuchTarget:
        name, type_hash = service.kinds[0]
        found = installed_service(service.name, name)
        if found is None:
            known = [*(each for each in library().names if "/srv/" in each), *builtin_types().services]
            near = f"{did_you_mean(name, known)}; --interfaces DIR adds types"
            raise UnknownType(f"the run does not say what {printable(name)} is; {near}") from None
        _require_version(name, type_hash, found.hash)
    is_of_humble = bool(service.publishers) and all(each.token.hash == HUMBLE for each in service.publishers)
    return replace(found, hash=HUMBLE) if is_of_humble else found


def installed_service(service: str, name: str) -> ServiceKind | None:
    """Return a service whose type of this name definition files have, or busflow itself; None if it is in neither.

    Raises:
        InvalidDefinition: Its definition file has mistakes.
    """
    from busflow.interfaces.encoding.description import rihs01
    from busflow.interfaces.encoding.typesupport import TypeSupport
    from busflow.interfaces.message import ServiceType
    from busflow.wire.client.client import ServiceKind

    files = library()
    if name in files:
        halves = files.foreign(f"{name}_Request"), files.foreign(f"{name}_Response")
        return ServiceKind(service, name, rihs01(files.description(name)), *halves)
    own = _class_of(name)
    if own is None or not issubclass(own, ServiceType):
        return None
    return ServiceKind(service, name, TypeSupport(own).type_hash, _foreign(own.Request), _foreign(own.Response))


def _require_version(name: str, wanted: str | None, found: str) -> None:
    if wanted not in (None, found):
        whose = "that of the definition files" if name in library() else "busflow's"
        text = f"{printable(name)} is another version than {whose}, and the run does not say what it is"
        raise UnknownType(text) from None


def _shipped(name: str) -> ForeignType | None:
    """Return one of busflow's own types; None if this is not one."""
    found = _class_of(name)
    return None if found is None else _foreign(found)


def _class_of(name: str) -> Any:
    """Return the class of one of busflow's own types, or None. They are imported only now: that takes a while."""
    from busflow.interfaces.action import derived_types
    from busflow.interfaces.message import find_type, type_name

    action = action_type_of(name)
    if action in builtin_types().actions:
        whole: Any = find_type(action)
        return next(each for each in derived_types(whole) if type_name(each) == name)
    return find_type(name) if name in builtin_types() or name in builtin_types().services else None


def _foreign(cls: Any) -> ForeignType:
    """Return the type of a class, for reading and writing without the class."""
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.interfaces.encoding.typesupport import TypeSupport

    support = TypeSupport(cls)
    return ForeignType(support.name, support.type_hash, support.description)


def _defined(name: str, text: str) -> ForeignType:
    """Return a type that nothing but its definition describes."""
    from busflow.definitions.field_type import UnreadableType, read_type
    from busflow.definitions.recorded import parse
    from busflow.interfaces.encoding.description import rihs01
    from busflow.interfaces.encoding.foreign import ForeignType

    if not text:
        known = [each for each in (*library().names, *builtin_types().messages) if "/msg/" in each]
        raise UnknownType(f"no type {printable(name)!r}; {did_you_mean(name, known)}") from None
    with suppress(UnreadableType):
        if "/msg/" in name and read_type(name, "").base == name:
            described = parse(name, text)
            return ForeignType(name, rihs01(described), described)
    raise UnknownType(f"{printable(name, limit=200)!r} is no name of a message type; write package/msg/Type") from None
