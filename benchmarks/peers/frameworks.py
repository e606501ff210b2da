"""Frameworks: packages that bring an event bus, a broker or a graph of their own."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from functools import partial
from inspect import iscoroutinefunction
from typing import Any

from benchmarks.peers import Handler, Publish


@asynccontextmanager
async def bubus(sources: Sequence[str], handlers: Sequence[tuple[str, Handler]]) -> AsyncIterator[list[Publish]]:
    """A bus, and a class of events for each topic. An event is made for each message: none can be sent twice."""
    from bubus import BaseEvent, EventBus

    def kind(topic: str) -> type[Any]:
        return type(topic, (BaseEvent,), {"__annotations__": {"x": float, "y": float, "z": float}})

    topics = dict.fromkeys([*sources, *(topic for topic, _ in handlers)])
    kinds = {topic: kind(topic) for topic in topics}
    bus = EventBus(name=f"bus_{id(topics)}")
    for number, (topic, handler) in enumerate(handlers):
        bus.on(kinds[topic], _named(handler, f"handler_{number}"))

    async def publish(topic: str, message: Any) -> None:
        await bus.dispatch(kinds[topic](x=message.x, y=message.y, z=message.z))

    yield [partial(publish, topic) for topic in sources]
    await bus.stop()


def _named(handler: Handler, name: str) -> Handler:
    """A handler with a name of its own, by which the bus keeps them apart."""

    async def take_async(event: Any) -> None:
        await handler(event)

    def take(event: Any) -> None:
        handler(event)

    chosen = take_async if iscoroutinefunction(handler) else take
    chosen.__name__ = name
    return chosen


@asynccontextmanager
async def faststream(sources: Sequence[str], handlers: Sequence[tuple[str, Handler]]) -> AsyncIterator[list[Publish]]:
    """A broker of NATS under its test client: no server, but all of its encoding and decoding."""
    from faststream.nats import NatsBroker, TestNatsBroker
    from pydantic import BaseModel

    class Point(BaseModel):
        x: float
        y: float
        z: float

    def take_all(topic: str, handler: Handler) -> None:
        if iscoroutinefunction(handler):

            @broker.subscriber(topic)
            async def take_async(point: Point) -> None:
                await handler(point)
        else:

            @broker.subscriber(topic)
            def take(point: Point) -> None:
                handler(point)

    broker = NatsBroker(logger=None)
    for topic, handler in handlers:
        take_all(topic, handler)
    point = Point(x=1.0, y=2.0, z=3.0)

    async def publish(topic: str, _message: object) -> None:
        await client.publish(point, topic)

    async with TestNatsBroker(broker) as client:
        yield [partial(publish, topic) for topic in sources]


@asynccontextmanager
async def ezmsg(sources: Sequence[str], handlers: Sequence[tuple[str, Handler]]) -> AsyncIterator[list[Publish]]:
    """Its channels within a process, with a task for each handler."""
    import ezmsg.core as ez

    async def pump(subscriber: Any, handler: Handler) -> None:
        while True:
            async with subscriber.recv_zero_copy() as message:
                handler(message)

    async def pump_async(subscriber: Any, handler: Handler) -> None:
        while True:
            async with subscriber.recv_zero_copy() as message:
                await handler(message)

    async with ez.GraphContext(auto_start=True) as context:
        publishers = [await context.publisher(topic) for topic in sources]
        tasks: list[asyncio.Task[None]] = []
        for topic, handler in handlers:
            pumping = pump_async if iscoroutinefunction(handler) else pump
            tasks.append(asyncio.create_task(pumping(await context.subscriber(topic), handler)))
        await asyncio.sleep(0.3)  # until they have found one another
        yield [publisher.broadcast for publisher in publishers]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
