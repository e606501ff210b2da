"""Extension: a part of a run that is no node; it lives from before the nodes start until they have ended."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractAsyncContextManager, nullcontext
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from busflow.bus.failure import Failure
    from busflow.runner.report import SnapshotReport
    from busflow.runner.restarting import Restarting
    from busflow.runner.supervisor import Supervisor


class Extension:
    """A part of a run that is no node: `graph.attach(extension)`. Each method is called on the event loop.

    Extensions begin in the order in which they were attached, and end in the reverse order. A subclass overrides what
    it needs.
    """

    end_s: float = 0.0
    """Wall time that `end` may take, beyond the grace of the nodes."""

    def begin(self) -> None:
        """Begin, once the nodes are built and before any is connected.

        What it raises keeps the graph from starting: those that have begun before it are ended, and it itself is not.
        """

    def surround(self) -> AbstractAsyncContextManager[object]:
        """Return a context: entered when all extensions have begun, before any node starts; left when all ended."""
        return nullcontext()

    def nodes_started(self) -> None:
        """React to the start of every node; no node has had time since to block the event loop."""

    def node_rebuilt(self, supervisor: Supervisor) -> None:
        """React to a node that is about to restart: its instance is new, and its endpoints are not connected yet."""

    def node_failed(self, failure: Failure) -> None:
        """React to the failure of a node, whether or not the node is restarted."""

    def prerequisites(self) -> Sequence[Restarting]:
        """Return what nodes may depend on besides other nodes."""
        return ()

    def about(self) -> Mapping[str, Any]:
        """Return facts about this extension for other terminals, as plain data."""
        return {}

    def snapshot(self, reason: str) -> SnapshotReport | None:  # noqa: ARG002  # for those that override it
        """Write the last moments of the run; return None if this extension keeps none."""
        return None

    def order_carried_out(self) -> None:
        """React to nodes that were stopped or started by hand."""

    def node_dismissed(self, supervisor: Supervisor) -> None:
        """React to a node that has left the running graph for good, or for another one of its name."""

    def is_finished(self) -> bool:
        """Return whether the run may end once all its nodes have ended."""
        return True

    def end(self) -> None:
        """End, when all nodes have ended or one could not be connected.

        What it raises keeps no other extension from its end, and is raised to the caller that waits for the graph.
        """

    def sections(self) -> Mapping[str, object]:
        """Return what this extension adds to the run's report, by the names of sections."""
        return {}
