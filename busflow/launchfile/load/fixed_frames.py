"""The node that publishes `frames:` of a launch file, which have to make a tree."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from busflow.launchfile.model.description import NodeSpec
from busflow.launchfile.model.problems import Problems, key_origin, problem_at
from busflow.launchfile.yaml.value import Value
from busflow.text import printable

_NAME = "static_frames"
"""The plugin that publishes them, and the name of its node."""


def frames_nodes(stated: Value | None, problems: Problems) -> tuple[NodeSpec, ...]:
    """Return the node of the frames, if there are any; report those that make no tree."""
    if stated is None or not stated.members:
        return ()
    parents: dict[str, tuple[str, Value]] = {}
    for parent, below in stated.members.items():
        for child, value in below.members.items():
            _add(parents, parent, child, value, problems)
    origin = key_origin(stated)
    parameters = replace(stated, content={"frames": stated})
    return (NodeSpec(_NAME, "/", origin, _NAME, plugin_origin=origin, parameters=parameters),)


def _add(parents: dict[str, tuple[str, Value]], parent: str, child: str, value: Value, problems: Problems) -> None:
    """Add an edge, or report why it cannot be one."""
    origin, edge = key_origin(value), f"{printable(parent)} → {printable(child)}"
    if child in parents:
        first, other = parents[child]
        message = f"the frame {printable(child)} has two parents, {printable(first)} and {printable(parent)}"
        fix = f"leave one out; the first is {key_origin(other)}"
        problems.add(problem_at("two-parents", message, fix, origin), left_out=())
    elif loop := _loop(parents, parent, child):
        message = f"{edge} closes a loop of frames: {' → '.join(map(printable, loop))}"
        fix = "leave one of these out: a frame has one way up"
        problems.add(problem_at("frame-loop", message, fix, origin), left_out=())
    else:
        parents[child] = (parent, value)


def _loop(parents: Mapping[str, tuple[str, Value]], parent: str, child: str) -> list[str]:
    """Return the frames of the loop that an edge would close, from the child to the child; none if it closes none."""
    path = [parent]
    while path[-1] != child:
        if path[-1] not in parents:
            return []
        path.append(parents[path[-1]][0])
    return [*reversed(path), child] if len(path) > 1 else [child, child]
