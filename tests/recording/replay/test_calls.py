"""The calls of a replay, made anew."""

import asyncio

from busflow import Node, service
from busflow.msgs.std_srvs import Trigger
from busflow.recording.replay.calls import Calls
from busflow.recording.replay.comparison import Check
from busflow.recording.replay.history import Past
from busflow.recording.tools.message_diff import Comparison
from busflow.testing import harness, virtual_time

PAST = Past(0, simulated=True, seed=0, by_busflow=True, parameters={})


class Slow(Node):
    """Answers after an hour."""

    @service(Trigger, "~/ask")
    async def on_ask(self, _request: Trigger.Request) -> Trigger.Response:
        await self.clock.sleep(3600)
        return Trigger.Response(success=True)


@virtual_time
async def test_waiting_callers_end_when_calls_are_closed():
    async with harness(Slow) as lab:
        calls = Calls(lab.graph, Check(Comparison(), started_ns=0), PAST)
        before = asyncio.all_tasks()
        calls.call("/slow/ask", Trigger.Request())
        (request,) = asyncio.all_tasks() - before
        await lab.advance(1)
        assert not request.done()
        await calls.close()
        assert request.cancelled()
