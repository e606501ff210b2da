"""Node lists: the messages in which a participant lists its nodes, on the topic `ros_discovery_info`.

Source: ros2/rmw_dds_common 3.2, `ParticipantEntitiesInfo.msg` and those within it. Before ROS 2 Iron a gid had 24
bytes there; such a list is not read.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from busflow.bus.names import namespace_fault, node_name_fault
from busflow.errors import MalformedMessage
from busflow.interfaces.encoding.description import Count, Field, assemble, individual, rihs01
from busflow.interfaces.encoding.foreign import ForeignType
from busflow.text import printable
from busflow.wire.zenoh.qos_text import WireQoS

TOPIC = "ros_discovery_info"
WRITTEN = WireQoS(durability="transient_local", depth=1)
READ = WireQoS(durability="transient_local", history="keep_all")
_MOST_NODES = 1000
"""Nodes of one participant that are read."""
_LIST, _NODE, _GID = (f"rmw_dds_common/msg/{each}" for each in ("ParticipantEntitiesInfo", "NodeEntitiesInfo", "Gid"))
_FIELDS = {
    _GID: [Field("data", "uint8", count=Count.FIXED, size=16)],
    _NODE: [
        Field("node_namespace", "string", string_bound=256),
        Field("node_name", "string", string_bound=256),
        Field("reader_gid_seq", _GID, nested=True, count=Count.UNBOUNDED),
        Field("writer_gid_seq", _GID, nested=True, count=Count.UNBOUNDED),
    ],
    _LIST: [
        Field("gid", _GID, nested=True),
        Field("node_entities_info_seq", _NODE, nested=True, count=Count.UNBOUNDED),
    ],
}


@dataclass(frozen=True, slots=True)
class ListedNode:
    """A node with the gids of its readers and writers."""

    namespace: str
    name: str
    readers: frozenset[bytes] = frozenset()
    writers: frozenset[bytes] = frozenset()

    @property
    def full_name(self) -> str:
        """The node's full name."""
        return f"{self.namespace.rstrip('/')}/{self.name}"


def node_list_type() -> ForeignType:
    """Return the type of a node list."""
    types = {name: individual(name, [field.describe() for field in fields]) for name, fields in _FIELDS.items()}
    description = assemble(_LIST, types)
    return ForeignType(_LIST, rihs01(description), description)


def encode_nodes(type_: ForeignType, participant: bytes, nodes: Iterable[ListedNode]) -> bytes:
    """Return the message that lists the nodes of a participant."""
    listed = [
        {
            "node_namespace": node.namespace,
            "node_name": node.name,
            "reader_gid_seq": [_gid(each) for each in sorted(node.readers)],
            "writer_gid_seq": [_gid(each) for each in sorted(node.writers)],
        }
        for node in nodes
    ]
    return type_.encode({"gid": _gid(participant), "node_entities_info_seq": listed})


def decode_nodes(type_: ForeignType, payload: bytes) -> tuple[bytes, list[ListedNode]]:
    """Return the gid of a participant, and its nodes.

    Raises:
        MalformedMessage: the bytes are no node list, a name is none of a node, or the nodes are too many.
    """
    found = type_.decode(payload)
    listed = found["node_entities_info_seq"]
    if len(listed) > _MOST_NODES:
        raise MalformedMessage(f"a participant lists {len(listed)} nodes; {_MOST_NODES} at most are read")
    return _bytes(found["gid"]), [_node(each) for each in listed]


def _node(listed: Any) -> ListedNode:
    namespace, name = listed["node_namespace"], listed["node_name"]
    if (fault := namespace_fault(namespace) or node_name_fault(name)) is not None:
        named = printable(f"{namespace} {name}", limit=100)
        raise MalformedMessage(f"{named} is no namespace and name of a node: {fault.message}")
    readers, writers = (frozenset(map(_bytes, listed[key])) for key in ("reader_gid_seq", "writer_gid_seq"))
    return ListedNode(namespace, name, readers, writers)


def _gid(gid: bytes) -> dict[str, list[int]]:
    return {"data": list(gid)}


def _bytes(gid: Any) -> bytes:
    return bytes(gid["data"])
