# pyright: strict, reportUnnecessaryTypeIgnoreComment=true
"""What a strict type checker sees of services: read, never run; each ignore must be needed."""

from typing import assert_type

import busflow
from busflow import Client, Message, Node, Server, ServiceType, client, service
from busflow.msgs.std_srvs import SetBool, Trigger
from busflow.testing import harness


class Add(ServiceType, package="test"):
    class Request(Message):
        a: int = 0

    class Response(Message):
        sum: int = 0


class Adder(Node):
    reset = client(Trigger, "reset")

    @service(Add, "add")
    def on_add(self, request: Add.Request) -> Add.Response:
        return Add.Response(sum=request.a)

    @service(Add, "add_later")
    @service(Add, "add_slowly")
    async def on_add_slowly(self, request: Add.Request) -> Add.Response:
        assert_type(await self.reset.call(), Trigger.Response)
        return self.on_add(request)

    @service(Trigger, "wrong")  # type: ignore[arg-type]  # the request is another service's
    def on_wrong(self, request: SetBool.Request) -> Trigger.Response:
        return Trigger.Response(success=request.data)

    @service(Trigger, "wrong_too")  # type: ignore[arg-type]  # the response is
    async def on_wrong_too(self, _request: Trigger.Request) -> SetBool.Response:
        return SetBool.Response()

    def declare(self) -> None:
        assert_type(self.create_client(Add, "add"), Client[Add.Request, Add.Response])
        assert_type(self.create_service(Add, "more", self.on_add), Server[Add.Request, Add.Response])
        self.create_service(Trigger, "more", self.on_add)  # type: ignore[arg-type]  # it answers another service


async def asked(adder: Adder) -> None:
    assert_type(adder.on_add(Add.Request(a=1)), Add.Response)
    assert_type(await adder.on_add_slowly(Add.Request(a=1)), Add.Response)
    assert_type(await adder.reset.call(Trigger.Request(), timeout=None), Trigger.Response)
    await adder.reset.call(SetBool.Request())  # type: ignore[arg-type]  # a client asks its own service
    async with busflow.launch(Adder) as graph:
        assert_type(await graph.call(Add, "add", Add.Request(a=1), timeout=1), Add.Response)
        await graph.call(Message, "add")  # type: ignore[arg-type]  # a message is no service
    async with harness(Adder) as lab:
        assert_type((await lab.call(Trigger, "reset")).success, bool)
