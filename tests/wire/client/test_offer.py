"""What a client offers suffices for the subscriptions that are there; those that do not receive are named."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.bus.qos import QoS
from busflow.bus.qos_matching import Verdict, compatibility
from busflow.interfaces.encoding.foreign import ForeignType
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.std_msgs import Float64
from busflow.wire.client.offer import Offer, misfits
from busflow.wire.zenoh.keys import Token, TokenKind
from busflow.wire.zenoh.qos_text import WireQoS, as_qos, from_text, to_text, written
from tests.vectors import each_case

SUPPORT = TypeSupport(Float64)
TYPE = ForeignType(SUPPORT.name, SUPPORT.type_hash, SUPPORT.description)
LIMITS = st.none() | st.integers(1, 10**12).map(lambda ns: ns / 10**9)
PROFILES = st.builds(
    QoS,
    reliability=st.sampled_from(["reliable", "best_effort", "system_default"]),
    durability=st.sampled_from(["volatile", "transient_local", "system_default"]),
    liveliness=st.sampled_from(["automatic", "manual_by_topic", "system_default"]),
    deadline=LIMITS,
    lease=LIMITS,
)


def subscription(qos, number=0, type_=SUPPORT.name, type_hash=SUPPORT.type_hash):
    text = qos if isinstance(qos, str) else to_text(qos)
    return Token("a", 1, number, TokenKind.SUBSCRIPTION, "/", f"node{number}", "/x", type_, type_hash, text)


@given(st.lists(PROFILES, max_size=4))
def test_the_offer_suffices_for_every_subscription(requested):
    ends = [subscription(qos, number) for number, qos in enumerate(requested)]
    offered = as_qos(from_text(text := Offer().text(ends)))
    assert all(compatibility(offered, qos).verdict is not Verdict.ERROR for qos in requested)
    assert misfits(TYPE, text, ends) == {}


@given(PROFILES, PROFILES)
def test_misfits_are_those_that_are_refused(offered, requested):
    found = compatibility(offered, requested)
    expected = {"/node0": "; ".join(found.reasons)} if found.verdict is Verdict.ERROR else {}
    assert misfits(TYPE, to_text(offered), [subscription(requested)]) == expected


@each_case("a_qos_best_available")
def test_offer_is_best_available_as_in_ros(case):
    ends = [subscription(written(WireQoS(**peer)), number) for number, peer in enumerate(case["peers"])]
    offered = from_text(Offer().text(ends))
    assert {name: getattr(offered, name) for name in case["expect"]} == case["expect"]


def test_stated_words_are_offered_whatever_is_asked(golden):
    asked = [subscription(QoS(durability="transient_local", deadline=2.0))]
    text = Offer(depth=3, reliability="best_effort", durability="volatile").text(asked)
    assert text == "2::,3:2,0:,:,,"
    golden(misfits(TYPE, text, asked)["/node0"])


@pytest.mark.parametrize(
    ("end", "why"),
    [
        ({"type_": "std_msgs/msg/String"}, "it receives std_msgs/msg/String, not std_msgs/msg/Float64"),
        ({"type_hash": "RIHS01_2"}, "it has another definition of std_msgs/msg/Float64"),
        ({"qos": "no QoS"}, None),
    ],
)
def test_another_type_does_not_receive(end, why):
    ends = [subscription(**({"qos": QoS()} | end))]
    assert misfits(TYPE, Offer().text(ends), ends) == ({} if why is None else {"/node0": why})
