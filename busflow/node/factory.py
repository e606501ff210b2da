"""Factory: the one way in which the nodes of a graph are built, from values of their parameters or anew."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from busflow.node.node import Node, default_name, parameters_class, runtime_of
from busflow.node.parameters import Parameters, validate

if TYPE_CHECKING:
    from busflow.node.runtime import NodeRuntime


class NodeFactory:
    """Builds nodes of one class, under one name."""

    def __init__(self, node_class: type[Node], name: str | None = None) -> None:
        """Create a factory of nodes; without a name they have that of their class."""
        self.node_class = node_class
        self.name: str = default_name(node_class) if name is None else name

    def parameters(self, values: Mapping[str, object]) -> Parameters:
        """Return the class's parameters with these values.

        Raises:
            InvalidParameter: with every reason why they cannot be.
            InvalidDeclaration: the class declares no parameters that could be read.
        """
        return validate(parameters_class(self.node_class), values)

    def build(self, parameters: Parameters) -> Node:
        """Return a node that is part of no graph yet; the class's own code runs, and may raise anything."""
        return self.node_class(parameters, name=self.name)


def rebuild(former: NodeRuntime, parameters: Parameters, life: int) -> NodeRuntime:
    """Build the node of a runtime again, for a restart; return its runtime, which is not connected yet.

    Args:
        former: the runtime before the restart; its surroundings and known parameters are taken over.
        parameters: those of the new instance.
        life: the number of restarts, this one included.
    """
    runtime = runtime_of(NodeFactory(former.node.__class__, former.name).build(parameters))
    runtime.parameters.take_over(former.parameters)
    runtime.declare(replace(former.surroundings, life=life))
    runtime.parameter_events.take_over(former.parameter_events)
    return runtime
