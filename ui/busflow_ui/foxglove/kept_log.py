"""Kept log: the last lines of a run's log as messages of `/rosout`, for viewers that connect later."""

from __future__ import annotations

from typing import TYPE_CHECKING

from busflow.clock import NS_PER_S
from busflow.commands import kept_lines

if TYPE_CHECKING:
    from busflow.commands import ForeignType, Peer

ROSOUT = "/rosout"


def kept_log(peer: Peer, type_: ForeignType) -> dict[bytes, int]:
    """Return each kept line, encoded, with its stamp in nanoseconds, oldest first. Blocks until the run answers."""
    found: dict[bytes, int] = {}
    for line in kept_lines(peer):
        sec, nanosec = divmod(line["stamp_ns"], NS_PER_S)
        values = {"level": line["level"], "name": line["node"], "msg": line["text"]}
        found[type_.encode({"stamp": {"sec": sec, "nanosec": nanosec}, **values})] = line["stamp_ns"]
    return found
