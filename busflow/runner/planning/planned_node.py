"""`PlannedNode`: a node that is built and has declared its endpoints, with its entry in the launch file."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from busflow.errors import Place, Problem, Severity
from busflow.launchfile.model.description import NodeSpec
from busflow.launchfile.model.supervision import Supervision
from busflow.node.node import Node, runtime_of
from busflow.node.runtime import NodeRuntime

if TYPE_CHECKING:
    from busflow.bus.endpoint import Endpoint, ServiceEndpoint


@dataclass(frozen=True)
class PlannedNode:
    """Node of a planned graph: built, with its entry in the launch file."""

    node: Node
    plugin: str
    spec: NodeSpec | None = None
    supervision: Supervision = field(default_factory=Supervision)

    @cached_property  # each check asks for it
    def runtime(self) -> NodeRuntime:
        """The node's runtime, which holds its endpoints."""
        return runtime_of(self.node)

    @property
    def place(self) -> Place | None:
        """Place where the launch file names the node."""
        return self.spec.origin.place if self.spec else None

    @property
    def publishers(self) -> list[Endpoint]:
        """Endpoints that the node publishes on."""
        return [each.endpoint for each in self.runtime.endpoints.publishers]

    @property
    def subscriptions(self) -> list[Endpoint]:
        """Endpoints that the node receives on."""
        return [each.endpoint for each in self.runtime.endpoints.subscriptions]

    @property
    def servers(self) -> list[ServiceEndpoint]:
        """Services that the node answers."""
        return [each.endpoint for each in self.runtime.endpoints.servers]

    @property
    def clients(self) -> list[ServiceEndpoint]:
        """Services that the node calls."""
        return [each.endpoint for each in self.runtime.endpoints.clients]

    @property
    def trail(self) -> tuple[Place, ...]:
        """The place where the launch file names the node, and the `include` entries that led there; may be empty."""
        return self.spec.origin.trail if self.spec else ()

    def problem(
        self,
        code: str,
        message: str,
        fix: str | None,
        severity: Severity = Severity.ERROR,
        *,
        at: tuple[Place, ...] = (),
    ) -> Problem:
        """Return a problem at a place and those that led there, by default where the launch file names the node."""
        place, *included_from = at or self.trail or (None,)
        return Problem(code, message, fix, place, severity, tuple(included_from))
