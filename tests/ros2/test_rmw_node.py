"""A run beside nodes of ROS 2 that keep to the sources of `rmw_zenoh`: what each sees and gets of the other."""

import asyncio
import threading
from contextlib import ExitStack

import pytest
import xxhash

from busflow import launch
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.rcl_interfaces import GetParameters, Log, SetParameters
from busflow.msgs.std_msgs import Int64, String
from tests.ros2.receiving_robot import Robot
from tests.ros2.rmw_node import LATCHED, RmwNode
from tests.ros2.sessions import (
    arrived,
    free_port,
    in_thread,
    rmw_session,
    ros2_at,
    to_loop,
    until,
    until_arrived,
)

STRING, INT64, LOG = TypeSupport(String), TypeSupport(Int64), TypeSupport(Log)


@pytest.mark.asyncio
async def test_late_joiners_get_what_is_kept():
    port = free_port()
    async with launch(ros2_at(port), Robot, inspect="kept") as graph:
        robot = graph.node(Robot)
        for number in range(7):
            robot.map.publish(Int64(data=number))
        with rmw_session(port) as session:
            ros, received = RmwNode(session, "ros"), asyncio.Queue()
            ros.subscription("/map", INT64, to_loop(received), LATCHED)
            samples = [await arrived(received) for _ in range(5)]
            assert [INT64.decode(each.payload.to_bytes()).data for each in samples] == [2, 3, 4, 5, 6]
            token = await in_thread(lambda: ros.sees("/MP/", "/%map/"))
            assert token.endswith("/:1:,5:,:,:,,")
            publish = ros.publisher("/plan", INT64, LATCHED)
            for number in range(3):
                publish(INT64.encode(Int64(data=number)))
            assert [await arrived(robot.arrived) for _ in range(3)] == [0, 1, 2]


@pytest.mark.asyncio
async def test_message_right_after_its_publisher_arrives():
    port = free_port()
    async with launch(ros2_at(port), Robot, inspect="once") as graph:
        with rmw_session(port) as session:  # the loop is blocked while the message is published
            ros = RmwNode(session, "ros")
            ros.sees("/MS/", "/robot/%words/")
            ros.publisher("/words", STRING)(STRING.encode(String(data="once")))
            assert await arrived(graph.node(Robot).arrived) == "once"


@pytest.mark.asyncio
async def test_gids_attachments_and_tokens_agree():
    port = free_port()
    async with launch(ros2_at(port), Robot, inspect="gids") as graph:
        robot = graph.node(Robot)
        with rmw_session(port) as session:
            ros, received = RmwNode(session, "ros"), asyncio.Queue()
            ros.subscription("/map", INT64, to_loop(received), LATCHED)
            robot.map.publish(Int64(data=7))
            attachment = (await arrived(received)).attachment.to_bytes()
            token = await in_thread(lambda: ros.sees("/MP/", "/robot/%map/"))
            assert attachment[17:] == xxhash.xxh3_128_digest(token.encode())[::-1]
            publish = ros.publisher("/plan", INT64, LATCHED)
            publish(INT64.encode(Int64(data=1)))
            assert await arrived(robot.arrived) == 1
            topic = graph.bus.topics["/plan"]
            assert [(each.endpoint.node, each.published) for each in topic.publishers] == [("/ros", 1)]
            assert not topic.losses


@pytest.mark.asyncio
async def test_ros2_sets_parameters_and_receives_the_log():
    port, get, set_ = free_port(), TypeSupport(GetParameters.Request), TypeSupport(SetParameters.Request)
    async with launch(ros2_at(port), Robot, inspect="params") as graph:
        robot = graph.node(Robot)
        with rmw_session(port) as session:
            ros, lines = RmwNode(session, "ros"), asyncio.Queue()
            put = to_loop(lines)
            ros.subscription("/rosout", LOG, lambda sample: put(LOG.decode(sample.payload.to_bytes()).msg))
            await in_thread(lambda: ros.sees("/SS/", "%robot%get_parameters"))
            request = get.encode(GetParameters.Request(names=["gain"]))
            answer, number, _ = await in_thread(
                lambda: ros.call("/robot/get_parameters", TypeSupport(GetParameters), request)
            )
            assert number == 41
            assert TypeSupport(GetParameters.Response).decode(answer).values[0].double_value == 0.5
            values = [{"name": "gain", "value": {"type": 3, "double_value": 0.75}}]
            request = set_.encode(SetParameters.Request(parameters=values))
            await in_thread(lambda: ros.call("/robot/set_parameters", TypeSupport(SetParameters), request))
            assert robot.parameters.gain == 0.75
            await in_thread(lambda: ros.sees("/MP/", "/_log/%rosout/"))
            await until_arrived(lambda: robot.log.info("busflow says hello"), lines, "busflow says hello")


