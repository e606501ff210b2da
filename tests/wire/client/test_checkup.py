"""What is wrong in a graph, found in its tokens and its processes' answers."""

from dataclasses import replace
from typing import Any

import pytest

from busflow.bus.qos import SENSOR_DATA, QoS
from busflow.wire.client.checkup import findings
from busflow.wire.client.graph_view import view
from busflow.wire.zenoh.keys import Token, TokenKind
from busflow.wire.zenoh.qos_text import to_text

FLOAT = "std_msgs/msg/Float64"


def token(kind, node, topic="", *, type_=FLOAT, hash_="RIHS01_1", qos=None, session="a", number=1):
    return Token(session, 1, number, kind, "/", node, topic, type_ if topic else "", hash_, to_text(qos or QoS()))


def subscription(node="/sink", **counts) -> dict[str, Any]:
    return {"node": node, "depth": 5, "published": 10, "dropped": 0, "drops": {}, **counts}


def topic(name="/x", *, subscriptions=(), losses=None) -> dict[str, Any]:
    return {"name": name, "type": FLOAT, "publishers": [], "subscriptions": subscriptions, "losses": losses or {}}


def answer(**parts) -> dict[str, Any]:
    empty: dict[str, Any] = {"process": "main", "pid": 1, "nodes": [], "topics": [], "timers": [], "inbox": {}}
    return empty | parts


def found(tokens=(), *answers):
    """The findings, each with its code, its severity and its fix."""
    answers = answers or (answer(),)
    problems = findings(view(tokens, answers), tokens, answers)
    return "\n".join(f"{each.severity.name} {each.code}: {each.message}\n  {each.fix}" for each in problems)


def pair(published="/x", subscribed="/x", *, ends=(TokenKind.PUBLISHER, TokenKind.SUBSCRIPTION), **other):
    return [token(ends[0], "source", published), token(ends[1], "sink", subscribed, **other)]


def test_a_graph_in_which_all_fits_is_healthy():
    timer = {"node": "/source", "name": "tick", "fired": 1000, "missed": 1}
    served = {"node": "/arm", "received": 2, "served": 2, "failed": 0, "refused": 0, "withdrawn": 0, "lost": 0}
    services = [{"name": "/arm/grip", "servers": [served], "clients": []}]
    told = answer(topics=[topic(subscriptions=[subscription()])], timers=[timer], services=services)
    assert found(pair(), told) == ""
    assert found(pair(hash_="TypeHashNotSupported")) == "", "Humble states no hash"
    hidden = [token(kind, "_busflow_cli_7", "/y") for kind in (TokenKind.SUBSCRIPTION, TokenKind.CLIENT)]
    assert found(hidden) == ""
    external = topic() | {"external": True}
    assert found([token(TokenKind.SUBSCRIPTION, "sink", "/x")], answer(topics=[external])) == ""


STRANGE = replace(token(TokenKind.PUBLISHER, "source", "/x"), qos="::,99:999999999999999999999999,0:,:,,")
TOKENS = {
    "other type": pair(type_="std_msgs/msg/String"),
    "other definition": pair(hash_="RIHS01_2"),
    "other QoS in another process": [
        token(TokenKind.PUBLISHER, "source", "/x", qos=SENSOR_DATA, session="b"),
        token(TokenKind.SUBSCRIPTION, "sink", "/x", qos=QoS(deadline_s=0.5)),
    ],
    "no publisher": pair("/imu/data", "/imu/dta"),
    "no server": [
        *pair("/camera/take", "/camera/tak", ends=(TokenKind.SERVICE, TokenKind.CLIENT)),
        token(TokenKind.SERVICE, "camera", "/camera/get_parameters", type_="rcl_interfaces/srv/GetParameters"),
    ],
    "two nodes of one name": [token(TokenKind.NODE, "arm"), token(TokenKind.NODE, "arm", session="b")],
    "unreadable QoS": [STRANGE, token(TokenKind.SUBSCRIPTION, "sink", "/x")],
}


@pytest.mark.parametrize("case", TOKENS)
def test_wrong_ends_are_named_with_a_fix(case, golden):
    golden(found(TOKENS[case]))


SERVER = {"node": "/arm", "received": 9, "served": 2, "failed": 1, "refused": 2, "withdrawn": 3, "lost": 1}
CLIENT = {"node": "/leg", "called": 1, "answered": 0, "failed": 1, "timed_out": 1, "cancelled": 0}
LOSSES = {"lost": 3, "malformed": 1, "refused": 2, "incompatible": 4, "unsigned": 5, "early": 2, "unsent": 6}
FAILURES = ["failed in Arm.tick: ValueError: no"]
ANSWERS = {
    "failed calls": answer(services=[{"name": "/arm/grip", "servers": [SERVER], "clients": [CLIENT]}]),
    "drops": answer(topics=[topic(subscriptions=[subscription(dropped=4, drops={"expired": 1, "overflow": 3})])]),
    "losses": answer(
        topics=[
            topic(losses=LOSSES),
            topic("/y", losses={"lost": 0}),
            topic("/z", subscriptions=[subscription("/a"), subscription("/b")], losses={"lost": 1}),
        ],
        inbox={"dropped": 2, "refused": 1},
        timers=[{"node": "/source", "name": "tick", "fired": 90, "missed": 10}],
    ),
    "restarted node": answer(nodes=[{"name": "/arm", "state": "running", "restarts": 2, "failures": FAILURES}]),
    "stopped node": answer(nodes=[{"name": "/arm", "state": "stopped by hand"}]),
    "failed node first": answer(
        nodes=[{"name": "/arm", "state": "failed", "failures": FAILURES}], inbox={"dropped": 2}
    ),
}


@pytest.mark.parametrize("case", ANSWERS)
def test_losses_and_failures_are_named_with_a_fix(case, golden):
    golden(found(pair() if case == "drops" else (), ANSWERS[case]))
