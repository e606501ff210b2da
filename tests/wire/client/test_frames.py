"""The frames of a run as a client sees them: what is kept first, each message with its publisher."""

from __future__ import annotations

import pytest

from busflow import Node, Time, timer, transforms
from busflow.errors import NoSuchTarget
from busflow.msgs.geometry_msgs import TransformStamped
from busflow.msgs.std_msgs import Header
from busflow.wire.client.frames import follow_frames, publishes_frames


def edge(parent: str, child: str, stamp: Time) -> TransformStamped:
    return TransformStamped(header=Header(stamp=stamp.to_msg(), frame_id=parent), child_frame_id=child)


class Wheels(Node):
    frames = transforms()

    async def start(self) -> None:
        self.frames.send_static(edge("base_link", "imu", Time()))

    @timer(0.02)
    def tick(self) -> None:
        self.frames.send(edge("odom", "base_link", self.clock.now()))


class Quiet(Node):
    pass


@pytest.mark.asyncio
async def test_each_message_comes_with_its_publisher(looked_at):
    async with looked_at(Wheels()) as looked:
        graph = await looked.ask(looked.peer.graph)
        while not all(topic in graph.topics and graph.topics[topic].publishers for topic in ("/tf", "/tf_static")):
            graph = await looked.ask(looked.peer.graph)

        def seen():
            kinds = {}
            for each in follow_frames(looked.peer, graph, 30):
                if each is not None:
                    kinds[each.message.transforms[0].child_frame_id] = each.publishers, each.fixed
                if len(kinds) == 2:
                    break
            return kinds

        assert publishes_frames(graph)
        assert await looked.ask(seen) == {"imu": (("/wheels",), True), "base_link": (("/wheels",), False)}


@pytest.mark.asyncio
async def test_run_without_frames_says_so(looked_at):
    async with looked_at(Quiet()) as looked:
        graph = await looked.ask(looked.peer.graph)
        assert not publishes_frames(graph)
        with pytest.raises(NoSuchTarget):
            next(follow_frames(looked.peer, graph, 1))
