"""Requests of other processes reach a server, and its answer or refusal goes back."""

import pytest

from busflow import ServiceFailed, ServiceTimeout
from busflow.errors import MalformedMessage, NoSuchTarget
from tests.nodes.lamp import Lamp
from tests.wire.mirror.lamp import PATIENCE_S, two_are_withdrawn

pytestmark = pytest.mark.asyncio


async def test_peer_gets_an_answer_or_the_reason_without(looked_at):
    async with looked_at(Lamp) as looked:
        switch = await looked.ask(looked.peer.service, "/lamp/switch")
        never = await looked.ask(looked.peer.service, "/lamp/never")

        async def call(service, values, timeout_s=PATIENCE_S):
            return await looked.ask(looked.peer.call, service, values, timeout_s=timeout_s)

        assert switch.type == "std_srvs/srv/SetBool"
        assert await call(switch, {"data": True}) == {"success": True, "message": "it is on"}
        with pytest.raises(ServiceFailed, match="it stays on"):
            await call(switch, {"data": False})
        with pytest.raises(MalformedMessage, match="'data'"):
            await call(switch, {"dat": False})
        with pytest.raises(ServiceTimeout, match=r"0\.2 s"):
            await call(never, {}, timeout_s=0.2)
        with pytest.raises(NoSuchTarget, match="/lamp/off"):
            await looked.ask(looked.peer.service, "/lamp/off")
        key = f"0/lamp/switch/std_srvs::srv::dds_::SetBool_/{switch.hash}"
        (reply,) = await looked.ask(lambda: [*looked.peer.session.get(key, payload=b"\x00", timeout=PATIENCE_S)])
        assert b"MalformedMessage" in reply.err.payload.to_bytes()
        assert (await call(switch, {"data": True}))["success"]


async def test_a_timed_out_request_is_withdrawn_before_handling(looked_at):
    async with looked_at(Lamp) as looked:
        never = await looked.ask(looked.peer.service, "/lamp/never")
        for _ in range(3):
            with pytest.raises(ServiceTimeout):
                await looked.ask(looked.peer.call, never, {}, timeout_s=0.2)
        assert await looked.ask(two_are_withdrawn, looked.peer)
