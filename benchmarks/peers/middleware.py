"""Middleware: what is made for many processes, used within one. Messages are bytes, and arrive in other threads."""

import asyncio
import struct
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from benchmarks.peers import Handler, Publish

# Without `from __future__ import annotations`: cyclonedds reads the annotations of a class where it is made.

POINT = struct.Struct("<3d")


class Point(NamedTuple):
    x: float
    y: float
    z: float


@asynccontextmanager
async def zenoh(sources: Sequence[str], handlers: Sequence[tuple[str, Handler]]) -> AsyncIterator[list[Publish]]:
    """One session, with a callback for each handler, in a thread each as is the default."""
    import zenoh as package

    config = package.Config()
    for key, value in (("mode", '"peer"'), ("listen/endpoints", "[]"), ("scouting/multicast/enabled", "false")):
        config.insert_json5(key, value)

    def decoding(handler: Handler) -> Any:
        def take(sample: Any) -> None:
            handler(Point._make(POINT.unpack(sample.payload.to_bytes())))

        return take

    with package.open(config) as session:
        for topic, handler in handlers:
            session.declare_subscriber(topic, decoding(handler))
        publishers = [session.declare_publisher(topic) for topic in sources]

        def publish(publisher: Any, message: Any) -> None:
            publisher.put(POINT.pack(message.x, message.y, message.z))

        yield [partial(publish, publisher) for publisher in publishers]


@asynccontextmanager
async def cyclonedds(sources: Sequence[str], handlers: Sequence[tuple[str, Handler]]) -> AsyncIterator[list[Publish]]:
    """One participant, reliable and without loss, a reader with a listener for each handler."""
    from cyclonedds.core import Listener, Policy, Qos
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.idl import IdlStruct
    from cyclonedds.idl.types import float64
    from cyclonedds.pub import DataWriter
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic
    from cyclonedds.util import duration

    @dataclass
    class Sample(IdlStruct, typename="Point"):
        x: float64
        y: float64
        z: float64

    class Taking(Listener):
        def __init__(self, handler: Handler) -> None:
            super().__init__()
            self.handler = handler

        def on_data_available(self, reader: Any) -> None:
            for message in reader.take(N=64):
                self.handler(message)

    participant = DomainParticipant(77)
    qos = Qos(Policy.Reliability.Reliable(duration(seconds=5)), Policy.History.KeepAll)
    names = dict.fromkeys([*sources, *(topic for topic, _ in handlers)])
    topics = {name: Topic(participant, name, Sample, qos=qos) for name in names}
    listeners = [Taking(handler) for _, handler in handlers]
    readers = [
        DataReader(participant, topics[name], qos=qos, listener=listener)
        for (name, _), listener in zip(handlers, listeners, strict=True)
    ]
    writers = [DataWriter(participant, topics[name], qos=qos) for name in sources]
    await asyncio.sleep(0.2)  # until they have found one another

    def publish(writer: Any, message: Any) -> None:
        writer.write(Sample(x=message.x, y=message.y, z=message.z))

    yield [partial(publish, writer) for writer in writers]
    del listeners, readers
