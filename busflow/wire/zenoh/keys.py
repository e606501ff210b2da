"""Keys: Zenoh's key expressions for a graph, exactly those of ROS 2's `rmw_zenoh`, whose nodes can so take part.

A topic's messages travel under the key `<domain>/<name>/<type>/<hash>`. Every node and endpoint has a liveliness token
under `@ros2_lv/`, which describes it and disappears with its process; the graph is the set of tokens. Each message
carries an attachment of 33 bytes.

Source: ros2/rmw_zenoh, `liveliness_utils.cpp`, `attachment_helpers.cpp`, as of 0.10.5.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import NamedTuple

from busflow.errors import MalformedMessage

DOMAIN = 0
GRAPH = "@ros2_lv"
QUERY_PREFIX = "@busflow/1"
"""Queries to the processes of a run travel under `@busflow/1/<process>/<query>`."""
READ_ONLY_QUERIES = (
    *("run", "report", "graph", "types", "services", "history", "measure"),
    *("parameters", "parameter_changes", "log"),
)
"""Queries that do not change the run: a client with the right to read may send them."""
PATIENCE = "timeout"
"""Name of a query parameter: the seconds that a caller waits for a service's answer."""
REMARKS = "remarks"
"""Name of a query parameter of busflow's action clients: they read a text behind the attachment of an answer.

With the value 2 a zero byte follows, and in digits how many feedback messages precede a result.
"""
_GID_BYTES = 16
_ATTACHMENT = struct.Struct(f"<qqB{_GID_BYTES}s")
SEQUENCE = struct.Struct("<q")
"""The first field of an attachment."""
ATTACHMENT_BYTES = _ATTACHMENT.size
MOST_MISSING = 2**31 - 1
"""Limit of the numbers missing between two messages of a publisher, as in ROS 2; beyond it, it counts anew."""
GID_AT = 17
"""Offset of the gid in an attachment; the gid is its last field."""
_NO_HASH = "RIHS01_" + "0" * 64
HUMBLE = "TypeHashNotSupported"
"""What `rmw_zenoh` 0.1 of ROS 2 Humble, which has no hashes of types, writes in place of one, in keys too."""
_MOST_CHARACTERS = 255
"""Length of the longest name of a topic, type or node in DDS, and so in ROS 2. The time to match grows with it."""


_NAMED = 13
"""Number of a token's fields up to the QoS; what a later version of ROS 2 appends has no such limit."""


class TokenKind(StrEnum):
    """The kind of node or endpoint that a token stands for."""

    NODE = "NN"
    PUBLISHER = "MP"
    SUBSCRIPTION = "MS"
    SERVICE = "SS"
    CLIENT = "SC"


@dataclass(frozen=True, slots=True)
class Token:
    """One liveliness token: it shows a node, or an endpoint of a node."""

    session: str
    """Id of the Zenoh session, and so of the process, as a hexadecimal number."""
    node_id: int
    entity_id: int
    kind: TokenKind
    namespace: str
    node: str
    topic: str = ""
    """The final name of a topic or service; empty for a node."""
    type: str = ""
    """The type, such as `sensor_msgs/msg/Imu`; empty for a node."""
    hash: str = ""
    qos: str = ""
    """The QoS in the short form of `rmw_zenoh` (`qos_text`)."""
    enclave: str = "/"
    domain: int = DOMAIN
    newer: tuple[str, ...] = ()
    """What a later version of ROS 2 says after the QoS; it belongs to what the gid identifies."""

    @property
    def node_name(self) -> str:
        """The node's full name."""
        return f"{self.namespace.rstrip('/')}/{self.node}"

    @property
    def known_hash(self) -> str | None:
        """The hash of its type; None if the token has none."""
        return None if self.hash in ("", _NO_HASH, HUMBLE) else self.hash

    def has_type(self, name: str, type_hash: str) -> bool:
        """Return whether the endpoint is of this type; where ROS 2 Humble states no hash, the name decides."""
        return self.type == name and self.hash in (type_hash, HUMBLE)

    def __str__(self) -> str:
        fields = [str(self.domain), self.session, str(self.node_id), str(self.entity_id), self.kind.value]
        fields += [_mangled(self.enclave), _mangled(self.namespace), _mangled(self.node)]
        if self.kind is not TokenKind.NODE:
            fields += [_mangled(self.topic), dds_type(self.type), self.hash or _NO_HASH, self.qos, *self.newer]
        return "/".join([GRAPH, *fields])

    @property
    def gid(self) -> bytes:
        """The endpoint's gid: sixteen bytes that identify it in each of its messages, as ROS 2 makes them."""
        from xxhash import xxh3_128_digest  # most commands of a terminal need no gid

        return xxh3_128_digest(str(self).encode())[::-1]

    @classmethod
    def parse(cls, text: str) -> Token:
        """Parse a key expression.

        Raises:
            MalformedMessage: it is not a token.
        """
        try:
            return cls._of_fields(text.split("/"))
        except ValueError as error:
            raise MalformedMessage(f"{text[:500]!r} is not a token of a ROS 2 graph: {error}") from None

    @classmethod
    def _of_fields(cls, fields: list[str]) -> Token:
        graph, domain, session, node_id, entity_id, kind, enclave, namespace, node, *rest = fields
        if graph != GRAPH:
            raise ValueError(f"it does not begin with {GRAPH}")
        if any(len(each) > _MOST_CHARACTERS for each in fields[:_NAMED]):
            raise ValueError(f"a part of it has more than {_MOST_CHARACTERS} characters")
        found = cls(
            session=session,
            node_id=int(node_id),
            entity_id=int(entity_id),
            kind=TokenKind(kind),
            namespace=_plain(namespace),
            node=_plain(node).strip("/"),
            enclave=_plain(enclave),
            domain=int(domain),
        )
        if found.kind is TokenKind.NODE:
            return found
        topic, type_name, type_hash, qos, *newer = rest
        words = {"topic": _plain(topic), "type": ros_type(type_name), "hash": type_hash, "qos": qos}
        return replace(found, **words, newer=tuple(newer))


