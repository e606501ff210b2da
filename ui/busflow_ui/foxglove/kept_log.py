"""Kept log: the last lines of a run's log as messages of `/rosout`, for viewers that connect later."""

from __future__ import annotations

from typing import TYPE_CHECKING

from busflow.clock import NS_PER_S

if TYPE_CHECKING:
    from busflow.cli.commands import ForeignType, Peer

ROSOUT = "/rosout"
_MOST = 1000
"""Most lines that a viewer is sent when it connects."""


def kept_log(peer: Peer, type_: ForeignType) -> dict[bytes, int]:
    """Return the kept lines, each encoded, with its stamp in nanoseconds, oldest first. Blocks until the run answers.

    The main process also has the lines of its machine's other processes: of the same lines one is returned.
    """
    found: dict[bytes, int] = {}
    for answer in peer.ask("log", count=_MOST):
        for line in answer["lines"]:
            sec, nanosec = divmod(line["stamp_ns"], NS_PER_S)
            values = {"level": line["level"], "name": line["node"], "msg": line["text"]}
            found[type_.encode({"stamp": {"sec": sec, "nanosec": nanosec}, **values})] = line["stamp_ns"]
    return dict(sorted(found.items(), key=lambda each: each[1])[-_MOST:])
