"""What a graph is made of: launch files, their descriptions, node classes, instances."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

from busflow.errors import InvalidDeclaration
from busflow.launchfile.description import ClockMode, LaunchDescription
from busflow.node import Node

What: TypeAlias = str | Path | LaunchDescription | Node | type[Node]


def described(what: str | Path | LaunchDescription, args: Mapping[str, object] | None) -> LaunchDescription:
    """The description that a launch file holds, or that is given.

    Raises:
        LaunchError: the file cannot be read, with every problem.
    """
    if isinstance(what, LaunchDescription):
        return what
    from busflow.launchfile.load import load

    return load(Path(what), args=args or {})


def instance(what: Any) -> Node:
    """The node that is given, or one of the class that is.

    Raises:
        InvalidDeclaration: it is neither.
    """
    if isinstance(what, Node):
        return what
    if isinstance(what, type) and issubclass(what, Node):
        return what()
    raise InvalidDeclaration(f"a graph is made of launch files, Node classes and instances, not {what!r}")


def is_simulated(description: LaunchDescription) -> bool:
    """Whether a launch file asks for simulated time."""
    return description.clock.mode is not ClockMode.SYSTEM
