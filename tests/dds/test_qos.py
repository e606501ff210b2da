"""The tests of `qos` and of `topics.requested`."""

import pytest
from cyclonedds.qos import Policy

from busflow.dds.qos import from_dds, to_dds
from busflow.dds.topics import requested
from busflow.wire.zenoh.qos_text import WireQoS

RELIABLE, BEST_EFFORT = WireQoS(depth=5), WireQoS(reliability="best_effort", depth=7)
LATCHED = WireQoS(durability="transient_local", depth=3)


@pytest.mark.parametrize(
    "stated",
    [
        WireQoS(depth=10),
        WireQoS(reliability="best_effort", depth=10),
        LATCHED,
        WireQoS(depth=10, deadline_ns=5_000_000, lifespan_ns=7_000_000),
        WireQoS(depth=10, liveliness="manual_by_topic", lease_ns=9_000_000),
    ],
)
def test_qos_is_the_same_there_and_back(stated):
    assert from_dds(to_dds(stated, b"")) == stated


def test_writer_keeps_as_many_messages_as_stated():
    policies = to_dds(LATCHED, b"")
    assert policies[Policy.History] == Policy.History.KeepLast(3)
    assert policies[Policy.DurabilityService].history == Policy.History.KeepLast(3)


def test_endpoints_speak_the_first_version_of_cdr():
    for is_reader in (False, True):
        policy = to_dds(RELIABLE, b"", is_reader=is_reader)[Policy.DataRepresentation]
        assert (policy.use_cdrv0_representation, policy.use_xcdrv2_representation) == (True, False)


@pytest.mark.parametrize("depth", [0, -1, 1 << 40])
def test_any_depth_makes_a_history(depth):
    assert 1 <= to_dds(WireQoS(depth=depth), b"")[Policy.History].depth <= 10_000


@pytest.mark.parametrize(
    ("subscriptions", "offered", "reliability", "durability", "depth"),
    [
        ([RELIABLE], [], "reliable", "volatile", 5),
        ([RELIABLE, BEST_EFFORT], [RELIABLE], "reliable", "volatile", 7),
        ([RELIABLE], [RELIABLE, BEST_EFFORT], "best_effort", "volatile", 5),
        ([BEST_EFFORT], [RELIABLE], "best_effort", "volatile", 7),
        ([LATCHED], [LATCHED], "reliable", "transient_local", 3),
        ([LATCHED], [LATCHED, RELIABLE], "reliable", "volatile", 3),
    ],
)
def test_reader_requests_what_every_writer_offers(subscriptions, offered, reliability, durability, depth):
    found = requested(subscriptions, offered)
    assert (found.reliability, found.durability, found.depth) == (reliability, durability, depth)
