"""Nodes of ROS 2 are listed by host, and those of other machines are a finding."""

import asyncio
from typing import Any

import pytest

from busflow import Node, launch
from busflow.cli import main
from busflow.ros2.neighbours import crowds, neighbours, shown, strangers
from busflow.wire.client.client import join
from busflow.wire.zenoh.keys import Token, TokenKind
from tests.ros2.rmw_node import RmwNode
from tests.ros2.sessions import free_port, rmw_session, ros2_at


def node(session: str, name: str) -> Token:
    return Token(session, 0, 0, TokenKind.NODE, "/", name, domain=7)


TOKENS = [
    node("own", "robot"),
    node("worker", "helper"),
    node("a", "rviz"),
    node("a", "_hidden"),
    node("b", "arm\x1b"),
    node("c", "camera"),
]
LINKS = {"": "own", "a": "tcp/127.0.0.1:4711", "b": "tcp/192.0.2.7:4711", "worker": "unixsock-stream//run/1.sock"}


def test_nodes_are_listed_by_host(golden):
    answers: list[Any] = [{"links": LINKS}, {"links": {"": "worker"}}]
    found = neighbours(TOKENS, answers)
    assert found == {"192.0.2.7": ["/arm\\x1b"], "beyond a router": ["/camera"], "this machine": ["/rviz"]}
    golden(shown(found))
    assert [(each.code, each.message.partition(": ")[2]) for each in strangers(found, 7)] == [
        ("foreign-nodes", "/arm\\x1b"),
        ("foreign-nodes", "/camera"),
    ]


def test_ignored_tokens_are_a_finding():
    answers: list[Any] = [{"ignored_tokens": 0}, {"ignored_tokens": 1200}, {}]
    (finding,) = crowds(answers)
    assert (finding.code, "1,200 times" in finding.message) == ("tokens-ignored", True)
    assert list(crowds(answers[:1])) == []


def test_a_run_without_ros2_has_no_neighbours():
    assert neighbours(TOKENS, [{"process": "main"}]) == {}


class Robot(Node):
    """A node that does nothing."""


def until_seen(node: str, run: str) -> None:
    """Wait until other terminals see a node beside a run."""
    with join(run) as peer:
        while node not in peer.graph().nodes:
            pass


@pytest.mark.asyncio
async def test_doctor_lists_nodes_of_this_machine(capsys: pytest.CaptureFixture[str]):
    port = free_port()
    async with launch(ros2_at(port), Robot, inspect="doctored"):
        with rmw_session(port) as session:
            kept = RmwNode(session, "rviz")
            await asyncio.to_thread(until_seen, "/rviz", "doctored")
            code = await asyncio.to_thread(main, ["doctor", "--run", "doctored"])
            out = capsys.readouterr().out
            assert "domain 7  /rviz (this" in out
            assert (code, "nothing is wrong" in out) == (0, True), out
            del kept
