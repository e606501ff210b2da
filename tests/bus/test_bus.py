"""Tests of `bus.py`, `inbox.py` and `endpoint.py`: endpoints that fit, every message accounted for, threads."""

import asyncio
import threading
from collections import Counter

import pytest

from busflow.bus.bus import Bus, BusObserver
from busflow.bus.endpoint import Endpoint
from busflow.bus.inbox import INBOX_DEPTH, INBOX_DROPPED
from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS
from busflow.bus.subscription import Subscription
from busflow.clock import SimClock, SystemClock
from busflow.errors import IncompatibleQoS, IncompatibleType, NotRunning
from busflow.msgs.std_msgs import Int64, String
from busflow.testing import virtual_time
from tests.bus.conftest import number, queued, settle


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
async def test_first_endpoint_sets_the_topic_type(golden, make_bench, first, second):
    bench = make_bench()
    getattr(bench, first)(node="/first")
    with golden.raises(IncompatibleType):
        getattr(bench, second)(node="/second", message_type=String)
    topic = bench.bus.topics["/number"]
    assert len(topic.publishers) + len(topic.subscriptions) == 1


@pytest.mark.parametrize("publisher_first", [True, False])
@virtual_time
async def test_incompatible_qos_is_refused(golden, make_bench, publisher_first):
    bench = make_bench()
    ends = [lambda: bench.publisher(reliability="best_effort"), bench.subscription]
    first, second = ends if publisher_first else reversed(ends)
    first()
    with golden.raises(IncompatibleQoS):
        second()
    topic = bench.bus.topics["/number"]
    assert len(topic.publishers) + len(topic.subscriptions) == 1


@virtual_time
async def test_observer_gets_topics_first_and_then_each_end(make_bench):
    bench, seen = make_bench(), []

    class Observer(BusObserver):
        def topic_added(self, topic):
            seen.append(("topic", topic.name, topic.publishers_added, topic.subscriptions_added))

        def publisher_added(self, publisher):
            seen.append(("publisher", publisher.topic))

        def subscription_added(self, subscription):
            seen.append(("subscription", subscription.topic))

    latched = {"durability": "transient_local"}
    bench.publisher(**latched).publish(number(1))
    bench.bus.observe(Observer())
    assert seen == [("topic", "/number", 1, 0)]
    bench.subscription(lambda message: seen.append(message.data), **latched)
    bench.publisher("/other")
    await settle()
    assert seen[1:] == [("subscription", "/number"), ("topic", "/other", 0, 0), ("publisher", "/other"), 1]


# The account.


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


def test_threads_may_use_a_bus_whose_loop_is_closed(golden):
    """A thread may come between the end of the loop and that of the bus."""
    bus = Bus(SystemClock())

    async def open_it():
        bus.open()

    asyncio.run(open_it())
    bus.inbox.put(losses := Counter(), lambda: 1 / 0)
    assert bus.inbox.statistics().waiting == 1
    with golden.raises(NotRunning):
        bus.inbox.call(list)
    bus.close()
    assert (losses, bus.inbox.statistics().waiting) == ({INBOX_DROPPED: 1}, 0)


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
async def test_call_on_a_busy_loop_is_cancelled(golden, make_bench, limits):
    bus, called = make_bench().bus, []
    limits(thread_call=0.01)

    def ask():
        with golden.raises(NotRunning):
            bus.call(lambda: called.append(1))
        called.append("refused")

    in_a_thread(ask)
    await settle()
    assert called == ["refused"]


@virtual_time
async def test_call_on_a_closed_bus_raises(golden, make_bench):
    bus = make_bench().bus
    bus.close()
    with golden.raises(NotRunning):
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
