"""A lamp that answers calls, and never answers one of its services."""

import asyncio

from busflow import Node, service
from busflow.msgs.std_srvs import SetBool, Trigger


class Lamp(Node):
    """Can be switched on only."""

    @service(SetBool, "~/switch")
    async def switch(self, request: SetBool.Request) -> SetBool.Response:
        if not request.data:
            raise ValueError("it stays on")
        return SetBool.Response(success=True, message="it is on")

    @service(Trigger, "~/never")
    async def never(self, _request: Trigger.Request) -> Trigger.Response:
        await asyncio.Event().wait()
        return Trigger.Response()

    async def run(self) -> None:
        self.log.info("ready")
