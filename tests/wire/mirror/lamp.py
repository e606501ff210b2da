"""A lamp in a process of its own, which answers calls, and never answers one of its services."""

import time

PATIENCE_S = 60.0
"""How long to wait for what must come, on however slow a machine; no measure of busflow."""

SERVER = """
import asyncio

from busflow import Node, service
from busflow.msgs.std_srvs import SetBool, Trigger


class Lamp(Node):
    @service(SetBool, "~/switch")
    async def switch(self, request: SetBool.Request) -> SetBool.Response:
        if not request.data:
            raise ValueError("it stays on")
        return SetBool.Response(success=True, message="it is on")

    @service(Trigger, "~/never")
    async def never(self, request: Trigger.Request) -> Trigger.Response:
        await asyncio.Event().wait()
        return Trigger.Response()

    async def run(self) -> None:
        self.log.info("ready")
"""


def two_are_withdrawn(peer):
    """Wait until of three requests those two are withdrawn that had not begun."""
    account = {}
    end = time.monotonic() + PATIENCE_S
    while account.get("withdrawn") != 2 and time.monotonic() < end:
        answers = peer.ask("services", names=["/lamp/never"])
        (account,) = [each for answer in answers for each in answer["/lamp/never"]["servers"]]
    return (account["received"], account["withdrawn"], account["waiting"]) == (3, 2, 1)
