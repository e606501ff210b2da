"""Tests of `subscription.py`: one message at a time, in order, to a handler or by pulling; all accounted for."""

import asyncio

import pytest

from busflow.bus.bus import BusObserver
from busflow.bus.endpoint import Endpoint
from busflow.bus.events import DeadlineMissed, LivelinessChanged, SubscriptionMatched
from busflow.bus.qos import Overflow, QoS
from busflow.bus.subscription import Subscription
from busflow.errors import Occupied
from busflow.msgs.std_msgs import Int64
from busflow.testing import virtual_time
from tests.bus.conftest import number, publish, queued, settle


class Collecting:
    """Handlers of both kinds that collect what they are handed."""

    def __init__(self, *, fail_on=None, error=None):
        self.values, self.fail_on, self.error = [], fail_on, error

    def plain(self, message):
        self.values.append(message.data)
        if message.data == self.fail_on:
            raise self.error

    async def waiting(self, message):
        await asyncio.sleep(0.01)
        self.plain(message)

    async def hasty(self, message):
        self.plain(message)


KINDS = ["plain", "waiting", "hasty"]


# Being handed messages.


@virtual_time
async def test_queue_overflows_during_an_async_handler(make_bench):
    bench, collected = make_bench(), Collecting()
    subscription = bench.subscription(collected.waiting, depth=2)
    publisher = bench.publisher()
    publish(publisher, 0)
    await settle()
    publish(publisher, 1, 2, 3, 4)
    await asyncio.sleep(1)
    assert collected.values == [0, 3, 4]
    assert subscription.statistics().drops == {"overflow": 2}


@virtual_time
async def test_delivered_counts_the_hand_over_not_the_return(make_bench):
    bench, seen = make_bench(), []
    subscription = bench.subscription(lambda _message: seen.append((subscription.delivered, len(subscription.queue))))
    publish(bench.publisher(), 1, 2)
    await settle()
    assert seen == [(1, 1), (2, 0)]


@virtual_time
async def test_message_from_a_handler_is_delivered_at_once(make_bench):
    bench, collected = make_bench(), Collecting()
    relay = bench.publisher("/relayed")
    bench.subscription(relay.publish)
    bench.subscription(collected.plain, "/relayed")
    publish(bench.publisher(), 1, 2)
    await asyncio.sleep(0)
    assert collected.values == [1, 2]


@pytest.mark.parametrize("kind", ["plain", "hasty"])
@virtual_time
async def test_endless_self_publishing_does_not_block_the_loop(make_bench, kind):
    bench, count = make_bench(), 0
    publisher = bench.publisher()

    def again(message):
        nonlocal count
        count += 1
        publisher.publish(message)

    async def again_and_again(message):
        again(message)

    bench.subscription(again if kind == "plain" else again_and_again)
    publish(publisher, 1)
    for _ in range(10):
        await asyncio.sleep(0)
    assert 0 < count < 10_000


@virtual_time
async def test_endless_pull_does_not_block_the_loop(make_bench):
    bench = make_bench()
    publisher, subscription = bench.publisher(), bench.subscription(depth=1000)

    async def reading():
        async for message in subscription:
            publisher.publish(message)

    publish(publisher, *range(1000))
    task = asyncio.create_task(reading())
    for _ in range(10):
        await asyncio.sleep(0)
    assert 0 < subscription.delivered < 10_000
    task.cancel()
    await asyncio.wait([task])
    assert task.cancelled()
    assert bench.balanced()


@pytest.mark.parametrize("before", [0, 1, 200])
@virtual_time
async def test_cancelled_task_takes_no_message(make_bench, before):
    bench = make_bench()
    publisher, subscription = bench.publisher(), bench.subscription(depth=1000)
    publish(publisher, *range(before + 1))

    async def reading():
        for _ in range(before):
            await anext(subscription)
        asyncio.current_task().cancel()
        await anext(subscription)

    task = asyncio.create_task(reading())
    await asyncio.wait([task])
    assert task.cancelled()
    assert queued(subscription) == [before]


@virtual_time
async def test_task_that_caught_its_cancellation_drains_the_queue(make_bench):
    bench = make_bench()
    publisher, subscription = bench.publisher(), bench.subscription()

    async def reading():
        try:
            await anext(subscription)
        except asyncio.CancelledError:
            return [(await anext(subscription)).data for _ in range(3)]

    task = asyncio.create_task(reading())
    await asyncio.sleep(1)
    task.cancel()
    publish(publisher, 1, 2, 3)
    assert await task == [1, 2, 3]


class Unforeseen(BaseException):
    pass


