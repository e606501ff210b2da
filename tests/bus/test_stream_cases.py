"""Cases of queues, streams and cancellation from anyio, trio and asyncio that no other test of the bus holds."""

import asyncio
import gc
import weakref

import pytest

from busflow.bus.queues import create_queue
from busflow.errors import NotRunning
from busflow.msgs.std_msgs import Int64
from busflow.testing import virtual_time


async def settle():
    await asyncio.get_running_loop().settle()


def number(value):
    return Int64(data=value)


@pytest.mark.parametrize("overflow", ["drop_oldest", "drop_newest", "block"])
def test_negative_capacity_is_refused(overflow):
    with pytest.raises(ValueError, match="-1"):
        create_queue(overflow, -1)


@pytest.mark.parametrize("overflow", ["drop_oldest", "drop_newest", "block"])
@virtual_time
async def test_waiting_reader_takes_messages_in_order(make_bench, overflow):
    bench = make_bench()
    publisher, subscription = bench.publisher(), bench.subscription(overflow=overflow, depth=2)
    reading = asyncio.create_task(anext(subscription))
    await settle()
    publisher.publish(number(1))
    publisher.publish(number(2))
    assert [await reading, await anext(subscription)] == [number(1), number(2)]
    assert bench.balanced()


@pytest.mark.parametrize("overflow", ["drop_oldest", "drop_newest", "block"])
@virtual_time
async def test_cancelled_reader_leaves_the_next_message(make_bench, overflow):
    bench = make_bench()
    publisher, subscription = bench.publisher(), bench.subscription(overflow=overflow, depth=1)
    reading = asyncio.create_task(anext(subscription))
    await settle()
    reading.cancel()
    publisher.publish(number(1))
    await settle()
    assert reading.cancelled()
    assert await anext(subscription) == number(1)
    assert bench.balanced()


@virtual_time
async def test_reader_timed_out_blocks_no_publisher(make_bench):
    bench = make_bench()
    publisher, subscription = bench.publisher(), bench.subscription(overflow="block", depth=1)
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(10):
            await anext(subscription)
    await publisher.send(number(1))
    assert len(subscription.queue) == 1


@virtual_time
async def test_closing_one_publisher_leaves_the_other(make_bench):
    bench = make_bench()
    one, other = bench.publisher(), bench.publisher(node="/other")
    subscription = bench.subscription(overflow="block", depth=1)
    one.publish(number(1))
    first = asyncio.create_task(one.send(number(2)))
    await settle()
    second = asyncio.create_task(other.send(number(3)))
    await settle()
    one.close()
    assert await anext(subscription) == number(1)
    with pytest.raises(NotRunning):
        await first
    await second
    assert await anext(subscription) == number(3)


@virtual_time
async def test_closing_one_subscription_leaves_the_other(make_bench):
    bench = make_bench()
    publisher, one, other = bench.publisher(), bench.subscription(), bench.subscription(node="/other")
    waiting = [asyncio.create_task(_list(each)) for each in (one, other)]
    await settle()
    one.close()
    publisher.publish(number(1))
    other.close()
    assert await asyncio.gather(*waiting) == [[], [number(1)]]


async def _list(subscription):
    return [message async for message in subscription]


@virtual_time
async def test_messages_sent_before_both_close_arrive(make_bench):
    bench = make_bench()
    publisher, subscription = bench.publisher(), bench.subscription(overflow="block", depth=1)
    reading = asyncio.create_task(_list(subscription))
    await settle()
    await publisher.send(number(1))
    publisher.close()
    subscription.close()
    assert await reading == [number(1)]


@virtual_time
async def test_full_depth_is_read_after_the_close(make_bench):
    bench = make_bench()
    publisher, subscription = bench.publisher(), bench.subscription(depth=10)
    for value in range(10):
        publisher.publish(number(value))
    subscription.close()
    assert await _list(subscription) == [number(value) for value in range(10)]


@virtual_time
async def test_cancelled_task_ends_at_its_first_wait(make_bench):
    bench = make_bench()
    publisher = bench.publisher()
    subscription = bench.subscription(overflow="block", depth=1)
    publisher.publish(number(1))

    async def cancelled_send():
        asyncio.current_task().cancel()
        await publisher.send(number(2))

    task = asyncio.create_task(cancelled_send())
    await asyncio.wait([task])
    assert task.cancelled()
    assert [message.data for message in subscription.queue.items] == [1]


@pytest.mark.xfail(
    reason="making a task reads the f_locals of its maker, whose frame keeps them, up to Python 3.14", strict=True
)
@virtual_time
async def test_cancelled_reader_lets_go_of_its_locals(make_bench):
    bench = make_bench()
    subscription = bench.subscription()

    class Held:
        pass

    async def read(held):
        await anext(subscription)
        del held

    held = Held()
    seen = weakref.ref(held)
    reading = asyncio.create_task(read(held))
    del held
    await settle()
    reading.cancel()
    await asyncio.wait([reading])
    del reading
    gc.collect()
    assert seen() is None


@virtual_time
async def test_work_of_threads_runs_in_order(make_bench):
    bench = make_bench()
    publisher, received = bench.publisher(), []
    bench.subscription(lambda message: received.append(message.data), depth=100)
    await asyncio.to_thread(lambda: [publisher.publish(number(value)) for value in range(50)])
    await settle()
    assert received == list(range(50))
