"""Nodes of ROS 2 that take part in a run. It carries no message itself.

A run writes ROS 2's types under the keys of `rmw_zenoh`, so its Zenoh session is all that nodes of ROS 2 need: `router`
finds out whether the machine has the router that they look for, and else lets the run stand in for it. What may pass is
decided by Zenoh's access control (`wire/zenoh/access`). A run that lets none in imports nothing of this package but
this module.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from busflow.launchfile.model.description import LaunchDescription
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
    spec = next((each.ros2 for each in descriptions if each.ros2 is not None), None)
    if spec is None:
        return None
    from busflow.ros2.router import with_ros2

    return lambda: with_ros2(spec, linked)