ERRORS = [
    ValueError("no"),
    SystemExit(3),
    KeyboardInterrupt(),
    asyncio.CancelledError(),
    StopIteration(),
    StopAsyncIteration(),
    BaseExceptionGroup("two", [ValueError(), SystemExit()]),
    Unforeseen(),
]


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
@pytest.mark.parametrize("kind", KINDS)
@virtual_time
async def test_failed_handler_is_reported_once_and_stopped(make_bench, kind, error):
    bench, collected = make_bench(), Collecting(fail_on=2, error=error)
    subscription = bench.subscription(getattr(collected, kind))
    publisher, other = bench.publisher(), Collecting()
    bench.subscription(other.plain)
    publish(publisher, 1, 2, 3)
    await asyncio.sleep(1)
    publish(publisher, 4)
    await asyncio.sleep(1)
    assert collected.values == [1, 2]
    [(raised, message)] = bench.failures
    # Python itself turns a StopIteration that leaves a coroutine into a RuntimeError.
    assert error in (raised, raised.__cause__)
    assert message == number(2)
    assert (subscription.delivered, queued(subscription)) == (2, [3, 4])
    assert other.values == [1, 2, 3, 4]
    assert bench.balanced()


@virtual_time
async def test_handler_cancelled_from_outside_has_not_failed(make_bench):
    bench, collected = make_bench(), Collecting()
    subscription = bench.subscription(collected.waiting)
    publish(bench.publisher(), 1, 2)
    await settle()
    [pump] = bench.pumps
    pump.cancel()
    await asyncio.wait([pump])
    assert pump.cancelled()
    assert bench.failures == []
    assert (subscription.delivered, queued(subscription)) == (1, [2])


@virtual_time
async def test_handler_may_close_its_own_subscription(make_bench):
    bench, values = make_bench(), []

    def handle(message):
        values.append(message.data)
        subscription.close()

    subscription = bench.subscription(handle)
    publisher = bench.publisher()
    publish(publisher, 1, 2)
    await settle()
    publish(publisher, 3)
    await settle()
    assert values == [1]
    [line] = bench.bus.ledger()
    assert (line.published, line.delivered, line.queued) == (2, 1, 1)


# Pulling.


@virtual_time
async def test_two_tasks_cannot_wait_for_one_subscription(golden, make_bench):
    bench = make_bench()
    publisher, subscription = bench.publisher(), bench.subscription()
    first = asyncio.create_task(anext(subscription))
    await settle()
    with golden.raises(Occupied):
        await anext(subscription)
    publish(publisher, 1)
    assert (await first).data == 1


# Coming and going.


@virtual_time
async def test_unattached_subscription_has_received_nothing(golden):
    endpoint = Endpoint(
        "/sink", "/number", Int64, QoS(overflow=Overflow.DROP_NEWEST, depth=3), "Sink.numbers", "number"
    )
    subscription = Subscription(Int64, endpoint)
    assert subscription.latest is None
    assert (subscription.published, subscription.publisher_count) == (0, 0)
    golden(repr(subscription))
    assert (subscription.statistics().depth, subscription.statistics().overflow) == (3, Overflow.DROP_NEWEST)
    subscription.close()
    assert [message async for message in subscription] == []


# Limits in time.


@pytest.mark.parametrize("kind", KINDS)
@virtual_time
async def test_handler_gets_no_expired_message(make_bench, kind):
    bench, collected = make_bench(), Collecting()
    subscription = bench.subscription(getattr(collected, kind))
    publisher = bench.publisher(lifespan_s=1)
    subscription.pause()
    for value in (1, 2, 3):
        publish(publisher, value)
        await asyncio.sleep(0.4)
    if (pump := subscription.open()) is not None:
        bench.pumps.append(asyncio.create_task(pump))
    await asyncio.sleep(0.1)
    assert collected.values == [2, 3]
    assert subscription.statistics().drops == {"expired": 1}


@virtual_time
async def test_deadline_event_comes_once_per_silent_period(make_bench):
    bench, events = make_bench(), []
    publisher = bench.publisher(deadline_s=1)
    subscription, unheard = bench.subscription(deadline_s=1), bench.subscription(deadline_s=1)
    for end in (publisher, subscription):
        end.on_event = events.append
    await asyncio.sleep(10)
    assert events == []
    publish(publisher, 1)
    await asyncio.sleep(0.9)
    publish(publisher, 2)
    await asyncio.sleep(2.5)
    assert events == [DeadlineMissed("/number", 1)] * 2 + [DeadlineMissed("/number", 2)] * 2
    assert [each.statistics().deadlines_missed for each in (publisher, subscription, unheard)] == [2, 2, 2]
    unheard.close()
    publish(publisher, 3)
    publisher.close()
    subscription.close()
    await asyncio.sleep(10)
    assert sum(isinstance(event, DeadlineMissed) for event in events) == 4


@virtual_time
async def test_publisher_silent_beyond_its_lease_is_not_alive(make_bench):
    bench, events = make_bench(), []
    limits = {"liveliness": "manual_by_topic", "lease_s": 1}
    subscription = bench.subscription(**limits)
    subscription.on_event = events.append
    publisher = bench.publisher(**limits)
    publisher.assert_liveliness()
    bench.subscription(**limits)
    await asyncio.sleep(0.9)
    publish(publisher, 1)
    await asyncio.sleep(0.9)
    assert events == [SubscriptionMatched("/number", 1, 1, 1, 1), LivelinessChanged("/number", 1, 0)]
    await asyncio.sleep(0.2)
    publisher.assert_liveliness()
    publisher.close()
    changes = [(event.alive, event.not_alive) for event in events if isinstance(event, LivelinessChanged)]
    assert changes == [(1, 0), (0, 1), (1, 0), (0, 0)]
    assert publisher.liveliness_lost == 1