@pytest.mark.asyncio
async def test_two_domains_at_one_router_stay_apart():
    port = free_port()
    async with (
        launch(ros2_at(port), Robot, inspect="seven") as seven,
        launch(ros2_at(port, domain=8), Robot, inspect="eight") as eight,
    ):
        with rmw_session(port) as one, rmw_session(port) as other:
            ros7, ros8 = RmwNode(one, "ros7"), RmwNode(other, "ros8", domain=8)
            for ros, graph in ((ros7, seven), (ros8, eight)):
                await in_thread(lambda ros=ros: ros.sees("/MS/", "/%words/"))
                publish = ros.publisher("/words", STRING)
                words = STRING.encode(String(data=ros.name))
                heard = graph.node(Robot).arrived
                assert await until_arrived(lambda: publish(words), heard, ros.name) == []  # noqa: B023  # called in this round
            for ros in (ros7, ros8):
                assert {key.split("/")[1] for key in ros.graph} == {str(ros.domain)}


@pytest.mark.asyncio
async def test_a_node_of_ros2_ends_and_returns():
    port = free_port()
    async with launch(ros2_at(port), Robot, inspect="again") as graph:
        topic = graph.bus.topics["/plan"]
        for life in range(3):
            with rmw_session(port) as session:
                publish = RmwNode(session, "ros").publisher("/plan", INT64, LATCHED)
                publish(INT64.encode(Int64(data=life)))
                assert await arrived(graph.node(Robot).arrived) == life
            await until(lambda: not topic.publishers)
        assert not topic.losses


@pytest.mark.long
@pytest.mark.asyncio
async def test_twenty_sessions_take_part():
    port, said = free_port(), [str(number) for number in range(20)]
    async with launch(ros2_at(port), Robot, inspect="many") as graph:
        robot = graph.node(Robot)
        with ExitStack() as stack:
            nodes = [RmwNode(stack.enter_context(rmw_session(port)), f"ros{number}") for number in range(20)]
            for number, node in enumerate(nodes):
                await in_thread(lambda node=node: node.sees("/MS/", "/robot/%plan/"))
                node.publisher("/plan", INT64, LATCHED)(INT64.encode(Int64(data=number)))
            assert sorted([await arrived(robot.arrived) for _ in said], key=int) == list(range(20))
            assert {each.endpoint.node for each in graph.bus.topics["/plan"].publishers} == {
                f"/ros{number}" for number in range(20)
            }
    assert threading.active_count() < 50


@pytest.mark.asyncio
async def test_only_topics_of_the_patterns_pass():
    port = free_port()
    async with launch(ros2_at(port, topics=("/plan", "/robot/**")), Robot, inspect="narrow") as graph:
        robot, topics = graph.node(Robot), graph.bus.topics
        with rmw_session(port) as session:
            ros = RmwNode(session, "ros")
            words, plan = ros.publisher("/words", STRING), ros.publisher("/plan", INT64, LATCHED)
            words(STRING.encode(String(data="kept out")))
            plan(INT64.encode(Int64(data=1)))
            assert await arrived(robot.arrived) == 1
            await in_thread(lambda: ros.sees("/SS/", "%robot%get_parameters"))
            assert (len(topics["/plan"].publishers), topics["/words"].publishers) == (1, [])
            assert not [key for key in ros.graph if ros.zid not in key and ("/%map/" in key or "/%words/" in key)]
