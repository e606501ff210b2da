"""Nodes of ROS 2 that take part in a run. It carries no message itself.

A run writes ROS 2's types under the keys of `rmw_zenoh`, so its Zenoh session is all that nodes of ROS 2 need: `router`
finds out whether the machine has the router that they look for, and else lets the run stand in for it. When a router
that the run has joined ends, the run takes its place (`successor`). What may pass is decided by Zenoh's access control
(`wire/zenoh/access`). A run that lets none in imports nothing of this package but this module.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from busflow.launchfile.model.ros2 import Ros2Spec, Ros2Transport

if TYPE_CHECKING:
    from busflow.launchfile.model.description import LaunchDescription
    from busflow.runner.assembly import Run
    from busflow.runner.graph import Graph
    from busflow.wire.zenoh.network import Network


def ros2_network(
    descriptions: Sequence[LaunchDescription], linked: Network | None = None
) -> Callable[[], Network | None] | None:
    """Return a function that finds the network of a run with nodes of ROS 2; None for a run without them.

    The function raises what `router.with_ros2` raises.

    Args:
        descriptions: those of the run's launch files.
        linked: the network of the run's machines, if there are several.
    """
    spec = _spec_of(descriptions)
    if spec is None:
        return None
    from busflow.ros2.router import with_ros2

    return lambda: with_ros2(spec, linked)


def show(run: Run) -> None:
    """Let other terminals and nodes of ROS 2 find a run of one process."""
    from busflow.wire.mirror.membership import inspectable

    inspectable(run.graph, run.given.inspect, network=ros2_network(run.descriptions))
    attach_successor(run.graph)


def attach_successor(graph: Graph) -> None:
    """Attach a `RouterSuccessor` to a graph, if its nodes of ROS 2 come over Zenoh."""
    spec = _spec_of(graph.descriptions)
    if spec is not None and spec.transport is Ros2Transport.ZENOH:
        from busflow.ros2.successor import RouterSuccessor

        graph.attach(RouterSuccessor(spec.router, graph.clock, graph.log.bind("busflow")))


def _spec_of(descriptions: Sequence[LaunchDescription]) -> Ros2Spec | None:
    return next((each.ros2 for each in descriptions if each.ros2 is not None), None)
