"""Doubts: what nobody can know of a graph until the mistakes in its launch file are mended."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum

from busflow.errors import KeyPath


class Doubt(StrEnum):
    """What is not known."""

    NODES = "nodes"  # which there are, and by which names they meet
    PLUGINS = "plugins"  # where they are
    PARAMETERS = "parameters"  # which are stated
    QOS = "qos"


_NAMELESS = {"name", "args", "env", "clock", "seed", "record", "expect", "shutdown", "processes", "machines", "network"}
"""Keys of a launch file that decide neither which nodes there are nor how they are connected."""
_OWN = {"restart", "depends_on", "on_exit", "process", "machine"}
"""The like of a node."""


def doubts(left_out: Iterable[KeyPath]) -> frozenset[Doubt]:
    """What is left open where these keys of a launch file are not known."""
    return frozenset(found for path in left_out if (found := _doubt(path)) is not None)


def _doubt(path: KeyPath) -> Doubt | None:
    steps = [str(step) for step in path]
    while steps[:1] == ["groups"] and len(steps) > 2:  # whose keys are those of a file
        steps = steps[2:]
    head = steps[0] if steps else ""
    if head in _NAMELESS or head == "profiles" or head.startswith("x-"):  # one that is chosen is in the file's own keys
        return None
    if head == "plugins":
        return Doubt.PLUGINS
    key = steps[1] if head == "defaults" and len(steps) > 1 else steps[2] if head == "nodes" and len(steps) > 2 else ""
    if head in {"qos", "topics"} or key in {"publishers", "subscriptions"}:
        return Doubt.QOS
    if key in {"parameters", "parameters_from"}:
        return Doubt.PARAMETERS
    return None if key in _OWN else Doubt.NODES
