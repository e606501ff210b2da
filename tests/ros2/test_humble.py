"""A run beside a node of ROS 2 Humble, which has no hashes of types: what is on the wire and so might not arrive."""

import asyncio
from collections.abc import Callable
from typing import Any

import pytest

from busflow import client, launch, publisher, service
from busflow.cli import main
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.example_interfaces import AddTwoInts
from busflow.msgs.rcl_interfaces import GetParameters, Log
from busflow.msgs.std_msgs import Int64, String
from busflow.msgs.std_srvs import SetBool
from tests.ros2 import receiving_robot
from tests.ros2.rmw_node import LATCHED, RmwNode
from tests.ros2.sessions import (
    PATIENCE_S,
    arrived,
    free_port,
    in_thread,
    rmw_session,
    ros2_at,
    to_loop,
    until,
    until_arrived,
)

STRING, INT64, LOG, ADD, SWITCH = map(TypeSupport, (String, Int64, Log, AddTwoInts, SetBool))


class Robot(receiving_robot.Robot):
    talk = publisher(String, "/talk")
    switch = client(SetBool, "/switch")

    @service(AddTwoInts, "/add")
    def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)


def decoded(support: Any, queue: "asyncio.Queue[Any]") -> Callable[[Any], None]:
    """A function for Zenoh's threads that puts messages into a queue of the loop."""
    put = to_loop(queue)
    return lambda sample: put(support.decode(sample.payload.to_bytes()))


@pytest.mark.asyncio
async def test_humble_and_newer_nodes_share_topics():
    port, kept, said, heard = free_port(), *(asyncio.Queue[Any]() for _ in range(3))
    async with launch(ros2_at(port), Robot, inspect="humble") as graph:
        robot, topics = graph.node(Robot), graph.bus.topics
        for number in range(7):
            robot.map.publish(Int64(data=number))
        with rmw_session(port) as session, rmw_session(port) as other:
            ros, newer = RmwNode(session, "ros", humble=True), RmwNode(other, "newer")
            ros.subscription("/map", INT64, to_loop(kept), LATCHED)
            samples = [await arrived(kept) for _ in range(5)]
            assert [INT64.decode(each.payload.to_bytes()).data for each in samples] == [2, 3, 4, 5, 6]
            assert [int.from_bytes(each.attachment.to_bytes()[:8], "little") for each in samples] == [3, 4, 5, 6, 7]
            robot.map.publish(Int64(data=7))
            assert INT64.decode((await arrived(kept)).payload.to_bytes()).data == 7
            ros.subscription("/talk", STRING, decoded(STRING, said))
            newer.subscription("/talk", STRING, decoded(STRING, heard))
            hello, large = String(data="hello"), String(data="large " * 20_000)
            for queue in (said, heard):
                await until_arrived(lambda: robot.talk.publish(hello), queue, hello)
            robot.talk.publish(large)
            for queue in (said, heard):
                await until_arrived(lambda: None, queue, large)
            for number, node in enumerate((ros, newer)):
                node.publisher("/plan", INT64, LATCHED)(INT64.encode(Int64(data=number)))
                assert await arrived(robot.arrived) == number
            publish = ros.publisher("/words", STRING)
            await until_arrived(lambda: publish(STRING.encode(String(data="hi"))), robot.arrived, "hi")
            assert not topics["/plan"].losses
        await until(lambda: not topics["/plan"].publishers and not topics["/words"].publishers)


@pytest.mark.asyncio
async def test_humble_calls_and_is_called():
    port, lines = free_port(), asyncio.Queue[Any]()
    get = TypeSupport(GetParameters.Request).encode(GetParameters.Request(names=["gain"]))
    add = TypeSupport(AddTwoInts.Request).encode(AddTwoInts.Request(a=1, b=2))
    switched = TypeSupport(SetBool.Response).encode(SetBool.Response(success=True))
    async with launch(ros2_at(port), Robot, inspect="humble") as graph:
        robot = graph.node(Robot)
        with rmw_session(port) as session:
            ros = RmwNode(session, "ros", humble=True)
            await in_thread(lambda: ros.sees("/SS/", "%robot%get_parameters"))
            answer, *_ = await in_thread(lambda: ros.call("/robot/get_parameters", TypeSupport(GetParameters), get))
            assert TypeSupport(GetParameters.Response).decode(answer).values[0].double_value == 0.5
            answer, *_ = await in_thread(lambda: ros.call("/add", ADD, add))
            assert TypeSupport(AddTwoInts.Response).decode(answer).sum == 3
            ros.server("/switch", SWITCH, lambda _request: switched)
            await robot.switch.ready(timeout=PATIENCE_S)
            assert (await robot.switch.call(SetBool.Request(data=True), timeout=PATIENCE_S)).success
            put = to_loop(lines)
            ros.subscription("/rosout", LOG, lambda sample: put(LOG.decode(sample.payload.to_bytes()).msg), LATCHED)
            await until_arrived(lambda: robot.log.info("hello"), lines, "hello")


@pytest.mark.asyncio
async def test_commands_reach_nodes_of_humble(capsys: pytest.CaptureFixture[str]):
    port, said = free_port(), asyncio.Queue[Any]()
    async with launch(ros2_at(port), Robot, inspect="humble") as graph:
        with rmw_session(port) as session:
            ros = RmwNode(session, "ros", humble=True)
            ros.subscription("/spoken", STRING, decoded(STRING, said))
            publish = ros.publisher("/chatter", INT64, LATCHED)
            publish(INT64.encode(Int64(data=7)))
            switched = TypeSupport(SetBool.Response).encode(SetBool.Response(success=True))
            ros.server("/switch", SWITCH, lambda _request: switched)
            await graph.node(Robot).switch.ready(timeout=PATIENCE_S)
            for words in (
                ("topic", "echo", "/chatter", "-n", "1"),
                ("topic", "pub", "--once", "/spoken", "std_msgs/msg/String", "{data: spoken}"),
                ("service", "call", "/switch", "std_srvs/srv/SetBool", "{data: true}"),
            ):
                assert await in_thread(lambda words=words: main([*words, "--run", "humble"])) == 0
            assert (await arrived(said)).data == "spoken"
    out = capsys.readouterr().out
    assert "data: 7" in out
    assert "success=True" in out
