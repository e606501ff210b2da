"""SharedFrames: the one tree of a process for a pair of topics, fed as messages are published, and what waits."""

from __future__ import annotations

import asyncio
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from busflow.bus.expiry import message_of
from busflow.clock import nanoseconds_of
from busflow.errors import InvalidTransform
from busflow.frames.rigid import Rigid
from busflow.frames.tree import FrameTree, Gap
from busflow.text import printable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from busflow.bus.bus import Bus
    from busflow.bus.topic import Topic
    from busflow.log import Logger
    from busflow.msgs.geometry_msgs import TransformStamped
    from busflow.msgs.tf2_msgs import TFMessage

MOVING, FIXED = "/tf", "/tf_static"
"""The topics of frames that move and of those that do not, before they are remapped."""
DEPTH = 100
"""The depth of a node's subscriptions, as in tf2."""
_MOST_WARNINGS = 100
"""The most frames that a run warns of, so that a publisher of nonsense does not fill the log."""


@dataclass(frozen=True, slots=True)
class Sender:
    """The node of this process that sends the transform of a frame."""

    node: str
    parent: str
    topic: str


class SharedFrames:
    """One tree of frames, and the nodes of this process that send to it or wait for it."""

    def __init__(self, bus: Bus, moving: str, fixed: str, log: Logger) -> None:
        """Listen to both topics, which exist, from now on and to what their publishers keep."""
        self.tree: FrameTree = FrameTree()
        self.topics: tuple[str, str] = (moving, fixed)
        self.refused: int = 0
        """Transforms that cannot be part of the tree."""
        self._bus, self._log = bus, log
        self._senders: dict[str, Sender] = {}
        self._waiting: dict[str, list[tuple[int, asyncio.Future[None]]]] = {}
        """Waits for a transform, by the child of its edge; under the empty name those for a new edge."""
        self._warned: set[str] = set()
        self._taken: deque[TFMessage] = deque(maxlen=DEPTH)
        """The last messages on `/tf_static`, as many as a subscription may not have delivered yet."""
        for name, take in ((moving, self.take), (fixed, self.take_fixed)):
            topic: Topic[TFMessage] = bus.topics[name]
            for kept in topic.kept():
                take(message_of(kept))
            bus.tap(topic, take)

    # Taking in.

    def take(self, message: TFMessage) -> None:
        """Take in the transforms of a message on `/tf`, as it is published; raise nothing into its publisher."""
        stamp, stamp_ns = None, 0
        for each in message.transforms:
            parent, child = edge_of(each)
            if each.header.stamp is not stamp:  # the frames of one robot mostly share theirs
                stamp = each.header.stamp
                stamp_ns = nanoseconds_of(stamp)
            set_back = self.tree.set_back
            try:
                is_new = self.tree.take(parent, child, stamp_ns, numbers_of(each))
            except InvalidTransform as error:
                self._refuse(child, error, self.topics[0])
                continue
            if is_new:
                self._announce(child, self.topics[0])
            if self.tree.set_back != set_back:
                self._warn("", f"time was set back on {self.topics[0]}: the frames that move were emptied")
            if self._waiting:
                self._wake(child, stamp_ns)

    def take_late(self, message: TFMessage) -> None:
        """Take in a message on `/tf_static` that reached a subscription, unless it was taken in as it was published."""
        if not any(each is message for each in self._taken):
            self.take_fixed(message)

    def take_fixed(self, message: TFMessage) -> None:
        """Take in the transforms of a message on `/tf_static`, as `take`."""
        self._taken.append(message)
        for each in message.transforms:
            parent, child = edge_of(each)
            try:
                is_new = self.tree.take_fixed(parent, child, numbers_of(each))
            except InvalidTransform as error:
                self._refuse(child, error, self.topics[1])
                continue
            if is_new:
                self._announce(child, self.topics[1])

    def _refuse(self, child: str, error: InvalidTransform, topic: str) -> None:
        self.refused += 1
        self._warn(child, f"a transform on {topic}, published by {self._publishers(topic)}, is left out: {error}")

    def _announce(self, child: str, topic: str) -> None:
        """Let everyone that waits look again: an edge is new; and warn of a frame that has had two parents."""
        waiting, self._waiting = self._waiting, {}
        for _, future in (each for group in waiting.values() for each in group):
            if not future.done():
                future.set_result(None)
        parents = self.tree.moved.get(child)
        if parents is not None:
            shown = " and ".join(map(printable, sorted(parents)))
            self._warn(child, f"{printable(child)} has had the parents {shown}, by {self._publishers(topic)}")

    def _warn(self, child: str, text: str) -> None:
        """Log a warning, once for each frame."""
        if child not in self._warned and len(self._warned) < _MOST_WARNINGS:
            self._warned.add(child)
            self._log.warning(text)

    def _publishers(self, topic: str) -> str:
        found = self._bus.topics.get(topic)
        names = dict.fromkeys(each.endpoint.node for each in found.publishers) if found is not None else {}
        return " or ".join(names) or "a node that has left"

    # Waiting.

    async def wait(self, gap: Gap) -> None:
        """Wait until what is missing may be there: the next transform of the edge that lags, or a new edge."""
        future: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(gap.child, []).append((gap.stamp_ns, future))
        try:
            await future
        finally:
            group = self._waiting.get(gap.child)
            if group is not None and (gap.stamp_ns, future) in group:  # it was cancelled
                group.remove((gap.stamp_ns, future))

    def _wake(self, child: str, stamp_ns: int) -> None:
        group = self._waiting.get(child)
        if group is None:
            return
        for each in tuple(group):
            if each[0] <= stamp_ns:
                group.remove(each)
                if not each[1].done():
                    each[1].set_result(None)
        if not group:
            del self._waiting[child]

    # Sending.

    def claim(self, transforms: Sequence[TransformStamped], node: str, topic: str) -> None:
        """Note which frames a node sends, before it does.

        Raises:
            InvalidTransform: a transform has impossible numbers, would close a loop, or would give a frame that another
                node of this process sends a second parent.
        """
        for each in transforms:
            parent, child = edge_of(each)
            other = self._senders.get(child)
            if other is not None and other.node != node and self._publishes(other):
                self._check_second(other, node, parent, child)
            self.tree.check(parent, child, numbers_of(each))
        for each in transforms:
            parent, child = edge_of(each)
            self._senders[child] = Sender(node, parent, topic)

    def _check_second(self, other: Sender, node: str, parent: str, child: str) -> None:
        if other.parent != parent:
            raise InvalidTransform(
                f"{printable(child)} cannot have two parents: {node} sends {printable(parent)} → {printable(child)}, "
                f"and {other.node} sends {printable(other.parent)} → {printable(child)}; leave one of the two out"
            )
        self._warn(child, f"{other.node} and {node} both send {printable(parent)} → {printable(child)}")

    def _publishes(self, sender: Sender) -> bool:
        return any(each.endpoint.node == sender.node for each in self._bus.topics[sender.topic].publishers)

    def publisher_of(self, child: str) -> str:
        """Say what publishes the transforms of a frame, as far as that is known in this process."""
        sender = self._senders.get(child)
        return sender.node if sender is not None else self._publishers(self.topics[0])


def edge_of(message: TransformStamped) -> tuple[str, str]:
    """Return the parent and the child of a message, without the leading slash that tf once had."""
    return message.header.frame_id.lstrip("/"), message.child_frame_id.lstrip("/")


def numbers_of(message: TransformStamped) -> Rigid:
    """Return the numbers of a message, unchecked."""
    transform = message.transform
    translation, rotation = transform.translation, transform.rotation
    return (translation.x, translation.y, translation.z, rotation.x, rotation.y, rotation.z, rotation.w)


def shared_frames(bus: Bus, moving: str, fixed: str, log: Logger) -> SharedFrames:
    """Return the tree of a process for these topics, made for the first node that asks."""
    key: Any = (SharedFrames, moving, fixed)
    return bus.shared.get(key) or bus.shared.setdefault(key, SharedFrames(bus, moving, fixed, log))
