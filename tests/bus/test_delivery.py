"""Tests of `delivery.py`: which recipients are woken, how often, and that uncounted drops are still in the ledger."""

import asyncio

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.bus.qos import Overflow
from busflow.msgs.std_msgs import Int64
from busflow.testing import virtual_time
from busflow.testing.link_faults import Faults

KINDS = ["plain", "async", "pulled"]


def publish(publisher, *values):
    for value in values:
        publisher.publish(Int64(data=value))


def queued(subscription):
    return [message.data for message in subscription.queue.items]


async def settle():
    await asyncio.get_running_loop().settle()


def receiving(bench, kind, values, **qos):
    """A subscription of a kind that collects what it receives."""

    def plain(message):
        values.append(message.data)

    async def wait(message):
        plain(message)

    async def pull(subscription):
        async for message in subscription:
            plain(message)

    subscription = bench.subscription({"plain": plain, "async": wait, "pulled": None}[kind], **qos)
    if kind == "pulled":
        bench.pumps.append(asyncio.create_task(pull(subscription)))
    return subscription


@pytest.mark.parametrize("overflow", list(Overflow))
@pytest.mark.parametrize("kind", KINDS)
@virtual_time
async def test_idle_subscription_is_woken_by_the_next_message(make_bench, kind, overflow):
    bench, values = make_bench(), []
    publisher = bench.publisher()
    receiving(bench, kind, values, overflow=overflow)
    for value in range(0, 30, 3):
        publish(publisher, value, value + 1, value + 2)
        await settle()
        assert values == list(range(value + 3))


@pytest.mark.parametrize("kind", KINDS)
@virtual_time
async def test_delivery_lets_waiting_sends_go_on(make_bench, kind):
    bench, values = make_bench(), []
    publisher = bench.publisher()
    receiving(bench, kind, values, depth=1, overflow=Overflow.BLOCK)
    async with asyncio.TaskGroup() as sends:
        for value in range(5):
            sends.create_task(publisher.send(Int64(data=value)))
    await settle()
    assert values == [0, 1, 2, 3, 4]


@virtual_time
async def test_busy_subscription_does_not_delay_others(make_bench):
    bench, values, free = make_bench(), {"plain": [], "async": [], "pulled": []}, asyncio.Event()
    publisher = bench.publisher()

    async def busy(_message):
        await free.wait()

    bench.subscription(busy)
    for kind, collected in values.items():
        receiving(bench, kind, collected)
    for value in range(5):
        publish(publisher, value)
        await settle()
    assert values == {kind: [0, 1, 2, 3, 4] for kind in KINDS}
    free.set()


@virtual_time
async def test_idle_subscriptions_run_in_order_of_attachment(make_bench):
    bench, turns = make_bench(), []
    publisher = bench.publisher()
    for name in "abc":
        bench.subscription(lambda _message, name=name: turns.append(name))
    publish(publisher, 1)
    await settle()
    publish(publisher, 2)
    await settle()
    assert turns == list("abcabc")


@virtual_time
async def test_cancelled_pull_leaves_the_message_for_the_next(make_bench):
    bench = make_bench()
    publisher, subscription = bench.publisher(), bench.subscription()
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(1):
            await anext(subscription)
    publish(publisher, 1, 2)
    await settle()
    assert bench.failures == []
    assert [(await anext(subscription)).data for _ in range(2)] == [1, 2]
    waiting = asyncio.create_task(anext(subscription))
    await settle()
    publish(publisher, 3)
    assert (await waiting).data == 3


@pytest.mark.parametrize("kind", KINDS)
@virtual_time
async def test_message_released_by_a_link_wakes_the_receiver(make_bench, kind):
    bench, values = make_bench(), []
    publisher = bench.publisher()
    faults = Faults(bench.bus)
    receiving(bench, kind, values)
    await settle()
    faults.delay("/number", 1)
    publish(publisher, 1)
    await asyncio.sleep(0.5)
    assert values == []
    await asyncio.sleep(1)
    assert values == [1]
    assert bench.balanced()


@pytest.mark.parametrize("kind", KINDS)
@virtual_time
async def test_dropped_message_does_not_wake_the_subscription(make_bench, kind):
    bench, values = make_bench(), []
    publisher = bench.publisher()
    faults = Faults(bench.bus)
    receiving(bench, kind, values)
    faults.drop("/number", every=2)
    for value in range(1, 6):
        publish(publisher, value)
        await settle()
    assert values == [1, 3, 5]
    assert bench.balanced()


@pytest.mark.parametrize("latched", [False, True])
@virtual_time
async def test_failing_outlet_does_not_stop_local_delivery(make_bench, latched):
    bench, values = make_bench(), []
    publisher = bench.publisher(durability="transient_local" if latched else "volatile")
    receiving(bench, "plain", values)

    def refuse(_message):
        raise OSError("no way out")

    publisher.send_through(refuse)
    with pytest.raises(OSError, match="no way out"):
        publish(publisher, 1)
    await settle()
    assert values == [1]
    assert bench.balanced()


@virtual_time
async def test_ledger_balances_inside_a_handler(make_bench):
    bench, seen = make_bench(), []
    publisher = bench.publisher()

    def look(_message):
        (line,) = bench.bus.ledger()
        seen.append((line.published, line.delivered, line.dropped, line.queued))

    bench.subscription(look, depth=3)
    publish(publisher, 1, 2, 3, 4)
    await settle()
    assert seen == [(4, 1, 1, 2), (4, 2, 1, 1), (4, 3, 1, 0)]


STEPS = st.lists(st.one_of(st.integers(1, 6), st.sampled_from(["take", "latest", "observe", "rebuild"])), max_size=30)


@given(depth=st.integers(1, 4), steps=STEPS)
def test_derived_overflow_equals_counted_overflow(make_bench, depth, steps):
    @virtual_time
    async def main():
        bench, value = make_bench(), 0
        publisher = bench.publisher()
        forgetting = bench.subscription(depth=depth)
        counted = {"overflow": 0, "superseded": 0}
        for step in steps:
            if step == "take" and forgetting.queued:
                await anext(forgetting)
            elif step == "latest":
                counted["superseded"] += max(0, forgetting.queued - 1)
                _ = forgetting.latest
            elif step == "observe":
                forgetting.observe_drops(lambda _reason: None)
            elif step == "rebuild":
                forgetting.queue.ignore_drops()
                bench.bus.topics["/number"].rebuild()
            elif isinstance(step, int):
                for _ in range(step):
                    counted["overflow"] += forgetting.queued == depth
                    publish(publisher, value := value + 1)
                assert queued(forgetting)[-1] == value
            drops = forgetting.statistics().drops
            assert {reason: drops.get(reason, 0) for reason in counted} == counted
            assert bench.balanced()

    main()
