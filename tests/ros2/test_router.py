"""A run and sessions of ROS 2 meet at a router: the run itself, one that is there, or none that can be had."""

import asyncio
import os
import socket
from dataclasses import replace
from pathlib import Path

import pytest

from busflow import Node, launch, publisher, subscription
from busflow.cli import main
from busflow.errors import InspectionUnavailable
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.std_msgs import String
from busflow.wire.zenoh.keys import Attachment, Token, TokenKind, topic_key
from busflow.wire.zenoh.run_directory import runs
from tests.ros2.sessions import ROUTER, arrived, free_port, has_come, opened, rmw_session, ros2_at, until_arrived

SUPPORT = TypeSupport(String)
OUT, IN = (topic_key(topic, SUPPORT.name, SUPPORT.type_hash, domain=7) for topic in ("/chatter", "/said"))


class Robot(Node):
    chatter = publisher(String, "chatter")

    async def start(self) -> None:
        self.heard: asyncio.Queue[str] = asyncio.Queue()

    @subscription("said")
    async def on_said(self, said: String) -> None:
        await self.heard.put(said.data)


def inet_sockets() -> set[str]:
    """The IP sockets of this process that wait for others, as `tcp 127.0.0.1:7447`."""
    own = {str(file.readlink()) for file in Path("/proc/self/fd").iterdir() if file.is_symlink()}
    found = set()
    for protocol, state in (("tcp", "0A"), ("tcp6", "0A"), ("udp", "07"), ("udp6", "07")):
        for line in Path("/proc/net", protocol).read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == state and f"socket:[{fields[9]}]" in own:
                host, _, port = fields[1].partition(":")
                shown = socket.inet_ntoa(bytes.fromhex(host)[::-1]) if len(host) == 8 else host
                found.add(f"{protocol} {shown}:{int(port, 16)}")
    return found


def unix_sockets() -> list[str]:
    """The words of the kernel's list of Unix sockets, with the names by which processes have made them."""
    return Path("/proc/net/unix").read_text().split()


async def talk(session, robot: Robot) -> None:
    """One message each way between a session of ROS 2 and a node."""
    loop = asyncio.get_running_loop()
    received: asyncio.Queue = asyncio.Queue()
    own = str(session.info.zid())
    node = Token(own, 0, 0, TokenKind.NODE, "/", "ros", domain=7)
    end = replace(node, type=SUPPORT.name, hash=SUPPORT.type_hash, qos="::,10:,:,:,,")
    ends = [
        replace(end, entity_id=10, kind=TokenKind.PUBLISHER, topic="/said"),
        replace(end, entity_id=11, kind=TokenKind.SUBSCRIPTION, topic="/chatter"),
    ]
    tokens = [session.liveliness().declare_token(str(each)) for each in (node, *ends)]
    session.declare_subscriber(OUT, lambda sample: loop.call_soon_threadsafe(received.put_nowait, sample))
    way = session.declare_publisher(IN)
    matched = asyncio.Event()
    listener = way.declare_matching_listener(lambda status: status.matching and loop.call_soon_threadsafe(matched.set))
    if not way.matching_status.matching:
        async with asyncio.timeout(60):
            await matched.wait()
    way.put(SUPPORT.encode(String(data="to busflow")), attachment=Attachment(1, 1, ends[0].gid).encode())
    assert await arrived(robot.heard) == "to busflow"
    robot.chatter.publish(String(data="to ROS 2"))
    sample = await arrived(received)
    assert SUPPORT.decode(sample.payload.to_bytes()).data == "to ROS 2"
    assert Attachment.decode(sample.attachment.to_bytes()).sequence >= 1
    assert await has_come(session, "/robot")
    answers = [each.ok for each in session.get("@busflow/1/*/run", timeout=0.2)]
    assert not any(answers), "queries about the run are this user's alone"
    listener.undeclare()
    for token in tokens:
        token.undeclare()


@pytest.mark.asyncio
async def test_the_run_stands_in_for_a_missing_router():
    port, before = free_port(), inet_sockets()
    async with launch(ros2_at(port), Robot, inspect="ros") as graph:
        assert inet_sockets() - before == {f"tcp 127.0.0.1:{port}"}
        assert runs()[0].card.ros2_domain == 7
        with rmw_session(port) as session:
            assert len(list(session.info.routers_zid())) == 1
            await talk(session, graph.node(Robot))


@pytest.mark.asyncio
async def test_the_run_joins_a_router_that_is_there(capsys: pytest.CaptureFixture[str]):
    port = free_port()
    with opened(ROUTER | {"listen/endpoints": [f"tcp/127.0.0.1:{port}"]}) as router, rmw_session(port) as session:
        async with launch(ros2_at(port), Robot, inspect="ros") as graph:
            assert list(session.info.routers_zid()) == [router.info.zid()]
            assert f"the router tcp/127.0.0.1:{port}" in capsys.readouterr().err
            await talk(session, graph.node(Robot))


class Listener(Node):
    async def start(self) -> None:
        self.heard: asyncio.Queue[str] = asyncio.Queue()

    @subscription("chatter")
    async def on_chatter(self, chatter: String) -> None:
        await self.heard.put(chatter.data)


@pytest.mark.asyncio
async def test_two_runs_at_one_router_meet():
    port = free_port()
    with opened(ROUTER | {"listen/endpoints": [f"tcp/127.0.0.1:{port}"]}):
        async with (
            launch(ros2_at(port), Robot, inspect="first") as first,
            launch(ros2_at(port), Listener, inspect="second") as second,
        ):
            chatter, heard = first.node(Robot).chatter, second.node(Listener).heard
            await until_arrived(lambda: chatter.publish(String(data="to the other run")), heard, "to the other run")


@pytest.mark.asyncio
async def test_gossip_names_no_socket_of_the_run():
    async with launch(ros2_at(free_port()), Robot, inspect="ros"):
        (run,) = runs()
        names = unix_sockets()
        assert not [name for name in names if name.startswith(str(run.directory))], "Zenoh tells others this name"
        run.open(5.0).close()


@pytest.mark.asyncio
async def test_without_the_key_no_socket_is_open():
    before = inet_sockets()
    async with launch(Robot, inspect="ros"):
        assert inet_sockets() == before


@pytest.mark.asyncio
@pytest.mark.parametrize("kind", ["another program", "a peer of Zenoh"])
async def test_a_port_without_a_router_is_an_error(kind: str):
    port = free_port()
    if kind == "another program":
        taken, words = socket.create_server(("127.0.0.1", port)), "is no Zenoh router"
    else:
        taken, words = opened(ROUTER | {"mode": "peer", "listen/endpoints": [f"tcp/127.0.0.1:{port}"]}), "and no router"
    with taken, pytest.raises(InspectionUnavailable) as caught:
        async with launch(ros2_at(port), Robot, inspect="ros"):
            pass
    text = str(caught.value)
    assert f"tcp/127.0.0.1:{port}" in text
    assert words in text
    assert f"end the process {os.getpid()} (" in text
    assert runs() == []


def test_options_that_leave_no_session_are_refused(capsys: pytest.CaptureFixture[str]):
    file = str(Path(__file__).parents[2] / "configs/lab1.yaml")
    for options, words in ((["--sim"], "--ros2 needs real time"), (["--no-inspect"], "leave out one of both")):
        assert main(["run", file, "--ros2", *options]) == 2
        assert words in capsys.readouterr().err
