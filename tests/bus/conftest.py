"""Services, and counts of their calls, for the tests of services."""

from __future__ import annotations

import asyncio

import anyio

from busflow import (
    Node,
    ServiceType,
    service,
)
from busflow.interfaces.message import Message
from busflow.msgs.std_msgs import Int64


def number(value):
    return Int64(data=value)


def publish(publisher, *values):
    for value in values:
        publisher.publish(number(value))


def queued(subscription):
    return [message.data for message in subscription.queue.items]


async def settle():
    await asyncio.get_running_loop().settle()


class Add(ServiceType, package="test"):
    """Adds one, and says to what."""

    class Request(Message):
        number: int = 0

    class Response(Message):
        sum: int = 0


class Adder(Node):
    """Answers at once, after a while, wrongly, never."""

    async def start(self) -> None:
        self.began: list[int] = []
        self.ended: list[int] = []

    @service(Add, "~/add")
    def add(self, request: Add.Request) -> Add.Response:
        self.began.append(request.number)
        return Add.Response(sum=request.number + 1)

    @service(Add, "~/slow", depth=2)
    async def add_slowly(self, request: Add.Request) -> Add.Response:
        self.began.append(request.number)
        await self.clock.sleep(1.0)
        self.ended.append(request.number)
        return Add.Response(sum=request.number + 1)

    @service(Add, "~/wrong")
    def fail(self, request: Add.Request) -> Add.Response:
        raise ValueError(f"cannot add to {request.number}")

    @service(Add, "~/never")
    async def hang(self, _request: Add.Request) -> Add.Response:
        await anyio.sleep_forever()
        raise AssertionError


def line(lab, name):
    """The account of a service's only server."""
    (found,) = lab.graph.bus.services[name].statistics().servers
    return found


def accounts(lab):
    """Whether both ends of every service account for every call."""
    return all(
        server.received
        == server.served + server.failed + server.refused + server.withdrawn + server.lost + server.waiting
        for each in lab.graph.report().services
        for server in each.servers
    ) and all(
        asking.called == asking.answered + asking.failed + asking.cancelled + asking.waiting
        and asking.failed == sum(asking.errors.values())
        for each in lab.graph.report().services
        for asking in each.clients
    )


async def three_calls(lab):
    """Three of the slow service: one with the handler, two that wait."""
    calls = []
    for number in range(3):
        calls.append(asyncio.create_task(lab.call(Add, "adder/slow", Add.Request(number=number))))
        await lab.settle()
    return calls
