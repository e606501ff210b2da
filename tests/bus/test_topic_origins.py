"""Tests of `topic_origins.py`: a tap can name the remote node of each message."""

from __future__ import annotations

from busflow.bus.endpoint import Endpoint
from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS
from busflow.bus.topic_origins import Origins
from busflow.msgs.std_msgs import Int64
from busflow.testing import virtual_time


@virtual_time
async def test_origin_is_the_remote_publisher_or_none(make_bench):
    bench, found = make_bench(), []
    local = bench.publisher(node="/here")
    remotes = []
    for node in ("/there", "/elsewhere"):
        remote = Publisher(Int64, Endpoint(node, "/number", Int64, QoS(), node, "/number", remote=True))
        bench.bus.attach_publisher(remote)
        remotes.append(remote)
    remotes[0].publish(Int64(data=0))
    topic = bench.bus.topics["/number"]
    origins = Origins(topic)
    bench.bus.tap(topic, lambda message: found.append((message.data, origins.of_this())))
    for data, publisher in enumerate([local, remotes[1], remotes[0], local, remotes[0]], start=1):
        publisher.publish(Int64(data=data))
    assert found == [(1, None), (2, "/elsewhere"), (3, "/there"), (4, None), (5, "/there")]
