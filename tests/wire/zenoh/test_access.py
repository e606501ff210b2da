"""What passes over a link to nodes of ROS 2, by Zenoh's own rules for key expressions."""

import pytest
import zenoh

from busflow.wire.zenoh.keys import Token, TokenKind, topic_key
from busflow.wire.zenoh.network import Network, Ros2Network

IMU = ("sensor_msgs/msg/Imu", "RIHS01_" + "7" * 64)


def passes(access, message: str, key: str) -> bool:
    """Whether a message of this kind with this key passes over a TCP link, in both directions."""
    subjects = {each["id"] for each in access["subjects"] if "tcp" in each["link_protocols"]}
    rules = {rule for each in access["policies"] if subjects & set(each["subjects"]) for rule in each["rules"]}
    wanted = zenoh.KeyExpr(key)
    return any(
        zenoh.KeyExpr(allowed).includes(wanted)
        for rule in access["rules"]
        if rule["id"] in rules and message in rule["messages"] and rule["flows"] == ["ingress", "egress"]
        for allowed in rule["key_exprs"]
    )


def access(*topics: str):
    return Network((), ros2=Ros2Network(7, topics)).settings()["access_control"]


def token(kind: TokenKind, topic: str = "", domain: int = 7) -> str:
    return str(
        Token("ab", 0, 1, kind, "/arm", "driver", topic, *(IMU if topic else ("", "")), "::,10:,:,:,,", domain=domain)
    )


def test_ros2_has_the_keys_of_its_domain():
    found = access()
    assert found["default_permission"] == "deny"
    for message, key in [
        ("put", topic_key("/imu/data", *IMU, domain=7)),
        ("query", topic_key("/imu/data", *IMU, domain=7) + "/@adv/**"),
        ("declare_liveliness_subscriber", "@ros2_lv/7/**"),
        ("liveliness_token", token(TokenKind.PUBLISHER, "/imu/data")),
    ]:
        assert passes(found, message, key), key
    for message, key in [
        ("query", "@busflow/1/main/run"),
        ("liveliness_token", "@busflow/1/main/shown/ab/3"),
        ("put", topic_key("/imu/data", *IMU, domain=8)),
        ("liveliness_token", token(TokenKind.NODE, domain=8)),
    ]:
        assert not passes(found, message, key), key


@pytest.mark.parametrize(
    ("pattern", "inside", "outside"),
    [
        ("/imu/*", ["/imu/data"], ["/imu", "/imu/left/data", "/joint_states"]),
        ("arm/**", ["/arm/left/state", "/arm/state"], ["/army/state"]),
        ("/left_*/state", ["/left_arm/state"], ["/left_arm/x/state", "/right_arm/state"]),
        ("/**", ["/imu/data", "/x"], []),
    ],
)
def test_only_topics_of_the_patterns_pass(pattern, inside, outside):
    found = access(pattern)
    for topic in inside:
        assert passes(found, "put", topic_key(topic, *IMU, domain=7)), topic
        assert passes(found, "query", topic_key(topic, *IMU, domain=7) + "/@adv/**"), topic
        assert passes(found, "liveliness_token", token(TokenKind.SUBSCRIPTION, topic)), topic
    for topic in outside:
        assert not passes(found, "put", topic_key(topic, *IMU, domain=7)), topic
    assert passes(found, "liveliness_token", token(TokenKind.NODE))
    assert passes(found, "declare_liveliness_subscriber", "@ros2_lv/7/**")


def test_only_links_by_tcp_are_narrowed():
    subjects = {each["id"]: each["link_protocols"] for each in access()["subjects"]}
    assert subjects == {"here": ["unixsock-stream"], "ros2": ["tcp"]}
