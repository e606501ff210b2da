"""Tests of `bus.py`, `inbox.py` and `endpoint.py`: endpoints that fit, every message accounted for, threads."""

import asyncio
import threading
from collections import Counter

import pytest

from busflow.bus.bus import Bus
from busflow.bus.endpoint import Endpoint
from busflow.bus.inbox import INBOX_DEPTH
from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS
from busflow.bus.subscription import Subscription
from busflow.clock import SimClock
from busflow.errors import IncompatibleQoS, IncompatibleType, NotRunning
from busflow.msgs.std_msgs import Int64, String
from busflow.testing import virtual_time


def number(value):
    return Int64(data=value)


def queued(subscription):
    return [message.data for message in subscription.queue.items]


async def settle():
    await asyncio.get_running_loop().settle()


def in_a_thread(function, *args):
    """Call it in a thread of its own, while the loop stands still."""
    thread = threading.Thread(target=function, args=args)
    thread.start()
    thread.join(60)
    assert not thread.is_alive()


# Who may meet.


@pytest.mark.parametrize("first", ["publisher", "subscription"])
@pytest.mark.parametrize("second", ["publisher", "subscription"])
@virtual_time
async def test_first_endpoint_sets_the_topic_type(make_bench, first, second):
    bench = make_bench()
    getattr(bench, first)(node="/first")
    with pytest.raises(IncompatibleType) as caught:
        getattr(bench, second)(node="/second", message_type=String)
    for word in (f"the {second} of /second", "/number", "std_msgs/msg/String", "std_msgs/msg/Int64"):
        assert word in str(caught.value)
    topic = bench.bus.topics["/number"]
    assert len(topic.publishers) + len(topic.subscriptions) == 1


@pytest.mark.parametrize("publisher_first", [True, False])
@virtual_time
async def test_incompatible_qos_is_refused(make_bench, publisher_first):
    bench = make_bench()
    ends = [lambda: bench.publisher(reliability="best_effort"), bench.subscription]
    first, second = ends if publisher_first else reversed(ends)
    first()
    with pytest.raises(IncompatibleQoS) as caught:
        second()
    for word in ("the publisher of /source", "the subscription of /sink", "/number", "best_effort is offered", "set "):
        assert word in str(caught.value)
    topic = bench.bus.topics["/number"]
    assert len(topic.publishers) + len(topic.subscriptions) == 1


@virtual_time
async def test_two_buses_in_one_process_never_meet(make_bench):
    here, there = make_bench(), make_bench()
    publisher = here.publisher()
    received, elsewhere = here.subscription(), there.subscription(message_type=String)
    publisher.publish(number(1))
    await settle()
    assert queued(received) == [1]
    assert queued(elsewhere) == []


@virtual_time
async def test_topics_do_not_meet_either(make_bench):
    bench = make_bench()
    publisher, other = bench.publisher("/one"), bench.subscription(topic="/two", message_type=String)
    publisher.publish(number(1))
    assert queued(other) == []
    assert publisher.subscription_count == 0


@virtual_time
async def test_on_attach_precedes_the_first_message(make_bench):
    bench, received = make_bench(), []
    latched = {"durability": "transient_local"}
    bench.publisher(**latched).publish(number(1))
    bench.bus.on_attach.append(lambda attached: received.append((type(attached).__name__, attached.topic)))
    bench.subscription(**latched)
    bench.publisher(**latched)
    assert received == [("Subscription", "/number"), ("Publisher", "/number")]


@virtual_time
async def test_tap_gets_every_message_without_ledger_line(make_bench):
    bench, received = make_bench(), []
    publisher, slow = bench.publisher(), bench.subscription(depth=1, overflow="drop_newest")
    bench.bus.tap(bench.bus.topics["/number"], lambda message: received.append(message.data))
    publisher.publish(number(1))
    await publisher.send(number(2))
    assert received == [1, 2]
    assert queued(slow) == [1]
    assert publisher.subscription_count == 1
    assert len(list(bench.bus.ledger())) == 1


# The account.


