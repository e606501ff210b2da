"""QoS as rmw_zenoh writes it in tokens."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow import QoS
from busflow.bus.qos import PRESETS, Durability, Liveliness, Reliability
from busflow.errors import MalformedMessage
from busflow.wire.zenoh.qos_text import WireQoS, as_qos, from_text, to_text

nanoseconds = st.integers(1, 2**53)
limits = st.none() | nanoseconds.map(lambda ns: ns / 1e9)


def stays(word):
    return word != "best_available"


@given(
    st.builds(
        QoS,
        depth=st.integers(1, 2**31),
        reliability=st.sampled_from(Reliability).filter(stays),
        durability=st.sampled_from(Durability).filter(stays),
        liveliness=st.sampled_from(Liveliness).filter(stays),
        deadline_s=limits,
        lifespan_s=limits,
        lease_s=limits,
    )
)
def test_what_is_written_is_read_back(qos):
    found = from_text(to_text(qos))
    assert (found.reliability, found.durability, found.history) == (qos.reliability, qos.durability, "keep_last")
    assert (found.depth, found.liveliness) == (qos.depth, qos.liveliness)
    for ns, seconds in (
        (found.deadline_ns, qos.deadline_s),
        (found.lifespan_ns, qos.lifespan_s),
        (found.lease_ns, qos.lease_s),
    ):
        assert ns == (None if seconds is None else round(seconds * 1e9))


@pytest.mark.parametrize(
    ("text", "expected"),
    [  # recorded from rmw_zenoh, and its defaults
        (":1:,7:,:,:,,", WireQoS(durability="transient_local", depth=7)),
        ("::,10:,:,:,,", WireQoS(depth=10)),
        ("::,:,:,:,,", WireQoS()),
        ("2::,5:,:,:,,", WireQoS(reliability="best_effort", depth=5)),
        ("::2,:,:,:,,", WireQoS(history="keep_all")),
        ("::,:0,500000000:1,0:3,2,5", WireQoS(deadline_ns=500_000_000, lifespan_ns=1_000_000_000,
                                             liveliness="manual_by_topic", lease_ns=2_000_000_005)),
        ("::,:5,:,0:,,", WireQoS(deadline_ns=5_854_775_807, lifespan_ns=9_223_372_036_000_000_000)),
    ],
)  # fmt: skip
def test_what_rmw_zenoh_writes_is_understood(text, expected):
    assert from_text(text) == expected


def test_qos_presets_are_written_as_in_ros_2():
    assert to_text(PRESETS["default"]) == "::,10:,:,:0,,"
    assert to_text(PRESETS["sensor_data"]) == "2::,5:,:,:0,,"
    assert to_text(QoS(depth=42)) == "::,:,:,:,,"


def test_best_available_is_written_as_what_fits():
    assert to_text(PRESETS["best_available"]) == ":1:,10:,:,:3,,"
    assert to_text(PRESETS["best_available"], is_request=True) == "2::,10:,:,:,,"


@pytest.mark.parametrize(
    "text",
    ["", ":", "9::,:,:,:,,", "::,x:,:,:,,", "::,:,:,:", "::,:1:,:,,", "::,:,:,:,,:", "::,:1,2,3:,:,,", "a:b:c:d:e:f"],
)
def test_what_is_none_is_refused(text):
    with pytest.raises(MalformedMessage):
        from_text(text)


@given(st.text(alphabet="0123456789:,-x", max_size=40) | st.text(max_size=40))
def test_any_text_is_a_qos_or_refused(text):
    try:
        found = from_text(text)
    except MalformedMessage:
        return
    assert isinstance(found.depth, int)
    as_qos(found)


@given(
    st.tuples(*[st.sampled_from(["", *"01234"])] * 4),
    st.tuples(*[st.just("") | st.integers(-(10**15), 10**15).map(str)] * 7),
)
def test_what_is_parsed_is_a_profile(words, numbers):
    reliability, durability, history, liveliness = words
    depth, *limits = numbers
    text = "{}:{}:{},{}:{},{}:{},{}:{},{},{}".format(
        reliability, durability, history, depth, *limits[:4], liveliness, *limits[4:]
    )
    try:
        found = from_text(text)
    except MalformedMessage:
        return
    assert as_qos(found).depth == min(max(1, found.depth), 1 << 31)


@pytest.mark.parametrize("limit", ["99999999999999,0", "9223372036,854775808", "-1,0", "0,-1"])
def test_impossible_limits_are_refused(limit):
    for text in (f"::,:{limit}:,:,,", f"::,:,:{limit}:,,", f"::,:,:,:,{limit}"):
        with pytest.raises(MalformedMessage):
            from_text(text)


def test_the_longest_limit_is_understood():
    assert as_qos(from_text("::,:9223372036,854775807:,:,,")).deadline_s is None  # RMW_DURATION_INFINITE
