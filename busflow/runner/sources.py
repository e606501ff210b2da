"""Sources of a graph: launch files, their descriptions, node classes, instances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from inspect import signature
from pathlib import Path
from typing import Any, TypeAlias

from busflow.clock import Clock, SimClock, Time
from busflow.errors import InvalidDeclaration
from busflow.launchfile.model.description import ClockMode, LaunchDescription, RecordSpec
from busflow.launchfile.model.supervision import Supervision
from busflow.node.node import NO_INIT, Node
from busflow.node.supervision import Supervised

Wanted: TypeAlias = str | Path | Mapping[str, object] | RecordSpec | bool
"""A file to record to; the keys of a launch file's `record:`; True for what the launch file says, False for nothing."""
What: TypeAlias = str | Path | LaunchDescription | Node | type[Node] | Supervised


def described(what: str | Path | LaunchDescription, args: Mapping[str, object] | None) -> LaunchDescription:
    """Return the description of a launch file, or the one that is given.

    Raises:
        LaunchError: the file cannot be read, with every problem.
    """
    if isinstance(what, LaunchDescription):
        return what
    from busflow.launchfile.load.load import load
    from busflow.node.plugins import names

    return load(Path(what), args=args or {}, plugins=names)


def made_by_hand(what: Any) -> tuple[Node, Supervision]:
    """Return the node that is given, or one of the class that is, and what is asked for it.

    Raises:
        InvalidDeclaration: it is neither, or the class needs arguments.
    """
    node, supervision = (what.node, what.supervision) if isinstance(what, Supervised) else (what, Supervision())
    if isinstance(node, Node):
        return node, supervision
    if isinstance(node, type) and issubclass(node, Node):
        try:
            signature(node).bind()
        except TypeError as error:
            raise InvalidDeclaration(f"{node.__name__} cannot be built: {error}; {NO_INIT}") from None
        return node(), supervision
    raise InvalidDeclaration(f"a graph is made of launch files, Node classes and instances, not {what!r}")


def set_clock(clock: Clock, descriptions: Sequence[LaunchDescription]) -> None:
    """Set the start of a simulated clock as a launch file says."""
    start_s = next((each.clock.start_s for each in descriptions if each.clock.start_s is not None), None)
    if start_s is not None and isinstance(clock, SimClock):
        clock.start_at(Time(seconds=start_s))


def is_simulated(description: LaunchDescription) -> bool:
    """Return whether a launch file asks for simulated time."""
    return description.clock.mode is not ClockMode.SYSTEM