@virtual_time
async def test_ledger_lists_present_and_past_subscriptions(make_bench):
    bench = make_bench()
    publisher = bench.publisher()
    gone, closed, there = (bench.subscription(node=node) for node in ("/gone", "/closed", "/there"))
    publisher.publish(number(1))
    gone.close()
    gone.close()
    closed.close()
    publisher.publish(number(2))
    assert there.latest == number(2)
    lines = {line.node: line for line in bench.bus.ledger()}
    assert len(list(bench.bus.ledger())) == 3
    assert [
        (lines[node].published, lines[node].delivered, lines[node].dropped, lines[node].queued) for node in lines
    ] == [
        (2, 1, 1, 0),
        (1, 0, 0, 1),
        (1, 0, 0, 1),
    ]


@virtual_time
async def test_closed_bus_keeps_queued_messages_counted(make_bench):
    bench, received = make_bench(), []
    publisher, subscription = bench.publisher(), bench.subscription(received.append)
    publisher.publish(number(1))
    bench.bus.close()
    publisher.publish(number(2))
    await settle()
    assert received == []
    [line] = bench.bus.ledger()
    assert (line.published, line.queued) == (2, 2)
    bench.bus.open()
    await settle()
    assert received == [number(1), number(2)]
    assert subscription.delivered == 2


# Other threads.


