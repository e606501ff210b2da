"""Names that ROS 2 gives to topics, services and types in DDS, and the user data of its endpoints.

Source: ros2/rmw_cyclonedds, `rmw_node.cpp` and `namespace_prefix.hpp`; ros2/rmw_dds_common, `qos.cpp`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from busflow.bus.names import full_topic_name_fault
from busflow.errors import MalformedMessage
from busflow.text import printable
from busflow.wire.zenoh.keys import ros_type

_CYCLONE = b"\x01\x10"
"""Cyclone's number among the implementations of DDS, by which each of its gids begins; Fast DDS has 01 0F."""
_MOST_USER_DATA = 4096
"""Bytes of user data that are read; ROS 2 writes about a hundred and fifty."""


class NameUse(StrEnum):
    """The use of a topic in DDS; the value is its prefix."""

    TOPIC = "rt"
    REQUEST = "rq"
    REPLY = "rr"


_SUFFIXES = {NameUse.TOPIC: "", NameUse.REQUEST: "Request", NameUse.REPLY: "Reply"}


@dataclass(frozen=True, slots=True)
class DdsName:
    """The name of a topic or service of ROS 2, and what its topic in DDS carries."""

    use: NameUse
    name: str
    """The full name of the topic or service, as ROS 2 has it."""

    def __str__(self) -> str:
        """Return the name of the topic in DDS.

        >>> str(DdsName(NameUse.TOPIC, "/imu/data")), str(DdsName(NameUse.REPLY, "/add"))
        ('rt/imu/data', 'rr/addReply')
        """
        return f"{self.use}{self.name}{_SUFFIXES[self.use]}"

    @classmethod
    def parse(cls, text: str) -> DdsName | None:
        """Parse the name of a topic in DDS; None for one that is not ROS 2's.

        Raises:
            MalformedMessage: it has ROS 2's prefix, and no name that ROS 2 would allow.
        """
        prefix, slash, rest = text.partition("/")
        if prefix not in set(NameUse) or not slash:
            return None
        use = NameUse(prefix)
        suffix = _SUFFIXES[use]
        if not rest.endswith(suffix):
            return None
        name = f"/{rest.removesuffix(suffix)}"
        if (fault := full_topic_name_fault(name)) is not None:
            raise MalformedMessage(f"{printable(text, limit=100)} is no name of a topic: {fault.message}")
        return cls(use, name)


def type_of(dds_type: str) -> str:
    """Return ROS 2's name of a type in DDS.

    Raises:
        MalformedMessage: it has none.
    """
    try:
        return ros_type(dds_type)
    except ValueError:
        raise MalformedMessage(f"{printable(dds_type, limit=100)} is no type of ROS 2") from None


def user_data(**values: str) -> bytes:
    """Return the user data of a participant or endpoint.

    >>> user_data(enclave="/")
    b'enclave=/;'
    """
    return "".join(f"{key}={value};" for key, value in values.items() if value).encode()


def read_user_data(data: bytes) -> Mapping[str, str]:
    """Read user data, of which no more than 4096 bytes; what is not `key=value;` is left out."""
    pairs = (part.partition("=") for part in data[:_MOST_USER_DATA].decode("ascii", errors="replace").split(";"))
    return {key: value for key, equals, value in pairs if equals}


def service_end_id(participant: bytes, number: int) -> str:
    """Return the text by which a client or server says which reader and writer are its own.

    >>> service_end_id(bytes.fromhex("0110aabbccddeeff00112233000001c1"), 3)
    ' 1.10.aa.bb.cc.dd.ee.ff.0.11.22.33.0.0.0.3'
    """
    first, *rest = participant[:12] + number.to_bytes(4, "big")
    return f"{first:2x}" + "".join(f".{each:x}" for each in rest)


def is_of_cyclone(gid: bytes) -> bool:
    """Return whether a participant or endpoint is one of Cyclone DDS.

    >>> is_of_cyclone(bytes.fromhex("0110aabbccddeeff00112233000001c1"))
    True
    """
    return gid.startswith(_CYCLONE)