# Misuse.


@virtual_time
async def test_plain_handler_returning_a_coroutine_fails(make_bench):
    bench, collected = make_bench(), Collecting()

    def handle(message):
        return collected.hasty(message)

    bench.subscription(handle)
    publish(bench.publisher(), 1)
    await settle()
    [(raised, message)] = bench.failures
    assert "async def" in str(raised)
    assert message == number(1)


@virtual_time
async def test_pulling_beside_a_handler_is_refused(golden, make_bench):
    bench, collected = make_bench(), Collecting()
    subscription = bench.subscription(collected.plain)
    publish(bench.publisher(), 1, 2)
    with golden.raises(Occupied):
        await anext(subscription)
    with pytest.raises(Occupied):
        _ = subscription.latest
    await settle()
    assert collected.values == [1, 2]


@virtual_time
async def test_message_of_a_new_perishable_publisher_is_unpacked(make_bench):
    bench, values = make_bench(), []
    first = bench.publisher()

    def on_message(message):
        values.append(message.data)
        if message.data == 1:
            publish(bench.publisher(lifespan_s=1), 2)

    bench.subscription(on_message)
    publish(first, 1)
    await settle()
    assert values == [1, 2]
    assert bench.failures == []


@virtual_time
async def test_all_observers_of_a_pulled_subscription_are_called(make_bench):
    bench, received = make_bench(), []
    publisher, pulled = bench.publisher(), bench.subscription()
    pulled.observe(lambda message: received.append(("first", message.data)))
    pulled.observe(lambda message: received.append(("second", message.data)))
    publish(publisher, 1)
    assert pulled.latest == number(1)
    assert sorted(received) == [("first", 1), ("second", 1)]


@virtual_time
async def test_successor_keeps_deadline_and_link(make_bench):
    bench, events, changes = make_bench(), [], []
    publisher = bench.publisher(deadline_s=1)
    before = bench.subscription(lambda _message: None, deadline_s=1, depth=1)

    class Changes(BusObserver):
        def subscription_added(self, subscription):
            changes.append(("came", subscription))

        def endpoint_removed(self, end):
            changes.append(("left", end))

    bench.bus.observe(Changes())
    publish(publisher, 1)
    await asyncio.sleep(0.6)
    after = Subscription(Int64, before.endpoint, lambda _message: None)
    after.on_event = events.append
    bench.bus.attach_subscription(after, bench.failures.append, before)
    assert changes == [("left", before), ("came", after)]
    await asyncio.sleep(0.6)
    assert [event for event in events if isinstance(event, DeadlineMissed)] == [DeadlineMissed("/number", 1)]
    assert len(list(bench.bus.ledger())) == 1
    assert bench.balanced()


@virtual_time
async def test_earlier_messages_count_as_published(make_bench):
    bench = make_bench()
    publisher, subscription = bench.publisher(), bench.subscription()
    subscription.receive_earlier([number(1), number(2)])
    publish(publisher, 3)
    assert queued(subscription) == [1, 2, 3]
    assert (subscription.published, publisher.published) == (3, 1)
    assert bench.balanced()


@virtual_time
async def test_duplicate_that_a_link_withholds_is_not_counted(make_bench):
    class Link:
        held = 0

        def __init__(self, target):
            self.target = target

        def carry(self, item):
            if item.data == 1:
                self.target.discount_duplicate()
            else:
                self.target.receive(item)

    bench = make_bench()
    publisher, subscription = bench.publisher(), bench.subscription()
    subscription.link = Link(subscription)
    bench.bus.topics["/number"].rebuild()
    publish(publisher, 1, 2)
    assert queued(subscription) == [2]
    assert subscription.published == 1
    assert bench.balanced()


@virtual_time
async def test_drops_are_observed_from_the_attachment_on(make_bench):
    bench, reasons = make_bench(), []
    endpoint = Endpoint("/sink", "/number", Int64, QoS(depth=1), "Sink.numbers", "number")
    subscription = Subscription(Int64, endpoint)
    subscription.observe_drops(reasons.append)
    bench.bus.attach_subscription(subscription, bench.failures.append)
    publish(bench.publisher(), 1, 2, 3)
    assert reasons == ["overflow", "overflow"]


@virtual_time
async def test_successor_of_a_closed_subscription_is_closed(make_bench):
    bench = make_bench()
    publisher, before = bench.publisher(), bench.subscription()
    publish(publisher, 1)
    before.close()
    after = Subscription(Int64, before.endpoint)
    bench.bus.attach_subscription(after, bench.failures.append, before)
    publish(publisher, 2)
    assert queued(after) == [1]
    assert bench.bus.topics["/number"].subscriptions == []


@virtual_time
async def test_unattached_iteration_waits_until_the_close():
    subscription = Subscription(Int64, Endpoint("/sink", "/number", Int64, QoS(), "Sink.numbers", "number"))

    async def received():
        return [message async for message in subscription]

    task = asyncio.create_task(received())
    await settle()
    assert not task.done()
    subscription.close()
    assert await task == []
