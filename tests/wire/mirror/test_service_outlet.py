"""Requests of other processes reach a server, and its answer or refusal goes back."""

import pytest

from busflow import ServiceFailed, ServiceTimeout
from busflow.errors import MalformedMessage, NoSuchTarget
from busflow.wire.client.client import join
from tests.wire.mirror.lamp import PATIENCE_S, two_are_withdrawn


@pytest.mark.usefixtures("room")
def test_a_peer_asks_and_is_answered():
    with join() as peer:
        switch = peer.service("/lamp/switch")
        assert switch.type == "std_srvs/srv/SetBool"
        assert peer.call(switch, {"data": True}, timeout_s=PATIENCE_S) == {"success": True, "message": "it is on"}


@pytest.mark.usefixtures("room")
def test_peer_gets_the_reason_without_an_answer():
    with join() as peer:
        switch = peer.service("/lamp/switch")
        with pytest.raises(ServiceFailed, match="it stays on"):
            peer.call(switch, {"data": False}, timeout_s=PATIENCE_S)
        with pytest.raises(MalformedMessage, match="did you mean 'data'"):
            peer.call(switch, {"dat": False}, timeout_s=PATIENCE_S)
        with pytest.raises(ServiceTimeout, match=r"within 0\.2 s"):
            peer.call(peer.service("/lamp/never"), {}, timeout_s=0.2)
        with pytest.raises(NoSuchTarget, match="/lamp/off"):
            peer.service("/lamp/off")


@pytest.mark.usefixtures("room")
def test_a_timed_out_request_is_withdrawn_before_handling():
    with join() as peer:
        never = peer.service("/lamp/never")
        for _ in range(3):
            with pytest.raises(ServiceTimeout):
                peer.call(never, {}, timeout_s=0.2)
        assert two_are_withdrawn(peer)


@pytest.mark.usefixtures("room")
def test_a_malformed_request_is_refused_alone():
    with join() as peer:
        switch = peer.service("/lamp/switch")
        key = f"0/lamp/switch/std_srvs::srv::dds_::SetBool_/{switch.hash}"
        (reply,) = peer.session.get(key, payload=b"\x00", timeout=PATIENCE_S)
        assert b"MalformedMessage" in reply.err.payload.to_bytes()
        assert peer.call(switch, {"data": True}, timeout_s=PATIENCE_S)["success"]
