"""The last messages of a topic, by reference."""

import asyncio

from busflow.msgs.std_msgs import Int64
from busflow.testing import virtual_time
from busflow.wire.queries.kept_messages import KeptMessages


def numbers(messages):
    return [message.data for message in messages]


@virtual_time
async def test_last_message_of_volatile_topic_is_kept(make_bench):
    bench = make_bench()
    first, second = bench.publisher(), bench.publisher(node="/other")
    topic = bench.bus.topics["/number"]
    history = KeptMessages(bench.bus, {})
    history.follow(topic)
    assert history.last(topic, 1) == []
    message = Int64(data=2)
    first.publish(Int64(data=1))
    second.publish(message)
    assert history.last(topic, 5)[0] is message
    assert history.last(topic, 0) == []


@virtual_time
async def test_a_launch_file_may_want_more_or_none(make_bench):
    bench = make_bench()
    many, none = bench.publisher(), bench.publisher("/none")
    history = KeptMessages(bench.bus, {"/number": 3, "/none": 0})
    for topic in bench.bus.topics.values():
        history.follow(topic)
        history.follow(topic)
    for number in range(5):
        many.publish(Int64(data=number))
        none.publish(Int64(data=number))
    topics = bench.bus.topics
    assert numbers(history.last(topics["/number"], 2)) == [3, 4]
    assert numbers(history.last(topics["/number"], 99)) == [2, 3, 4]
    assert (history.depth("/number"), history.depth("/none"), history.depth("/any")) == (3, 0, 1)
    assert history.last(topics["/none"], 1) == []


@virtual_time
async def test_what_a_publisher_lets_expire_is_still_shown(make_bench):
    bench = make_bench()
    publisher = bench.publisher(lifespan_s=0.1)
    topic = bench.bus.topics["/number"]
    history = KeptMessages(bench.bus, {})
    history.follow(topic)
    publisher.publish(Int64(data=7))
    await asyncio.sleep(1)
    assert numbers(history.last(topic, 1)) == [7]


@virtual_time
async def test_after_closing_nothing_is_kept_alive(make_bench):
    bench = make_bench()
    publisher = bench.publisher()
    topic = bench.bus.topics["/number"]
    history = KeptMessages(bench.bus, {})
    history.follow(topic)
    publisher.publish(Int64(data=7))
    history.close()
    assert (topic.recent, topic.pushes) == (None, ())
