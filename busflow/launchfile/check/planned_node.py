"""Member: a node that is built and has declared its ends, with what the launch file says of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from busflow.errors import Place, Problem, Severity
from busflow.launchfile.model.description import NodeSpec
from busflow.node.node import Node, runtime_of
from busflow.node.runtime import NodeRuntime
from busflow.node.supervision import Supervision

if TYPE_CHECKING:
    from busflow.bus.endpoint import Endpoint, ServiceEndpoint


@dataclass(frozen=True)
class PlannedNode:
    """One node of a graph that is built, and what the launch file says of it."""

    node: Node
    plugin: str
    spec: NodeSpec | None = None
    supervision: Supervision = field(default_factory=Supervision)

    @cached_property  # each check asks for it
    def runtime(self) -> NodeRuntime:
        """The node's endpoints."""
        return runtime_of(self.node)

    @property
    def place(self) -> Place | None:
        """Where the launch file names the node."""
        return self.spec.origin.place if self.spec else None

    @property
    def publishers(self) -> list[Endpoint]:
        """What the node publishes."""
        return [each.endpoint for each in self.runtime.ends.publishers]

    @property
    def subscriptions(self) -> list[Endpoint]:
        """What the node receives."""
        return [each.endpoint for each in self.runtime.ends.subscriptions]

    @property
    def servers(self) -> list[ServiceEndpoint]:
        """What the node answers."""
        return [each.endpoint for each in self.runtime.ends.servers]

    @property
    def clients(self) -> list[ServiceEndpoint]:
        """What the node asks."""
        return [each.endpoint for each in self.runtime.ends.clients]

    def problem(self, code: str, message: str, fix: str | None, severity: Severity = Severity.ERROR) -> Problem:
        """A problem at the place where the launch file names the node, if one does."""
        if self.spec is None:
            return Problem(code, message, fix, severity=severity)
        return Problem(code, message, fix, self.place, severity, self.spec.origin.included_from)
