"""The frames of a run as a client sees them: what comes on `/tf` and `/tf_static`, each message with its publisher."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import ExitStack
from typing import TYPE_CHECKING, NamedTuple

from busflow.clock import monotonic
from busflow.errors import MalformedMessage, NoSuchTarget
from busflow.frames.shared import FIXED, MOVING
from busflow.wire.client.known_type import known_type

if TYPE_CHECKING:
    from busflow.msgs.tf2_msgs import TFMessage
    from busflow.wire.client.client import Peer
    from busflow.wire.client.graph_view import GraphView

TYPE = "tf2_msgs/msg/TFMessage"
_CHECK_S = 0.5
"""The interval at which to check that the run is alive, while nothing comes."""


class FramesMessage(NamedTuple):
    """Some transforms, as they were published."""

    message: TFMessage
    publishers: tuple[str, ...]
    """The node that published them; in a recording those of which one did, and none where it is not known."""
    published_ns: int
    fixed: bool


def publishes_frames(graph: GraphView) -> bool:
    """Return whether any node of a run publishes frames."""
    return any(name in graph.topics and graph.topics[name].publishers for name in (MOVING, FIXED))


def follow_frames(peer: Peer, graph: GraphView, for_s: float | None) -> Iterator[FramesMessage | None]:
    """Yield the transforms of a run as they come, what is kept first; None now and then while nothing comes.

    Args:
        peer: the client of the run.
        graph: its nodes and topics.
        for_s: after this time it ends; None for no limit.

    Raises:
        NoSuchTarget: no node of the run has to do with frames.
        RunEnded: the run has ended.
    """
    from busflow.interfaces.encoding.typesupport import TypeSupport
    from busflow.msgs.tf2_msgs import TFMessage as Frames

    topics = [graph.topics[name] for name in (FIXED, MOVING) if name in graph.topics]
    if not topics:
        raise NoSuchTarget(f"no node publishes {MOVING} or {FIXED}: the run has no frames")
    decode, type_ = TypeSupport(Frames).decode, known_type(peer, TYPE)
    nodes = {end.token.gid: (end.node,) for topic in topics for end in topic.publishers}
    arrived, end_s = threading.Event(), None if for_s is None else monotonic() + for_s
    with ExitStack() as stack:
        listeners = [
            (topic.name == FIXED, stack.enter_context(peer.listen(topic, type_, on_arrival=arrived.set)))
            for topic in topics
        ]
        while end_s is None or monotonic() < end_s:
            for fixed, listener in listeners:
                while (received := listener.get(0)) is not None:
                    try:
                        message: TFMessage = decode(received.payload)  # type: ignore[assignment]  # of its own class
                    except MalformedMessage:
                        continue
                    yield FramesMessage(message, nodes.get(received.gid, ()), received.stamp_ns, fixed)
            if not arrived.wait(_CHECK_S if end_s is None else max(0.0, min(_CHECK_S, end_s - monotonic()))):
                peer.require_run()
                yield None
            arrived.clear()
