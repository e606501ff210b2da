"""Identifiers of goals: drawn from the run's seed on virtual time, otherwise random."""

from __future__ import annotations

import hashlib
import os
import uuid
from typing import TYPE_CHECKING, Any

from busflow.msgs import unique_identifier_msgs

if TYPE_CHECKING:
    from busflow.bus.endpoint import ServiceEndpoint
    from busflow.node.context import Surroundings


class Identifiers:
    """The identifiers of one client's goals: the same ones in every run with the same seed, if its time is virtual."""

    def __init__(self, surroundings: Surroundings, endpoint: ServiceEndpoint) -> None:
        self._prefix = (
            f"{surroundings.seed} {surroundings.life} {endpoint.node} {endpoint.origin} {endpoint.service}"
            if surroundings.clock.kind == "sim"
            else None
        )
        self._drawn = 0

    def draw(self) -> unique_identifier_msgs.UUID:
        """Return the identifier of one more goal as ROS 2's message: by its bits a random UUID."""
        self._drawn += 1
        if self._prefix is None:
            drawn = os.urandom(16)
        else:
            drawn = hashlib.blake2b(f"{self._prefix} {self._drawn}".encode(), digest_size=16).digest()
        octets = bytearray(drawn)  # `uuid.UUID(bytes=drawn, version=4).bytes` takes four times as long
        octets[6] = octets[6] & 0x0F | 0x40
        octets[8] = octets[8] & 0x3F | 0x80
        return unique_identifier_msgs.UUID(uuid=bytes(octets))


def key_of(message: Any) -> bytes:
    """Return what a `unique_identifier_msgs/msg/UUID` is looked up by: a UUID's own hash takes as long as making it."""
    return message.uuid.tobytes()


def from_message(message: Any) -> uuid.UUID:
    """Return the identifier in a `unique_identifier_msgs/msg/UUID`."""
    return uuid.UUID(bytes=message.uuid.tobytes())
