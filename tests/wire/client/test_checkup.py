"""What is wrong in a graph, found in its tokens and its processes' answers."""

from dataclasses import replace
from typing import Any

from busflow.bus.qos import SENSOR_DATA, QoS
from busflow.errors import Severity
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
    answers = answers or (answer(),)
    return findings(view(tokens, answers), tokens, answers)


def test_a_graph_in_which_all_fits_is_healthy():
    ends = [token(TokenKind.PUBLISHER, "source", "/x"), token(TokenKind.SUBSCRIPTION, "sink", "/x")]
    timer = {"node": "/source", "name": "tick", "fired": 1000, "missed": 1}
    assert found(ends, answer(topics=[topic(subscriptions=[subscription()])], timers=[timer])) == []


def test_conflicting_types_and_definitions_name_their_nodes():
    other = token(TokenKind.SUBSCRIPTION, "sink", "/x", type_="std_msgs/msg/String")
    (problem,) = found([token(TokenKind.PUBLISHER, "source", "/x"), other])
    assert (problem.code, problem.severity) == ("type-mismatch", Severity.ERROR)
    assert problem.message == f"/x carries {FLOAT} (/source) and std_msgs/msg/String (/sink)"
    (problem,) = found(
        [token(TokenKind.PUBLISHER, "source", "/x"), token(TokenKind.SUBSCRIPTION, "sink", "/x", hash_="RIHS01_2")]
    )
    assert problem.message == f"/x carries 2 definitions of {FLOAT} (/source) and {FLOAT} (/sink)"
    humble = token(TokenKind.SUBSCRIPTION, "sink", "/x", hash_="TypeHashNotSupported")
    assert found([token(TokenKind.PUBLISHER, "source", "/x"), humble]) == []


def test_unfit_pair_is_found_in_other_processes():
    ends = [
        token(TokenKind.PUBLISHER, "source", "/x", qos=SENSOR_DATA, session="b"),
        token(TokenKind.SUBSCRIPTION, "sink", "/x", qos=QoS(deadline_s=0.5)),
    ]
    (problem,) = found(ends)
    assert problem.code == "qos-mismatch"
    assert "/sink cannot receive /x from /source: reliability: best_effort is offered" in problem.message
    assert "deadline: null is offered, 500ms is requested" in problem.message
    assert problem.fix is not None
    assert "on the publisher" in problem.fix


def test_unpublished_topic_is_named_with_the_nearest():
    ends = [token(TokenKind.PUBLISHER, "source", "/imu/data"), token(TokenKind.SUBSCRIPTION, "sink", "/imu/dta")]
    (problem,) = found(ends)
    assert problem.message == "/sink receives /imu/dta, which has no publisher"
    assert problem.fix == "did you mean '/imu/data'?"
    assert found([token(TokenKind.SUBSCRIPTION, "_busflow_cli_7", "/imu/dta")]) == []


def test_external_topic_needs_no_publisher():
    ends = [token(TokenKind.SUBSCRIPTION, "sink", "/x")]
    assert found(ends, answer(topics=[topic() | {"external": True}])) == []
    assert len(found(ends, answer(topics=[topic() | {"external": False}]))) == 1


def test_client_without_server_is_named_with_the_nearest():
    ends = [
        token(TokenKind.SERVICE, "camera", "/camera/take"),
        token(TokenKind.SERVICE, "camera", "/camera/get_parameters", type_="rcl_interfaces/srv/GetParameters"),
        token(TokenKind.CLIENT, "arm", "/camera/tak"),
    ]
    (problem,) = found(ends)
    assert problem.message == "/arm calls /camera/tak, which has no server"
    assert (problem.fix, problem.severity) == ("did you mean '/camera/take'?", Severity.WARNING)
    assert found([token(TokenKind.CLIENT, "_busflow_cli_7", "/camera/tak")]) == []


def test_failed_calls_are_reported_with_a_fix():
    server = {"node": "/arm", "received": 9, "served": 2, "failed": 1, "refused": 2, "withdrawn": 3, "lost": 1}
    client = {"node": "/leg", "called": 1, "answered": 0, "failed": 1, "timed_out": 1, "cancelled": 0}
    told = answer(services=[{"name": "/arm/grip", "servers": [server], "clients": [client]}])
    assert [(problem.message, problem.fix) for problem in found((), told)] == [
        ("1 of 9 calls of /arm/grip failed in /arm", "busflow log --level error shows why"),
        ("2 of 9 calls of /arm/grip found no room at /arm", "raise its depth, or make its handler faster"),
        ("3 of 9 calls of /arm/grip got no answer from /arm in time", "make its handler faster, or wait longer"),
        ("1 of 1 call of /arm/grip took longer than /leg waited", "raise its timeout, or make the handler faster"),
    ]
    fine = dict.fromkeys(server, 0) | {"node": "/arm", "received": 2, "served": 2}
    assert found((), answer(services=[{"name": "/arm/grip", "servers": [fine], "clients": []}])) == []


def test_two_nodes_of_one_name():
    (problem,) = found([token(TokenKind.NODE, "arm"), token(TokenKind.NODE, "arm", session="b")])
    assert problem.message == "2 nodes are called /arm"


def test_drops_are_reported_with_reason_and_fix():
    ends = [token(TokenKind.PUBLISHER, "source", "/x"), token(TokenKind.SUBSCRIPTION, "sink", "/x")]
    lost = subscription(dropped=4, drops={"expired": 1, "overflow": 3})
    (problem,) = found(ends, answer(topics=[topic(subscriptions=[lost])]))
    assert problem.message == "/sink dropped 4 of 10 messages on /x (expired 1, overflow 3), depth 5"
    assert problem.fix == "raise its depth, make its handler faster, or choose overflow: block"


def test_losses_of_topics_inbox_and_timers_are_findings():
    told = answer(
        topics=[topic(losses={"lost": 3, "malformed": 1, "refused": 0, "early": 2})],
        inbox={"dropped": 2, "refused": 0},
        timers=[{"node": "/source", "name": "tick", "fired": 90, "missed": 10}],
    )
    assert [problem.message for problem in found((), told)] == [
        "3 messages on /x from other processes never arrived",
        "1 message on /x from other processes could not be read",
        "2 messages on /x to other processes were published before these had let the publisher in",
        "2 messages that threads published came too fast",
        "the timer tick of /source missed 10 of 100 ticks",
    ]


def test_restarted_node_is_reported_with_the_reason():
    nodes = [{"name": "/arm", "state": "running", "restarts": 2, "failures": ["failed in Arm.tick: ValueError: no"]}]
    (problem,) = found((), answer(nodes=nodes))
    assert problem.message == "/arm was started anew 2 times: failed in Arm.tick: ValueError: no"
    assert problem.severity is Severity.WARNING


def test_a_failed_node_comes_first():
    nodes = [{"name": "/arm", "state": "failed", "failures": ["failed in Arm.tick: ValueError: no"]}]
    told = answer(nodes=nodes, inbox={"dropped": 2})
    first, second = found((), told)
    assert first.message == "/arm has failed: failed in Arm.tick: ValueError: no"
    assert second.severity is Severity.WARNING


def test_unreadable_qos_does_not_hide_the_rest():
    strange = token(TokenKind.PUBLISHER, "source", "/x")
    strange = replace(strange, qos="::,99:999999999999999999999999,0:,:,,")
    (problem,) = found([strange, token(TokenKind.SUBSCRIPTION, "sink", "/x")])
    assert problem.message.startswith("/source states no QoS for /x: '::,99:9999")
