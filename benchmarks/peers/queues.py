"""Queues: what Python and anyio have for handing messages on, and the bare loop of calls under everything."""

from __future__ import annotations

import asyncio
from collections import defaultdict
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from inspect import iscoroutinefunction
from typing import Any

from benchmarks.peers import Handler, Publish


@asynccontextmanager
async def bare_calls(sources: Sequence[str], handlers: Sequence[tuple[str, Handler]]) -> AsyncIterator[list[Publish]]:
    """A list of handlers, called one after the other: no queue, no isolation, the floor of all others."""
    by_topic = grouped(handlers)

    def publisher(topic: str) -> Publish:
        hear = tuple(by_topic[topic])

        def publish(message: Any) -> None:
            for handler in hear:
                handler(message)

        return publish

    yield [publisher(topic) for topic in sources]


@asynccontextmanager
async def asyncio_queues(
    sources: Sequence[str], handlers: Sequence[tuple[str, Handler]]
) -> AsyncIterator[list[Publish]]:
    """A queue and a task for each handler."""

    async def pump(queue: asyncio.Queue[Any], handler: Handler) -> None:
        while True:
            handler(await queue.get())

    async def pump_async(queue: asyncio.Queue[Any], handler: Handler) -> None:
        while True:
            await handler(await queue.get())

    puts: dict[str, list[Callable[[Any], None]]] = defaultdict(list)
    tasks: list[asyncio.Task[None]] = []
    for topic, handler in handlers:
        queue = asyncio.Queue[Any](100_000)
        pumping = pump_async if iscoroutinefunction(handler) else pump
        tasks.append(asyncio.create_task(pumping(queue, handler)))
        puts[topic].append(queue.put_nowait)
    yield [to_all(puts[topic]) for topic in sources]
    await ended(tasks)


@asynccontextmanager
async def anyio_streams(
    sources: Sequence[str], handlers: Sequence[tuple[str, Handler]]
) -> AsyncIterator[list[Publish]]:
    """A memory object stream and a task for each handler."""
    import anyio

    async def pump(stream: Any, handler: Handler) -> None:
        async for message in stream:
            handler(message)

    async def pump_async(stream: Any, handler: Handler) -> None:
        async for message in stream:
            await handler(message)

    puts: dict[str, list[Callable[[Any], None]]] = defaultdict(list)
    streams: list[Any] = []
    async with anyio.create_task_group() as tasks:
        for topic, handler in handlers:
            send, receive = anyio.create_memory_object_stream[Any](100_000)
            streams += (send, receive)
            tasks.start_soon(pump_async if iscoroutinefunction(handler) else pump, receive, handler)
            puts[topic].append(send.send_nowait)
        yield [to_all(puts[topic]) for topic in sources]
        tasks.cancel_scope.cancel()
    for stream in streams:
        stream.close()


def grouped(handlers: Sequence[tuple[str, Handler]]) -> dict[str, list[Handler]]:
    by_topic: dict[str, list[Handler]] = defaultdict(list)
    for topic, handler in handlers:
        by_topic[topic].append(handler)
    return by_topic


def to_all(puts: Sequence[Callable[[Any], None]]) -> Publish:
    """Puts into every queue; into a single one without a detour."""
    if len(puts) == 1:
        return puts[0]

    def publish(message: Any) -> None:
        for put in puts:
            put(message)

    return publish


async def ended(tasks: Sequence[asyncio.Task[None]]) -> None:
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
