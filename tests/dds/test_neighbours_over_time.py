"""Large images, neighbours that are killed and come again, several domains, many neighbours: what takes long."""

import signal

import pytest

pytestmark = pytest.mark.long
SIX_MB = 6_000_000
SUM_OF_NINE = sum(range(9))


def test_six_megabytes_cross_in_both_directions(stage):
    peer = stage.peer()
    peer.do("read", topic="rt/picture", kind="Image")
    peer.do("advertise", topic="rt/camera", kind="Image", latched=True, depth=1)
    peer.do("advertise", topic="rt/show", kind="Int64", latched=True)
    peer.do("write", topic="rt/camera", value=SIX_MB)
    stage.robot.wait_for(f"camera {SIX_MB} {SUM_OF_NINE}")
    peer.do("write", topic="rt/show", value=SIX_MB)
    peer.said(got="rt/picture", value=[SIX_MB, SUM_OF_NINE])


def test_killed_neighbour_is_gone_and_comes_again(stage):
    """DDS takes a participant for gone ten seconds after its last sign of life."""
    for value in (6.25, 6.5):
        peer = stage.peer("enclave=/;")
        peer.do("advertise", topic="rt/command", kind="Float64", latched=True)
        peer.do("list_nodes", nodes=[{"name": "restless", "topics": ["rt/command"]}])
        stage.until("/restless", "node", "list")
        peer.do("write", topic="rt/command", value=value)
        stage.robot.wait_for(f"command {value}")
        peer.end(signal.SIGKILL)
        stage.until_not("/restless", "node", "list")
    assert stage.bridge.process.poll() is None


def test_stopped_neighbour_delays_no_other(stage):
    """A reliable reader that takes nothing keeps a writer waiting, and its messages are dropped in the end."""
    stopped, other = stage.peer(), stage.peer()
    stopped.do("read", topic="rt/picture", kind="Image")
    other.do("read", topic="rt/speed", kind="Float64")
    other.do("advertise", topic="rt/show", kind="Int64", latched=True)
    other.said(got="rt/speed", value=1.5)
    stopped.process.send_signal(signal.SIGSTOP)
    for _ in range(10):
        other.do("write", topic="rt/show", value=SIX_MB)
        for _ in range(5):
            other.said(got="rt/speed", value=1.5, after=other.mark())
    stopped.process.send_signal(signal.SIGCONT)


def test_killed_bridge_opens_again_by_hand(stage):
    stage.bridge.end(signal.SIGKILL)
    stage.open_bridge()
    peer = stage.peer()
    peer.do("read", topic="rt/speed", kind="Float64")
    peer.said(got="rt/speed", value=1.5)


def test_two_domains_at_once_do_not_mix(stage, other_domain):
    bridge = stage.open_bridge("--domain", str(other_domain), "--topics", "/speed", "--topics", "/command")
    here, there = stage.peer(), stage.peer(domain=other_domain)
    for peer, value in ((here, 7.25), (there, 7.5)):
        peer.do("read", topic="rt/speed", kind="Float64")
        peer.said(got="rt/speed", value=1.5)
        peer.do("advertise", topic="rt/command", kind="Float64", latched=True)
        peer.do("write", topic="rt/command", value=value)
        stage.robot.wait_for(f"command {value}")
    found = [line for line in there.lines if '"found": "writer", "topic": "rt/' in line]
    assert found
    assert all("rt/speed" in line for line in found)
    bridge.end()


def test_twenty_neighbours_are_all_received(stage):
    peers = [stage.peer() for _ in range(20)]
    for number, peer in enumerate(peers):
        peer.do("advertise", topic="rt/command", kind="Float64", latched=True)
        peer.do("write", topic="rt/command", value=100.5 + number)
    for number, peer in enumerate(peers):
        stage.robot.wait_for(f"command {100.5 + number}")
        peer.end(signal.SIGTERM)
