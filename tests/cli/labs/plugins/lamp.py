import asyncio

from busflow import Node, client, service
from busflow.msgs.std_srvs import SetBool, Trigger


class Lamp(Node):
    @service(SetBool, "~/switch")
    def switch(self, request: SetBool.Request) -> SetBool.Response:
        if not request.data:
            raise ValueError("it stays \x1b[31mon")
        return SetBool.Response(success=True, message="it is \x1b[31mon")

    @service(Trigger, "~/dim")
    def dim(self, _request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(message="dim " * 100)

    @service(Trigger, "~/never")
    async def never(self, _request: Trigger.Request) -> Trigger.Response:
        await asyncio.Event().wait()
        return Trigger.Response()

    nobody = client(Trigger, "nobody")

    async def run(self) -> None:
        self.log.info("works")