@virtual_time
async def test_messages_of_each_thread_stay_in_order(make_bench):
    bench, received = make_bench(), []
    bench.subscription(lambda message: received.append(message.data), depth=1000)
    publishers = [bench.publisher(node=f"/source_{index}") for index in range(4)]

    def publish(index):
        for count in range(200):
            publishers[index].publish(number(1000 * index + count))

    threads = [threading.Thread(target=publish, args=[index]) for index in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        await asyncio.to_thread(thread.join, 10)
    await settle()
    assert sorted(received) == [1000 * index + count for index in range(4) for count in range(200)]
    for index in range(4):
        own = [value for value in received if value // 1000 == index]
        assert own == sorted(own)
    assert (bench.bus.inbox.taken, bench.bus.inbox.dropped) == (800, 0)


@virtual_time
async def test_full_inbox_drops_its_oldest_message(make_bench):
    bench, received = make_bench(), []
    publisher = bench.publisher()
    bench.subscription(lambda message: received.append(message.data), depth=2 * INBOX_DEPTH)
    in_a_thread(lambda: [publisher.publish(number(index)) for index in range(INBOX_DEPTH + 10)])
    await settle()
    assert received == list(range(10, INBOX_DEPTH + 10))
    assert (bench.bus.inbox.taken, bench.bus.inbox.dropped) == (INBOX_DEPTH, 10)
    assert publisher.published == INBOX_DEPTH
    assert bench.bus.topics[publisher.topic].statistics().losses == {"inbox_dropped": 10}


@virtual_time
async def test_inbox_counts_messages_refused_by_a_full_queue(make_bench):
    bench = make_bench()
    publisher, slow = bench.publisher(), bench.subscription(overflow="block", depth=2)
    in_a_thread(lambda: [publisher.publish(number(index)) for index in range(5)])
    await settle()
    assert queued(slow) == [0, 1]
    assert (bench.bus.inbox.taken, bench.bus.inbox.refused) == (5, 3)
    assert bench.bus.topics[publisher.topic].statistics().losses == {"inbox_refused": 3}


@virtual_time
async def test_closed_publisher_in_inbox_refuses_only_its_messages(make_bench):
    bench = make_bench()
    leaving, staying, subscription = bench.publisher(), bench.publisher(), bench.subscription()
    in_a_thread(lambda: [publisher.publish(number(1)) for publisher in (leaving, staying, leaving, staying)])
    leaving.close()
    await settle()
    assert queued(subscription) == [1, 1]
    assert (bench.bus.inbox.taken, bench.bus.inbox.refused) == (4, 2)


@virtual_time
async def test_messages_behind_a_failing_publish_are_counted(make_bench):
    bench, errors, losses = make_bench(), [], Counter()
    asyncio.get_running_loop().set_exception_handler(lambda _, context: errors.append(context["exception"]))
    in_a_thread(lambda: [bench.bus.inbox.put(losses, lambda: 1 / 0) for _ in range(3)])
    await settle()
    assert [type(error) for error in errors] == [ZeroDivisionError]
    assert losses == {"inbox_dropped": 2}


@virtual_time
async def test_messages_from_threads_after_the_end_are_counted(make_bench):
    bench = make_bench()
    publisher, subscription = bench.publisher(), bench.subscription()
    in_a_thread(publisher.publish, number(1))
    bench.bus.close()
    in_a_thread(publisher.publish, number(2))
    await settle()
    assert queued(subscription) == []
    assert (bench.bus.inbox.taken, bench.bus.inbox.dropped) == (0, 2)
    assert bench.bus.topics[publisher.topic].statistics().losses == {"inbox_dropped": 2}


@virtual_time
async def test_messages_from_threads_before_open_are_delivered():
    bus = Bus(SimClock())
    publisher = Publisher(Int64, Endpoint("/source", "/number", Int64, QoS(), "source", "number"))
    subscription = Subscription(Int64, Endpoint("/sink", "/number", Int64, QoS(), "sink", "number"))
    bus.attach_publisher(publisher)
    bus.attach_subscription(subscription, lambda *_: None)
    in_a_thread(publisher.publish, number(1))
    await settle()
    assert queued(subscription) == []
    bus.open()
    await settle()
    assert queued(subscription) == [1]


@virtual_time
async def test_message_from_a_thread_is_handled_when_published(make_bench):
    bench, received = make_bench(), []
    publisher = bench.publisher()
    bench.subscription(received.append)
    for count in (1, 2):
        in_a_thread(publisher.publish, number(count))
        for _ in range(10):
            if publisher.published < count:
                await asyncio.sleep(0)
        assert len(received) == count


@virtual_time
async def test_call_from_another_thread_returns_or_raises(make_bench):
    bus = make_bench().bus
    loop_thread = threading.get_ident()
    assert bus.call(threading.get_ident) == loop_thread
    assert await asyncio.to_thread(bus.call, threading.get_ident) == loop_thread
    with pytest.raises(ZeroDivisionError):
        await asyncio.to_thread(bus.call, lambda: 1 / 0)


@virtual_time
async def test_call_on_a_busy_loop_is_cancelled(make_bench, limits):
    bus, called, caught = make_bench().bus, [], []
    limits(thread_call=0.01)

    def ask():
        try:
            bus.call(lambda: called.append(1))
        except NotRunning as error:
            caught.append(str(error))

    in_a_thread(ask)
    await settle()
    assert caught == ["the graph's event loop did nothing else within 0.01 s"]
    assert called == []


@virtual_time
async def test_call_on_a_closed_bus_raises(make_bench):
    bus = make_bench().bus
    bus.close()
    with pytest.raises(NotRunning, match="is not running"):
        await asyncio.to_thread(bus.call, list)


@virtual_time
async def test_call_raises_the_functions_own_timeout(make_bench):
    def late():
        raise TimeoutError("the device")

    with pytest.raises(TimeoutError, match="the device"):
        await asyncio.to_thread(make_bench().bus.call, late)


@virtual_time
async def test_remote_publisher_is_checked_by_its_mirror(make_bench):
    bench = make_bench()
    endpoint = Endpoint("/away", "/number", Int64, QoS(reliability="best_effort"), "away", "number", remote=True)
    publisher = Publisher(Int64, endpoint)
    bench.bus.attach_publisher(publisher)
    subscription = bench.subscription(reliability="reliable")
    publisher.publish(number(1))
    assert queued(subscription) == [1]
    with pytest.raises(IncompatibleQoS):
        bench.publisher(reliability="best_effort")


@virtual_time
async def test_tap_that_is_removed_gets_no_more(make_bench):
    bench, received = make_bench(), []
    publisher = bench.publisher()
    topic = bench.bus.topics["/number"]
    bench.bus.tap(topic, received.append)
    publisher.publish(number(1))
    bench.bus.untap(topic, received.append)
    publisher.publish(number(2))
    assert received == [number(1)]


@virtual_time
async def test_recent_messages_are_kept_when_requested(make_bench):
    bench = make_bench()
    publisher = bench.publisher()
    topic = bench.bus.topics["/number"]
    bench.bus.keep_recent(topic, 2)
    for value in (1, 2, 3):
        publisher.publish(number(value))
    assert list(topic.recent) == [number(2), number(3)]
    bench.bus.keep_recent(topic, 0)
    publisher.publish(number(4))
    assert topic.recent is None
