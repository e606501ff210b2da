"""Definitions that differ are shown as a diff, where both sides say what theirs are."""

import asyncio
from typing import Any

import pytest

from busflow import Message, Node, launch, subscription
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.interfaces.message import float32
from busflow.msgs.type_description_interfaces import GetTypeDescription, TypeDescription
from busflow.ros2.definitions import differences
from busflow.wire.client.client import join
from tests.golden import Golden
from tests.ros2.rmw_node import RELIABLE, RmwNode
from tests.ros2.sessions import free_port, rmw_session, ros2_at, until

SERVICE, REQUEST, RESPONSE = map(
    TypeSupport, (GetTypeDescription, GetTypeDescription.Request, GetTypeDescription.Response)
)


class Reading(Message, package="lab"):
    value: float = 0.0
    unit: str = ""


class Theirs:
    """The same type as others define it."""

    class Reading(Message, package="lab"):
        value: float32 = 0.0
        unit: str = ""
        quality: int = 0


class Robot(Node):
    @subscription("/reading")
    def on_reading(self, reading: Reading) -> None: ...


def describe(payload: bytes) -> bytes:
    """Answer as a node of ROS 2 that knows its own definition."""
    assert REQUEST.decode(payload).type_name == "lab/msg/Reading"
    description = TypeDescription.model_validate(TypeSupport(Theirs.Reading).description)
    return RESPONSE.encode(GetTypeDescription.Response(successful=True, type_description=description))


def ask(run: str) -> tuple[list[Any], Any]:
    with join(run) as peer:
        problems = list(differences(peer, peer.graph()))
        theirs = peer.type("lab/msg/Reading", TypeSupport(Theirs.Reading).type_hash)
        return problems, [field["name"] for field in theirs.description["type_description"]["fields"]]


@pytest.mark.asyncio
async def test_two_definitions_are_shown_as_a_diff(capsys: pytest.CaptureFixture[str], golden: Golden):
    port, theirs = free_port(), TypeSupport(Theirs.Reading)
    async with launch(ros2_at(port), Robot, inspect="differ") as graph:
        with rmw_session(port) as session:
            ros = RmwNode(session, "ros")
            ros.server("/ros/get_type_description", SERVICE, describe)
            ros.end("MP", "/reading", theirs.name, theirs.type_hash, RELIABLE)
            log: list[str] = []
            await until(lambda: log.append(capsys.readouterr().err) or "another definition" in "".join(log))
            problems, fields = await asyncio.to_thread(ask, "differ")
            (problem,) = problems
            assert problem.code == "definitions-differ"
            golden("\n".join([problem.message, *problem.details]))
            assert "\n  -float64 value\n  +float32 value\n" in problem.render()
            assert "+int64 quality" in problem.as_json()["details"]
            assert fields == ["value", "unit", "quality"], "a type that only ROS 2 knows can be read"
            assert graph.bus.topics["/reading"].publishers == []


@pytest.mark.asyncio
async def test_ros2_learns_the_types_of_a_run():
    port, ours = free_port(), TypeSupport(Reading)
    async with launch(ros2_at(port), Robot, inspect="learn"):
        with rmw_session(port) as session:
            ros = RmwNode(session, "ros")
            await asyncio.to_thread(ros.sees, "/SS/", "%robot%get_type_description")
            await asyncio.to_thread(ros.sees, "/SS/", "%robot%list_parameters")
            for type_hash, right in ((ours.type_hash, True), ("", True), ("RIHS01_" + "1" * 64, False)):
                request = REQUEST.encode(GetTypeDescription.Request(type_name=ours.name, type_hash=type_hash))
                payload, *_ = await asyncio.to_thread(ros.call, "/robot/get_type_description", SERVICE, request)
                answer = RESPONSE.decode(payload)
                assert answer.successful is right
                names = [field.name for field in answer.type_description.type_description.fields]
                assert names == (["value", "unit"] if right else [])
                assert bool(answer.failure_reason) is not right
