"""Trace: a line for each event of a run, so that two runs can be compared byte by byte.

    0.100000000 timer /sensor_publisher publish_sensors
    0.100000000 parameter /sensor_publisher noise.imu 0.5
    0.100000000 publish /imu/data #1 9b4da7f0c1d2a883
    0.100000000 deliver /imu/data /sensor_processor 9b4da7f0c1d2a883
    0.100000000 drop /imu/data /logger overflow
    0.200000000 request /reset /operator #1 0c22f7a1b3d4e596
    0.200000000 reply /reset /operator #1 5be1c0d97fa23e48
    0.500000000 log /sensor_processor info "All sensors operational" {}

The first column is the run's clock in seconds, the number of a publish its place on the topic, the last column of a
publish and of a delivery a hash of the message's content; a reply that did not come shows the error instead. A run
without a trace pays nothing.
"""

from __future__ import annotations

import json
import struct
from collections import Counter
from collections.abc import Callable, Iterable
from enum import Enum
from hashlib import blake2b
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from busflow.bus.bus import BusObserver
from busflow.bus.services.call import Call
from busflow.bus.services.service import Service
from busflow.bus.subscription import Subscription
from busflow.bus.timer import Timer
from busflow.bus.topic import Topic
from busflow.clock import NS_PER_S
from busflow.interfaces.message import Message, type_name
from busflow.log import LogRecord
from busflow.node.parameter_store import ParameterStore, SetResult
from busflow.runner.extension import Extension
from busflow.runner.graph import Graph
from busflow.runner.supervisor import Supervisor

if TYPE_CHECKING:
    from busflow.runner.assembly import Run

_REMEMBERED = 1024
"""Most messages whose hash is kept, since each delivery asks for it again."""


def trace(run: Run) -> None:
    """Write the lines of a run as its options ask."""
    if run.given.trace is not None:
        Trace(run.graph, run.given.trace)


class Trace(Extension, BusObserver):
    """Writes the lines of one graph, from before it starts to its end."""

    def __init__(self, graph: Graph, write: Callable[[str], object]) -> None:
        """Listen to a graph that has yet to be started; `write` is given each line with its end."""
        self._write = write
        self._clock = graph.clock
        self._bus = graph.bus
        self._published: Counter[str] = Counter()
        self._hashes: dict[int, tuple[Message, str]] = {}
        graph.bus.observe(self)
        graph.log.sinks.append(self._on_log)
        graph.attach(self)

    def node_rebuilt(self, supervisor: Supervisor) -> None:
        """Write that a node is about to be restarted."""
        self._add("restart", supervisor.name, f"#{supervisor.restarts + supervisor.started_by_hand}")

    def topic_added(self, topic: Topic[Any]) -> None:
        """Write what is published from now on."""
        self._bus.tap(topic, lambda message: self._on_publish(topic.name, message))

    def subscription_added(self, subscription: Subscription[Any]) -> None:
        """Write what is delivered, and what is lost."""
        topic, node = subscription.topic, subscription.endpoint.node
        subscription.observe(lambda message: self._add("deliver", topic, node, self._hash(message)))
        subscription.observe_drops(lambda reason: self._add("drop", topic, node, reason))

    def service_added(self, service: Service[Any, Any]) -> None:
        """Write requests and replies."""
        service.taps.append(self._on_call)

    def timer_added(self, timer: Timer) -> None:
        """Write ticks."""
        timer.observe(lambda: self._add("timer", timer.node, timer.name))

    def parameters_added(self, store: ParameterStore) -> None:
        """Write changes of parameters."""
        store.on_change.append(lambda _old, result: self._on_parameters(store.node, result))

    def _on_call(self, call: Call[Any, Any]) -> None:
        outcome = call.outcome
        if outcome is None:
            kind, shown = "request", self._hash(call.request)
        else:
            kind = "reply"
            shown = self._hash(outcome) if isinstance(outcome, Message) else type(outcome).__name__
        self._add(kind, call.service, call.caller, f"#{call.number}", shown)

    def _on_publish(self, topic: str, message: Message) -> None:
        self._published[topic] += 1
        self._add("publish", topic, f"#{self._published[topic]}", self._hash(message))

    def _on_parameters(self, node: str, result: SetResult) -> None:
        for change in result.changed:
            self._add("parameter", node, change.name, json.dumps(change.new))

    def _on_log(self, record: LogRecord) -> None:
        values = json.dumps(dict(record.values), default=_plain, sort_keys=True)
        self._add("log", record.node, record.level, json.dumps(record.event), values)

    def _add(self, *columns: str) -> None:
        seconds, ns = divmod(self._clock.elapsed_ns(), NS_PER_S)
        self._write(f"{seconds}.{ns:09} {' '.join(columns)}\n")

    def _hash(self, message: Message) -> str:
        found = self._hashes.get(id(message))
        if found is None or found[0] is not message:
            if len(self._hashes) >= _REMEMBERED:
                self._hashes.clear()
            found = self._hashes[id(message)] = message, content_hash(message)
        return found[1]


def content_hash(message: Message) -> str:
    """Return a hash of a message's type and content, the same in every process and Python."""
    digest = blake2b(digest_size=8)
    for part in _parts(message):
        digest.update(part)
    return digest.hexdigest()


def _parts(value: Any) -> Iterable[bytes]:
    """Return a value as bytes: its kind, its length if it has one, and its content."""
    match value:
        case Message():
            yield _text(type_name(type(value)))
            for name in type(value).model_fields:
                yield from _parts(getattr(value, name))
        case np.ndarray():
            array = cast("np.ndarray[Any, np.dtype[Any]]", value)
            yield _text(f"array {array.dtype.str} {array.shape}")
            yield array.tobytes()
        case Enum():
            yield from _parts(value.value)
        case float():
            yield b"f" + struct.pack("<d", value)
        case str():
            yield _text(value)
        case bytes():
            yield b"b%d:" % len(value) + value
        case dict():
            mapping = cast("dict[Any, Any]", value)
            yield b"d%d:" % len(mapping)
            for key, each in mapping.items():
                yield from _parts(key)
                yield from _parts(each)
        case list() | tuple():
            items = cast("list[Any] | tuple[Any, ...]", value)
            yield b"l%d:" % len(items)
            for each in items:
                yield from _parts(each)
        case _:
            yield _text(f"{type(value).__name__} {value}")


def _text(text: str) -> bytes:
    encoded = text.encode("utf-8", "surrogatepass")
    return b"s%d:" % len(encoded) + encoded


def _plain(value: Any) -> object:
    """Return a log line's text for a value that JSON does not know; never an address, which differs between runs."""
    if isinstance(value, np.generic | np.ndarray):
        return cast("np.ndarray[Any, np.dtype[Any]]", value).tolist()
    if isinstance(value, BaseException):
        return f"{type(value).__name__}: {value}"
    return f"<{type(value).__name__}>"
