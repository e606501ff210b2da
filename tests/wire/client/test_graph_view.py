"""The graph that tokens and answers make up together."""

from dataclasses import replace

import pytest

from busflow.errors import NoSuchTarget
from busflow.wire.client.graph_view import is_hidden, view
from busflow.wire.zenoh.keys import Token, TokenKind
from busflow.wire.zenoh.qos_text import WireQoS

HASH = "RIHS01_" + "0" * 64


def node(name, session="a"):
    return Token(session, 1, 1, TokenKind.NODE, "/", name)


def end(kind, name, topic, *, type_="std_msgs/msg/String", entity=2, qos="::,10:,:,:,,", session="a"):
    return Token(session, 1, entity, kind, "/", name, topic, type_, HASH, qos)


def answer(*, nodes=(), topics=()):
    return {"process": "main", "pid": 7, "nodes": list(nodes), "topics": list(topics)}


def told(topic, *, publishers=(), subscriptions=(), **more):
    return {
        "name": topic,
        "type": "std_msgs/msg/String",
        "publishers": publishers,
        "subscriptions": subscriptions,
    } | more


def test_tokens_alone_show_foreign_nodes():
    found = view(
        [
            node("talker"),
            end(TokenKind.PUBLISHER, "talker", "/chatter"),
            end(TokenKind.SUBSCRIPTION, "ear", "/chatter"),
            end(TokenKind.SERVICE, "talker", "/talker/reset", type_="std_srvs/srv/Trigger"),
            end(TokenKind.CLIENT, "ear", "/talker/reset", type_="std_srvs/srv/Trigger"),
        ],
        [],
    )
    assert list(found.nodes) == ["/ear", "/talker"]
    topic = found.topic("chatter")
    assert (topic.type, [each.node for each in topic.publishers]) == ("std_msgs/msg/String", ["/talker"])
    assert [each.node for each in topic.subscriptions] == ["/ear"]
    assert topic.publishers[0].qos == WireQoS(depth=10)
    talker = found.node("/talker")
    assert [each.token.topic for each in (*talker.publishers, *talker.services)] == ["/chatter", "/talker/reset"]
    assert [each.node for each in found.services["/talker/reset"].subscriptions] == ["/ear"]


def test_answers_add_counts_states_and_topics_without_ends():
    found = view(
        [end(TokenKind.PUBLISHER, "talker", "/chatter")],
        [
            answer(
                nodes=[{"name": "/talker", "state": "running"}, {"name": "/idle", "state": "failed"}],
                topics=[
                    told("/chatter", publishers=[{"node": "/talker", "published": 3}], published=3),
                    told("/silent"),
                ],
            )
        ],
    )
    assert found.nodes["/idle"].details == {"name": "/idle", "state": "failed", "process": "main", "pid": 7}
    assert found.topic("chatter").publishers[0].details["published"] == 3
    assert found.topic("chatter").details["published"] == 3
    assert (found.topic("silent").type, found.topic("silent").publishers) == ("std_msgs/msg/String", ())


def test_topic_keeps_its_kind_without_endpoints():
    stated = "RIHS01_" + "1" * 64
    answers = [answer(topics=[told("/chatter", hash=stated)])]
    publisher = replace(end(TokenKind.PUBLISHER, "talker", "/chatter"), hash=stated)
    kinds = [view(tokens, answers).topic("/chatter").kinds for tokens in ([publisher], [])]
    assert kinds == [(("std_msgs/msg/String", stated),)] * 2


def test_two_subscriptions_of_a_node_keep_separate_statistics():
    tokens = [end(TokenKind.SUBSCRIPTION, "ear", "/chatter", entity=entity) for entity in (3, 2)]
    lines = [{"node": "/ear", "delivered": number} for number in (20, 30)]
    found = view(tokens, [answer(topics=[told("/chatter", subscriptions=lines)])])
    ends = found.topic("/chatter").subscriptions
    assert [(each.token.entity_id, each.details["delivered"]) for each in ends] == [(2, 20), (3, 30)]


def test_types_in_conflict_are_both_shown():
    tokens = [end(TokenKind.PUBLISHER, "a", "/x"), end(TokenKind.SUBSCRIPTION, "b", "/x", type_="std_msgs/msg/Int64")]
    assert view(tokens, []).topic("x").type == "std_msgs/msg/String, std_msgs/msg/Int64"


def test_a_token_with_invalid_qos_shows_the_default():
    found = view([end(TokenKind.PUBLISHER, "odd", "/x", qos="nonsense")], [])
    assert found.topic("x").publishers[0].qos == WireQoS()


def test_an_unknown_name_suggests_the_nearest_visible_one():
    found = view([end(TokenKind.PUBLISHER, "talker", "/chatter"), end(TokenKind.PUBLISHER, "_cli", "/_chatte")], [])
    with pytest.raises(NoSuchTarget, match=r"/chatte;.*'/chatter'"):
        found.topic("chatte")
    with pytest.raises(NoSuchTarget, match=r"/\\x1b;.* /talker"):
        found.node("\x1b")


@pytest.mark.parametrize(
    ("name", "hidden"), [("/a/_b", True), ("/_a/b", True), ("/a_b", False), ("/a/b_", False), ("/", False)]
)
def test_what_ros_2_hides_is_hidden(name, hidden):
    assert is_hidden(name) is hidden


def test_topic_has_the_versions_of_its_types():
    def of(kind, entity, type_hash):
        return Token("a", 1, entity, kind, "/", "n", "/a", "lab/msg/Thing", type_hash)

    tokens = [
        of(TokenKind.PUBLISHER, 2, "RIHS01_1"),
        of(TokenKind.SUBSCRIPTION, 3, "RIHS01_2"),
        of(TokenKind.SUBSCRIPTION, 4, ""),
    ]
    assert view(tokens, []).topics["/a"].kinds == (
        ("lab/msg/Thing", "RIHS01_1"),
        ("lab/msg/Thing", "RIHS01_2"),
    )
    assert view(tokens[2:], []).topics["/a"].kinds == (("lab/msg/Thing", None),)
