"""TypeServices: ROS 2's service by which a node describes types, so that others can read its messages."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterator
from typing import TYPE_CHECKING, Any

from busflow.interfaces.message import Message, ServiceType
from busflow.msgs.type_description_interfaces import GetTypeDescription, TypeDescription, TypeSource
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.bus.bus import Bus
    from busflow.interfaces.encoding.typesupport import TypeSupport

Answer = Callable[[Any], Awaitable[Message]]
NAME = "get_type_description"


class TypeServices:
    """The type description service of one node, which knows the types of all topics and services of its process."""

    def __init__(self, bus: Bus, supports: Callable[[type[Any]], TypeSupport], node: str) -> None:
        self._bus, self._supports, self._node = bus, supports, node

    def all(self) -> Iterator[tuple[str, type[ServiceType], Answer]]:
        """Yield the service's final name, its type and its handler."""
        yield f"{self._node}/{NAME}", GetTypeDescription, self.get

    async def get(self, request: GetTypeDescription.Request) -> GetTypeDescription.Response:
        """Describe the type of this name and hash; without a hash the only one of the name."""
        for support in self._known():
            if support.name == request.type_name and request.type_hash in ("", support.type_hash):
                return _described(support, sources=request.include_type_sources)
        wanted = f"{printable(request.type_name)} {printable(request.type_hash)}".rstrip()
        return GetTypeDescription.Response(failure_reason=f"no topic or service here has the type {wanted}")

    def _known(self) -> Iterator[TypeSupport]:
        yield from (self._supports(topic.type) for topic in self._bus.topics.values())
        for service in self._bus.services.values():
            yield from map(self._supports, (service.type, service.type.Request, service.type.Response))


def _described(support: TypeSupport, *, sources: bool) -> GetTypeDescription.Response:
    """Return the answer; a class in Python has no source in ROS 2's language, which has a word for that."""
    if not support.is_ros:
        return GetTypeDescription.Response(failure_reason=f"{support.name} is a type that ROS 2 cannot describe")
    description = TypeDescription.model_validate(
        {
            "type_description": _plain(support.description["type_description"]),
            "referenced_type_descriptions": [
                _plain(each) for each in support.description["referenced_type_descriptions"]
            ],
        }
    )
    names = [description.type_description, *description.referenced_type_descriptions] if sources else []
    return GetTypeDescription.Response(
        successful=True,
        type_description=description,
        type_sources=[TypeSource(type_name=each.type_name, encoding="dynamic") for each in names],
    )


def _plain(described: Any) -> dict[str, Any]:
    """Return what ROS 2 says of a type, without the constants that busflow adds."""
    return {"type_name": described["type_name"], "fields": described["fields"]}
