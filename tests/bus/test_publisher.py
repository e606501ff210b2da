"""Tests of `publisher.py`: publish to all or to none, in order; only `send` waits."""

import asyncio

import pytest

from busflow.bus.endpoint import Endpoint
from busflow.bus.events import DeadlineMissed, LivelinessLost
from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS
from busflow.errors import IncompatibleType, NotRunning, SendTimeout, WouldBlock
from busflow.interfaces.message import Message
from busflow.msgs.std_msgs import Int64, String
from busflow.testing import virtual_time
from tests.bus.conftest import number, queued, settle


@virtual_time
async def test_every_subscription_receives_the_same_object(make_bench):
    bench = make_bench()
    publisher, one, two = bench.publisher(), bench.subscription(), bench.subscription()
    message = number(1)
    publisher.publish(message)
    assert one.latest is message
    assert two.latest is message


class Wider(Int64, package="tests"):
    pass


# A publish may take the short path or the careful one; the rules are the same on both.
PATHS = [
    pytest.param({}, {}, id="short"),
    pytest.param({}, {"overflow": "block"}, id="blocking"),
    pytest.param({"durability": "transient_local"}, {}, id="latched"),
    pytest.param({"lifespan_s": 1}, {}, id="perishable"),
]


@pytest.mark.parametrize(("offered", "requested"), PATHS)
@pytest.mark.parametrize("wrong", [String(data="1"), Wider(data=1), 1, None, Int64], ids=repr)
@virtual_time
async def test_message_of_another_type_is_refused(make_bench, offered, requested, wrong):
    bench = make_bench()
    publisher, subscription = bench.publisher(**offered), bench.subscription(**requested)
    with pytest.raises(IncompatibleType):
        publisher.publish(wrong)
    with pytest.raises(IncompatibleType):
        await publisher.send(wrong)
    assert publisher.published == 0
    assert publisher.history == ()
    assert queued(subscription) == []


@virtual_time
async def test_class_in_place_of_message_gets_brackets(golden, make_bench):
    with golden.raises(IncompatibleType):
        make_bench().publisher().publish(Int64)


@virtual_time
async def test_error_escapes_the_refused_value(golden, make_bench):
    class Hostile:
        def __repr__(self):
            return "\x1b[2J" * 1000

    with golden.raises(IncompatibleType, mask={r"(..1b.2J)+": "…"}):
        make_bench().publisher().publish(Hostile())


@virtual_time
async def test_a_publisher_outside_of_a_running_graph_refuses(golden, make_bench):
    endpoint = Endpoint("/lonely", "/number", Int64, QoS(), "Lonely.numbers", "number")
    lonely = Publisher(Int64, endpoint)
    with golden.raises(NotRunning):
        lonely.publish(number(1))
    closed = make_bench().publisher()
    closed.close()
    closed.close()
    with pytest.raises(NotRunning):
        closed.publish(number(1))
    with pytest.raises(NotRunning):
        await closed.send(number(1))
    assert (lonely.published, closed.published) == (0, 0)
    assert (lonely.subscription_count, closed.subscription_count) == (0, 0)


@virtual_time
async def test_publish_without_room_or_turn_says_who_is_slow(golden, make_bench):
    bench = make_bench()
    publisher = bench.publisher()
    bench.subscription(node="/roomy", overflow="block", depth=2)
    slow = bench.subscription(node="/slow", overflow="block", depth=1)
    publisher.publish(number(1))
    with golden.raises(WouldBlock):
        publisher.publish(number(2))
    sending = asyncio.create_task(publisher.send(number(2)))
    await settle()
    assert slow.latest == number(1)
    with golden.raises(WouldBlock):
        publisher.publish(number(3))
    await sending
    assert queued(slow) == [2]


@virtual_time
@pytest.mark.parametrize(
    ("offered", "requested", "received"),
    [
        ("best_available", "transient_local", [1]),
        ("transient_local", "best_available", [1]),
        ("best_available", "best_available", [1]),
        ("best_available", "volatile", []),
        ("volatile", "best_available", []),
    ],
)
async def test_best_available_keeps_what_the_pair_can(make_bench, offered, requested, received):
    bench = make_bench()
    bench.publisher(durability=offered).publish(number(1))
    assert queued(bench.subscription(durability=requested)) == received


@virtual_time
async def test_send_timeout_names_the_full_subscription(golden, make_bench):
    bench = make_bench()
    publisher, lossy = bench.publisher(), bench.subscription()
    bench.subscription(node="/roomy", overflow="block", depth=2, block_timeout_s=60)
    bench.subscription(node="/slow", overflow="block", depth=1, block_timeout_s=0.25)
    publisher.publish(number(1))
    loop = asyncio.get_running_loop()
    began = loop.time()
    with golden.raises(SendTimeout):
        await publisher.send(number(2))
    assert loop.time() - began == 0.25
    assert (publisher.published, queued(lossy)) == (1, [1])


