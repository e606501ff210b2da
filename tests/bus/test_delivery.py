"""Tests of `delivery.py`: which recipients are woken, how often, and that uncounted drops are still in the ledger."""

import asyncio

import pytest

from busflow.testing import virtual_time
from busflow.testing.link_faults import Faults
from tests.bus.conftest import publish, settle

KINDS = ["plain", "async", "pulled"]


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
