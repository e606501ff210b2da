"""Graph: busflow itself, each publisher and each handler in a node of its own, or all in two nodes."""

from __future__ import annotations

from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from typing import Any

import busflow
from benchmarks.peers import Handler, Publish
from busflow import Node, QoS
from busflow.msgs.geometry_msgs import Vector3

DEEP = QoS(depth=1000)
"""Deep enough for every burst: nothing is dropped."""


class Source(Node):
    """Publishes topics, none of them of itself."""

    topics: Sequence[str] = ()

    def declare(self) -> None:
        self.outs = [self.create_publisher(Vector3, topic) for topic in self.topics]


class Sink(Node):
    """Hears topics."""

    ends: Sequence[tuple[str, Handler]] = ()

    def declare(self) -> None:
        for topic, handler in self.ends:
            self.create_subscription(Vector3, topic, handler, qos=DEEP)


@asynccontextmanager
async def many_nodes(sources: Sequence[str], handlers: Sequence[tuple[str, Handler]]) -> AsyncIterator[list[Publish]]:
    """A node for each publisher and for each handler."""
    ins = [sink(f"sink_{number}", [end]) for number, end in enumerate(handlers)]
    outs = [source(f"source_{number}", [topic]) for number, topic in enumerate(sources)]
    async with busflow.launch(*outs, *ins):
        yield [publisher.publish for node in outs for publisher in node.outs]


@asynccontextmanager
async def two_nodes(sources: Sequence[str], handlers: Sequence[tuple[str, Handler]]) -> AsyncIterator[list[Publish]]:
    """One node has all publishers, another one all handlers."""
    out = source("source", sources)
    async with busflow.launch(out, sink("sink", handlers)):
        yield [publisher.publish for publisher in out.outs]


def source(name: str, topics: Sequence[str]) -> Source:
    node = Source(name=name)
    node.topics = topics
    return node


def sink(name: str, ends: Sequence[tuple[str, Handler]]) -> Sink:
    node = Sink(name=name)
    node.ends = ends
    return node


def message() -> Any:
    return Vector3(x=1.0, y=2.0, z=3.0)
