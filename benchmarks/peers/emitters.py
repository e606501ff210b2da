"""Emitters: packages for events within a process. Most call the handlers at once, in the publisher's turn."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from functools import partial
from inspect import iscoroutinefunction

from benchmarks.peers import Handler, Publish


@asynccontextmanager
async def blinker(sources: Sequence[str], handlers: Sequence[tuple[str, Handler]]) -> AsyncIterator[list[Publish]]:
    """A signal for each topic."""
    from blinker import Namespace

    signals = Namespace()
    for topic, handler in handlers:
        signals.signal(topic).connect(handler, weak=False)
    yield [signals.signal(topic).send for topic in sources]


@asynccontextmanager
async def pyee(sources: Sequence[str], handlers: Sequence[tuple[str, Handler]]) -> AsyncIterator[list[Publish]]:
    """One emitter; an `async` handler is a task for each message."""
    from pyee.asyncio import AsyncIOEventEmitter

    emitter = AsyncIOEventEmitter(asyncio.get_running_loop())
    for topic, handler in handlers:
        emitter.on(topic, handler)
    yield [partial(emitter.emit, topic) for topic in sources]
    await asyncio.sleep(0)


@asynccontextmanager
async def subjects(sources: Sequence[str], handlers: Sequence[tuple[str, Handler]]) -> AsyncIterator[list[Publish]]:
    """reactivex: a subject for each topic, which calls its observers."""
    from reactivex.subject import Subject

    found = {topic: Subject() for topic in (*sources, *(topic for topic, _ in handlers))}
    for topic, handler in handlers:
        found[topic].subscribe(handler)
    yield [found[topic].on_next for topic in sources]


@asynccontextmanager
async def scheduled_subjects(
    sources: Sequence[str], handlers: Sequence[tuple[str, Handler]]
) -> AsyncIterator[list[Publish]]:
    """reactivex: the same, each observer on the event loop."""
    from reactivex import operators
    from reactivex.scheduler.eventloop import AsyncIOScheduler
    from reactivex.subject import Subject

    scheduler = AsyncIOScheduler(asyncio.get_running_loop())
    found = {topic: Subject() for topic in (*sources, *(topic for topic, _ in handlers))}
    for topic, handler in handlers:
        found[topic].pipe(operators.observe_on(scheduler)).subscribe(handler)
    yield [found[topic].on_next for topic in sources]


@asynccontextmanager
async def aiopubsub(sources: Sequence[str], handlers: Sequence[tuple[str, Handler]]) -> AsyncIterator[list[Publish]]:
    """A hub, and a subscriber for each handler."""
    import aiopubsub as package

    hub = package.Hub()
    publisher = package.Publisher(hub, package.Key("node"))
    subscribers = [package.Subscriber(hub, f"subscriber_{number}") for number in range(len(handlers))]
    for subscriber, (topic, handler) in zip(subscribers, handlers, strict=True):
        key = package.Key("node", topic)
        if iscoroutinefunction(handler):
            subscriber.add_async_listener(key, _keyed_async(handler))
        else:
            subscriber.add_sync_listener(key, _keyed(handler))
    yield [partial(publisher.publish, package.Key(topic)) for topic in sources]
    for subscriber in subscribers:
        await subscriber.remove_all_listeners()


def _keyed(handler: Handler) -> object:
    def take(_key: object, message: object) -> None:
        handler(message)

    return take


def _keyed_async(handler: Handler) -> object:
    async def take(_key: object, message: object) -> None:
        await handler(message)

    return take
