"""What a node says about frames: `frames = transforms()` in its class, and `Frames` in its place on an instance."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from busflow.bus.qos import Durability, QoS
from busflow.clock import NS_PER_S, nanoseconds_of
from busflow.errors import NotRunning, TransformError
from busflow.frames.moving import moved, stamp_and_frame
from busflow.frames.rigid import Rigid
from busflow.frames.shared import DEPTH, FIXED, MOVING, SharedFrames, shared_frames
from busflow.frames.tree import Gap
from busflow.msgs.builtin_interfaces import Time as TimeMsg
from busflow.msgs.geometry_msgs import Quaternion, Transform, TransformStamped, Vector3
from busflow.msgs.std_msgs import Header
from busflow.msgs.tf2_msgs import TFMessage
from busflow.node.declarations import ComposedDeclaration, Declaration
from busflow.node.node import Node, runtime_of
from busflow.node.signatures import calling_line

if TYPE_CHECKING:
    from typing import TypeVar

    from busflow.bus.bus import Bus
    from busflow.bus.publisher import Publisher
    from busflow.clock import Time
    from busflow.frames.moving import Stamped
    from busflow.node.runtime import NodeRuntime

    S = TypeVar("S", bound=Stamped)

TIMEOUT_S = 0.1
"""Seconds that a lookup waits where it does not say."""
_SUBSCRIPTION_QOS = QoS(depth=DEPTH)
_FIXED_SUBSCRIPTION_QOS = QoS(depth=DEPTH, durability=Durability.TRANSIENT_LOCAL)
_PUBLISHER_QOS = QoS(depth=100)
FIXED_PUBLISHER_QOS = QoS(depth=1, durability=Durability.TRANSIENT_LOCAL)


class TransformsDeclaration(ComposedDeclaration["Frames"]):
    """A class attribute made by `transforms`."""

    def __init__(self) -> None:
        self.written: tuple[str, int] | None = calling_line()

    def compose(self, node: Node) -> Frames:
        """Subscribe the node to the topics of frames."""
        return Frames(runtime_of(node), self)


def transforms() -> TransformsDeclaration:
    """Know the frames of the robot, and send their transforms.

    Write `frames = transforms()` in the class, and `self.frames.latest("map", "base_link")` in its methods.
    """
    return TransformsDeclaration()


def transform_message(parent: str, child: str, rigid: Rigid, stamp: TimeMsg) -> TransformStamped:
    """Return the message of a motion from a child frame to its parent."""
    x, y, z, qx, qy, qz, qw = rigid
    return TransformStamped(
        header=Header(stamp=stamp, frame_id=parent),
        child_frame_id=child,
        transform=Transform(translation=Vector3(x=x, y=y, z=z), rotation=Quaternion(x=qx, y=qy, z=qz, w=qw)),
    )


class Frames:
    """The frames of the robot as one node uses them; the tree behind it is one for all nodes of the process."""

    def __init__(self, runtime: NodeRuntime, declared: Declaration) -> None:
        self._runtime, self._declared = runtime, declared
        self._moving, self._fixed = runtime.resolve(MOVING).name, runtime.resolve(FIXED).name
        self._sent_fixed: dict[str, TransformStamped] = {}
        self._publishers: dict[str, Publisher[TFMessage]] = {}
        self._shared: SharedFrames | None = None
        for topic, qos in ((MOVING, _SUBSCRIPTION_QOS), (FIXED, _FIXED_SUBSCRIPTION_QOS)):
            take = self._delivered if topic == MOVING else self._delivered_fixed
            runtime.create_subscription(TFMessage, topic, take, qos, origin=declared.origin, line=declared.written)
        runtime.on_connect.append(self._connect)

    def _connect(self, bus: Bus) -> None:
        self._shared = shared_frames(bus, self._moving, self._fixed, self._runtime.surroundings.log.bind("busflow"))

    def _delivered(self, message: TFMessage) -> None:
        """Do nothing: the tree has taken the message in as it was published, once for all nodes."""

    def _delivered_fixed(self, message: TFMessage) -> None:
        """Take in what was kept for late subscriptions; the tree knows the rest already."""
        self._tree.take_late(message)

    @property
    def _tree(self) -> SharedFrames:
        if self._shared is None:
            raise NotRunning(f"{self._declared.origin} knows frames once its node is part of a graph that runs")
        return self._shared

    # Asking.

    @property
    def names(self) -> frozenset[str]:
        """The names of all frames that are known."""
        return frozenset(self._tree.tree.frames)

    def latest(self, target: str, source: str) -> TransformStamped:
        """Return the newest transform that gives coordinates in `target` for those in `source`.

        Its stamp is the newest time at which every edge between the two is known; 0 where none of them moves.

        Raises:
            UnknownFrame, FramesNotConnected, TransformTooOld: there is none; the error says why, and what to do.
        """
        return self._message(target, source, self._found(target, source, None))

    async def lookup(
        self,
        target: str,
        source: str,
        *,
        at: Time | TimeMsg,
        timeout: float = TIMEOUT_S,  # noqa: ASYNC109  # the error names the edge that lags, which a scope could not
    ) -> TransformStamped:
        """Return the transform at a time; wait for it, where it has not come yet, up to `timeout` seconds.

        Raises:
            TransformTooOld: the time lies before what is kept; at once, for no wait helps.
            UnknownFrame, FramesNotConnected, TransformNotThere: it has not come in time.
        """
        return self._message(target, source, await self._awaited(target, source, nanoseconds_of(at), timeout))

    def apply(self, message: S, target: str) -> S:
        """Return a stamped message in another frame, at its stamp; one of stamp 0 at the newest time.

        A PoseStamped, PointStamped, Vector3Stamped, QuaternionStamped, PoseWithCovarianceStamped, PoseArray,
        PolygonStamped, PointCloud2 or InertiaStamped. The torque of a WrenchStamped is then about the origin of
        `target`. A TwistStamped, VelocityStamped or AccelStamped, also with covariance, stays that of the same point,
        along other axes.

        Raises:
            TransformError: as `latest`, and TransformNotThere, without a wait: `await lookup(…)` before waits.
        """
        stamp_ns, frame = stamp_and_frame(message)
        rigid, _ = self._found(target, frame, stamp_ns or None)
        return moved(message, target, rigid)

    def _found(self, target: str, source: str, stamp_ns: int | None) -> tuple[Rigid, int]:
        found = self._tree.tree.find(target, source, stamp_ns)
        if isinstance(found, Gap):
            raise self._error(found, target, source)
        return found

    async def _awaited(self, target: str, source: str, stamp_ns: int, timeout_s: float) -> tuple[Rigid, int]:
        shared = self._tree
        found = shared.tree.find(target, source, stamp_ns)
        if isinstance(found, Gap) and not found.is_hopeless:
            with suppress(TimeoutError):
                async with asyncio.timeout(timeout_s):
                    while isinstance(found, Gap) and not found.is_hopeless:
                        await shared.wait(found)
                        found = shared.tree.find(target, source, stamp_ns)
        if isinstance(found, Gap):
            raise self._error(found, target, source)
        return found

    def _error(self, gap: Gap, target: str, source: str) -> TransformError:
        shared = self._tree
        return shared.tree.error(gap, (target, source), shared.publisher_of(gap.child) if gap.child else "")

    @staticmethod
    def _message(target: str, source: str, found: tuple[Rigid, int]) -> TransformStamped:
        rigid, stamp_ns = found
        sec, nanosec = divmod(stamp_ns, NS_PER_S)
        return transform_message(target, source, rigid, TimeMsg(sec=sec, nanosec=nanosec))

    # Sending.

    def send(self, *transforms: TransformStamped) -> None:
        """Publish transforms of edges that move, on `/tf`.

        Raises:
            InvalidTransform: one has a number that is not finite, an invalid quaternion, would close a loop, or
                give a frame another parent than the one that another node of this process sends.
        """
        self._tree.claim(transforms, self._runtime.full_name, self._moving)
        self._publisher(MOVING, _PUBLISHER_QOS).publish(TFMessage(transforms=transforms))

    def send_static(self, *transforms: TransformStamped) -> None:
        """Publish transforms that hold for ever, on `/tf_static`; what comes later gets all that this node sent so far.

        Raises:
            InvalidTransform: as `send`.
        """
        self._tree.claim(transforms, self._runtime.full_name, self._fixed)
        self._sent_fixed.update((each.child_frame_id, each) for each in transforms)
        message = TFMessage(transforms=tuple(self._sent_fixed.values()))
        self._publisher(FIXED, FIXED_PUBLISHER_QOS).publish(message)

    def _publisher(self, topic: str, qos: QoS) -> Publisher[TFMessage]:
        """Return the node's publisher of a topic, made at the first transform: most nodes only ask."""
        publisher = self._publishers.get(topic)
        if publisher is None:
            declared = self._declared
            publisher = self._publishers[topic] = self._runtime.create_publisher(
                TFMessage, topic, qos, origin=declared.origin, line=declared.written
            )
        return publisher

    def __repr__(self) -> str:
        known: Any = len(self._shared.tree.edges) if self._shared is not None else "no"
        return f"<Frames of {self._runtime.full_name}: {known} edges>"
