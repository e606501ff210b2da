"""What a recording says of the QoS of its publishers."""

import pytest

from busflow.bus.qos import QoS
from busflow.errors import BagError
from busflow.recording.bag.offered_qos import offered

FOREVER = "\n    sec: 9223372036\n    nsec: 854775807"
OLD_FOREVER = "\n    sec: 2147483647\n    nsec: 4294967295"


def profile(**changes):
    told = {
        "history": "keep_last",
        "depth": 5,
        "reliability": "best_effort",
        "durability": "volatile",
        "deadline": FOREVER,
        "lifespan": FOREVER,
        "liveliness": "automatic",
        "liveliness_lease_duration": FOREVER,
        "avoid_ros_namespace_conventions": "false",
    } | changes
    return "- " + "\n  ".join(f"{name}: {value}" for name, value in told.items()) + "\n"


NUMBERS = profile(history=1, reliability=2, durability=2, liveliness=1, deadline=OLD_FOREVER, lifespan=OLD_FOREVER)


@pytest.mark.parametrize("text", [profile(), NUMBERS], ids=["words", "numbers"])
def test_qos_profiles_are_read_in_words_or_numbers(text):
    assert offered(text) == QoS(depth=5, reliability="best_effort")


def test_limits_are_read():
    limit = "\n    sec: 1\n    nsec: 500000000"
    found = offered(
        profile(deadline=limit, lifespan=limit, liveliness="manual_by_topic", liveliness_lease_duration=limit)
    )
    assert (found.deadline_s, found.lifespan_s, found.lease_s) == (1.5, 1.5, 1.5)
    assert found.liveliness.value == "manual_by_topic"


def test_of_several_publishers_it_offers_what_all_offered():
    latched = profile(reliability="reliable", durability="transient_local", depth=1)
    assert offered(latched) == QoS(depth=1, durability="transient_local")
    assert offered(latched + profile()) == QoS(depth=5, reliability="best_effort")


def test_what_is_kept_for_ever_is_bounded():
    assert offered(profile(history="keep_all", depth=0)).depth == 1000


def test_unknown_words_become_the_default():
    assert offered(profile(reliability="system_default", durability="unknown", liveliness=9)) == QoS(depth=5)


@pytest.mark.parametrize("nothing", [None, "", "[]"])
def test_where_nothing_is_said_there_is_none(nothing):
    assert offered(nothing) is None


@pytest.mark.parametrize("text", ["{", "3", "- 3", "- deadline: {sec: x, nsec: 0}", "- deadline: {sec: 1}", "[[["])
def test_anything_else_is_refused_in_one_line(text, golden):
    with golden.raises(BagError):
        offered(text)