class Attachment(NamedTuple):
    """Metadata sent with each message. A named tuple, because one is made and read for every message."""

    sequence: int
    """Number of the message, counted by its publisher from 1; a gap is a loss."""
    stamp_ns: int
    gid: bytes

    def encode(self) -> bytes:
        """Return the 33 bytes."""
        return attachment_bytes(self.sequence, self.stamp_ns, self.gid)

    @classmethod
    def decode(cls, data: bytes) -> Attachment:
        """Decode bytes from another process.

        Raises:
            MalformedMessage: they are not an attachment.
        """
        if len(data) != _ATTACHMENT.size or data[16] != _GID_BYTES:
            raise MalformedMessage(f"an attachment has 33 bytes, the 17th being 16; got {len(data)} bytes")
        sequence, stamp_ns, _, gid = _ATTACHMENT.unpack(data)
        return cls(sequence, stamp_ns, gid)


def attachment_bytes(sequence: int, stamp_ns: int, gid: bytes) -> bytes:
    """Return the 33 bytes of an attachment without making an `Attachment`."""
    return _ATTACHMENT.pack(sequence, stamp_ns, _GID_BYTES, gid)


def topic_key(topic: str, type_name: str, type_hash: str, *, domain: int = DOMAIN) -> str:
    """Return the key under which a topic's messages travel.

    >>> topic_key("/chatter", "std_msgs/msg/String", "RIHS01_df66")
    '0/chatter/std_msgs::msg::dds_::String_/RIHS01_df66'
    """
    return f"{domain}/{topic.strip('/')}/{dds_type(type_name)}/{type_hash}"


def dds_type(type_name: str) -> str:
    """Return the DDS spelling of a ROS type name.

    >>> dds_type("std_srvs/srv/Trigger")
    'std_srvs::srv::dds_::Trigger_'
    """
    package, kind, name = type_name.split("/")
    return f"{package}::{kind}::dds_::{name}_"


def ros_type(dds_name: str) -> str:
    """Return the ROS type name of a DDS spelling.

    >>> ros_type("std_msgs::msg::dds_::String_")
    'std_msgs/msg/String'
    """
    package, kind, _, name = dds_name.split("::")
    return f"{package}/{kind}/{name.removesuffix('_')}"


def _mangled(name: str) -> str:
    """Return a name as one field of a token: slashes become percent signs, an empty name one percent sign."""
    return name.replace("/", "%") or "%"


def _plain(field: str) -> str:
    """Return the name in a field of a token."""
    return f"/{field.replace('%', '/').strip('/')}"


def split_name(full_name: str) -> tuple[str, str]:
    """Split a node's full name into namespace and name.

    >>> split_name("/left/arm"), split_name("/imu")
    (('/left', 'arm'), ('/', 'imu'))
    """
    namespace, _, node = full_name.rpartition("/")
    return namespace or "/", node