@virtual_time
async def test_send_waits_for_a_full_late_joiner(make_bench):
    bench = make_bench()
    publisher = bench.publisher(durability="transient_local")
    slow = bench.subscription(overflow="block", depth=1)
    publisher.publish(number(1))
    sending = asyncio.create_task(publisher.send(number(2)))
    await settle()
    assert slow.latest == number(1)
    late = bench.subscription(overflow="block", depth=1, durability="transient_local")
    await settle()
    assert not sending.done()
    assert late.latest == number(1)
    await sending
    assert queued(slow) == queued(late) == [2]


@virtual_time
async def test_send_timeout_is_that_of_the_full_subscription(make_bench):
    bench = make_bench()
    publisher = bench.publisher()
    bench.subscription(node="/roomy", overflow="block", depth=2, block_timeout_s=0.1)
    slow = bench.subscription(node="/slow", overflow="block", depth=1, block_timeout_s=60)
    publisher.publish(number(1))
    sending = asyncio.create_task(publisher.send(number(2)))
    await asyncio.sleep(30)
    assert slow.latest == number(1)
    await sending
    assert queued(slow) == [2]


@virtual_time
async def test_wrong_type_raises_in_the_calling_thread(make_bench):
    bench = make_bench()
    publisher, closed = bench.publisher(), bench.publisher()
    closed.close()
    with pytest.raises(IncompatibleType):
        await asyncio.to_thread(publisher.publish, String(data="1"))
    with pytest.raises(NotRunning):
        await asyncio.to_thread(closed.publish, number(1))


@virtual_time
async def test_send_belongs_to_the_loop_of_the_graph(golden, make_bench):
    publisher = make_bench().publisher()
    with golden.raises(NotRunning):
        await asyncio.to_thread(lambda: asyncio.run(publisher.send(number(1))))


@virtual_time
async def test_a_publisher_shows_its_topic_node_and_count(make_bench):
    publisher = make_bench().publisher()
    publisher.publish(number(1))
    assert repr(publisher) == "<Publisher /number of /source: 1 published>"
    assert publisher.topic == "/number"
    assert issubclass(publisher.type, Message)


@virtual_time
async def test_publisher_knows_whether_anything_receives_it(make_bench):
    bench = make_bench()
    publisher = bench.publisher()
    assert not publisher.is_received
    publisher.send_through(lambda _message: None)
    assert publisher.is_received
    publisher.send_through(None)
    subscription = bench.subscription()
    assert publisher.is_received
    subscription.close()
    assert not publisher.is_received


LEASED = {"deadline_s": 1, "lease_s": 2, "liveliness": "manual_by_topic"}


@virtual_time
async def test_successor_keeps_deadline_and_lease(make_bench):
    bench, events = make_bench(), []
    before = bench.publisher(**LEASED)
    before.publish(number(1))
    await asyncio.sleep(0.6)
    after = Publisher(Int64, before.endpoint)
    after.on_event = events.append
    bench.bus.attach_publisher(after, before)
    await asyncio.sleep(0.6)
    assert [event for event in events if isinstance(event, DeadlineMissed)] == [DeadlineMissed("/number", 1)]
    assert after.alive
    await asyncio.sleep(1)
    assert [event for event in events if isinstance(event, LivelinessLost)] == [LivelinessLost("/number", 1)]
    assert not after.alive


@virtual_time
async def test_silent_publisher_without_listener_is_counted(make_bench):
    publisher = make_bench().publisher(**LEASED)
    publisher.publish(number(1))
    await asyncio.sleep(2.5)
    assert (publisher.deadlines_missed, publisher.liveliness_lost, publisher.alive) == (2, 1, False)


@virtual_time
async def test_listener_may_close_the_silent_publisher(make_bench):
    bench, events = make_bench(), []
    publisher = bench.publisher(**LEASED)
    publisher.publish(number(1))

    def leave(event):
        events.append(event)
        if isinstance(event, LivelinessLost):
            publisher.close()

    publisher.on_event = leave
    await asyncio.sleep(5)
    assert isinstance(events[-1], LivelinessLost)
    assert bench.bus.topics["/number"].publishers == []


@virtual_time
async def test_successor_of_a_closed_publisher_is_closed(make_bench):
    bench = make_bench()
    before = bench.publisher()
    before.publish(number(1))
    before.close()
    after = Publisher(Int64, before.endpoint)
    bench.bus.attach_publisher(after, before)
    with pytest.raises(NotRunning):
        after.publish(number(2))


@virtual_time
async def test_history_takes_earlier_messages_and_each_once(make_bench):
    bench = make_bench()
    latched, volatile = bench.publisher(durability="transient_local", depth=3), bench.publisher(node="/other")
    latched.publish(number(3))
    for publisher in (latched, volatile):
        kept = [publisher.as_kept(number(value)) for value in (0, 1, 2)]
        publisher.remember(kept)
        publisher.forget(kept[2])
        publisher.publish(number(2))
    assert [item.data for _, item in latched.history] == [1, 3, 2]
    assert volatile.history == ()
