"""A bridge between a run and the nodes of ROS 2 in a DDS domain. Runs no node, and encodes no message.

The bridge is a process beside the run (`process`): `busflow dds`, or a program of the run (`extension`), which starts
it again when it fails. A fault of the DDS library, in C, ends the bridge and not the run.

- `bridge` joins the run as a process with a socket, and the domain as one participant (`participant`). It looks at both
  sides whenever one of them changes: `topics` and `services` then open what is needed and close the rest.
- A topic goes out by an `outlet`, with a DDS writer for each publisher, and in by an `inlet`, with one reader. The
  bytes of a message are ROS 2's CDR on both sides and stay as they are; `idl` makes the DDS types that carry them, from
  the descriptions that the run offers. A message from DDS waits until the run knows its writer.
- A service goes by `calls`. `rmw_cyclonedds` writes 16 bytes before a request and its response, which are added and
  taken off here.
- `neighbours` follows the endpoints of other participants, and the nodes that these list on `ros_discovery_info`
  (`node_lists`); there the run's nodes are listed too. `shown` shows the neighbours in the run, as tokens of nodes and
  endpoints like any other process's: whether types, definitions and QoS fit is decided where it always is.
- `names`, `qos` and `known_types` translate. `carried` counts, and keeps the log short whatever a neighbour does.

docs/decisions/0041 has the reasons. A run without a bridge imports nothing of this package.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from busflow.runner.assembly import Run


def attach_bridge(run: Run) -> None:
    """Attach a bridge to DDS to a run whose launch file asks for one, once other terminals can find the run.

    Raises:
        LaunchError: the environment names no valid domain.
    """
    if run.ros2 is not None:
        from busflow.dds.extension import Bridge

        run.graph.attach(Bridge(run.graph, run.ros2))
