"""`Doubt`: a fact about a graph that is unknown until the mistakes in its launch file are corrected."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum

from busflow.errors import KeyPath


class Doubt(StrEnum):
    """Unknown part of a graph; checks that need it are left out."""

    NODES = "nodes"  # the set of nodes, and the names of their endpoints
    PLUGINS = "plugins"  # their folders
    PARAMETERS = "parameters"  # the stated ones
    QOS = "qos"
    PROGRAMS = "programs"  # the set of programs, on which nodes may depend


_NAMELESS = {
    "name",
    "args",
    "env",
    "clock",
    "frames",
    "packages",
    "seed",
    "record",
    "expect",
    "shutdown",
    "processes",
    "machines",
    "network",
}
"""Keys of a launch file that change neither the set of nodes nor their connections."""
_OWN = {"restart", "depends_on", "on_exit", "process", "machine"}
"""Keys of a node that change neither."""


def doubts(left_out: Iterable[KeyPath]) -> frozenset[Doubt]:
    """Return the doubts that follow if these keys of a launch file are unknown."""
    return frozenset(found for path in left_out if (found := _doubt(path)) is not None)


def _doubt(path: KeyPath) -> Doubt | None:
    steps = [str(step) for step in path]
    while steps[:1] == ["groups"] and len(steps) > 2:  # a group has the keys of a file
        steps = steps[2:]
    head = steps[0] if steps else ""
    # A chosen profile is already merged into the file's own keys.
    if head in _NAMELESS or head == "profiles" or head.startswith("x-"):
        return None
    if head in {"plugins", "programs"}:
        return Doubt(head)
    key = steps[1] if head == "defaults" and len(steps) > 1 else steps[2] if head == "nodes" and len(steps) > 2 else ""
    if head in {"qos", "topics"} or key in {"publishers", "subscriptions"}:
        return Doubt.QOS
    if key in {"parameters", "parameters_from"}:
        return Doubt.PARAMETERS
    return None if key in _OWN else Doubt.NODES
