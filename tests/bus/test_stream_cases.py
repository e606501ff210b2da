"""Cases of queues, streams and cancellation from anyio, trio and asyncio that no other test of the bus holds."""

import asyncio
import gc
import weakref

from busflow.testing import virtual_time
from tests.bus.conftest import number, settle


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
