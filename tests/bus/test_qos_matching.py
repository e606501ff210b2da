"""Tests of `qos_matching.py`: endpoints that fit, and the fix for those that do not."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.bus.qos import PRESETS, Durability, Liveliness, QoS, Reliability
from busflow.bus.qos_matching import Verdict, compatibility
from tests.bus.test_qos import profile
from tests.vectors import each_case, suite

COMPAT = suite("a_qos_compat")


def check_pair(pub, sub, expect, policies):
    found = compatibility(profile(pub), profile(sub))
    assert (found.verdict.value, list(found.policies)) == (expect, policies)
    assert len(found.reasons) == len(found.policies)
    assert bool(found.fix) == (found.verdict is not Verdict.OK)


@each_case("a_qos_compat")
def test_a_pair_fits_as_in_ros_2(case):
    check_pair(case["pub"], case["sub"], case["expect"], case["policies"])


def test_every_row_of_the_matrix():
    """Two thousand pairs in one test: a test of its own for each would take longer than all of them."""
    assert len(COMPAT["matrix"]) == COMPAT["count_matrix"]
    for row in COMPAT["matrix"]:
        values = dict(zip(COMPAT["matrix_columns"], row, strict=True))
        ends = [{key[4:]: value for key, value in values.items() if key.startswith(end)} for end in ("pub.", "sub.")]
        check_pair(*ends, values["expect"], values["policies"])


@pytest.mark.parametrize("unclear", [Reliability.SYSTEM_DEFAULT, Reliability.UNKNOWN])
def test_there_is_no_doubt_where_either_way_fits(unclear):
    """A publisher fits a best-effort subscription, and a reliable publisher fits every subscription."""
    weak, strong, unclear = (QoS(reliability=each) for each in (Reliability.BEST_EFFORT, Reliability.RELIABLE, unclear))
    assert compatibility(unclear, weak).verdict is Verdict.OK
    assert compatibility(strong, unclear).verdict is Verdict.OK
    assert compatibility(weak, unclear).verdict is Verdict.WARNING
    assert compatibility(unclear, strong).verdict is Verdict.WARNING


def test_fix_is_minimal_for_either_end(golden):
    found = compatibility(QoS(deadline_s=0.1), QoS(deadline_s=0.05, durability=Durability.TRANSIENT_LOCAL))
    golden("\n".join([*found.reasons, found.fix]))


words = st.sampled_from
profiles = st.builds(
    QoS,
    reliability=words(Reliability),
    durability=words(Durability),
    liveliness=words(Liveliness),
    deadline_s=st.none() | words([0.5, 1.0, 2.0]),
    lease_s=st.none() | words([0.5, 1.0, 2.0]),
    depth=st.integers(1, 20),
)


@given(profiles, profiles)
def test_doing_what_the_fix_says_mends_the_pair(offered, requested):
    """The fix is read as a user would: each half of it, on its end alone, is enough."""
    offered, requested = QoS.merge(offered), QoS.merge(requested)
    found = compatibility(offered, requested)
    if found.verdict is not Verdict.ERROR:
        return
    halves = found.fix.removeprefix("set ").split(", or ")
    changes = []
    for half, end in zip(halves, ("subscription", "publisher"), strict=True):
        lines = half.removesuffix(f" on the {end}").split(" and ")
        yaml = dict(line.split(": ") for line in lines)
        changes.append(QoS.model_validate({key: None if text == "null" else text for key, text in yaml.items()}))
    assert compatibility(offered, QoS.merge(requested, changes[0])).verdict is not Verdict.ERROR
    assert compatibility(QoS.merge(offered, changes[1]), requested).verdict is not Verdict.ERROR


@given(profiles)
def test_what_is_definite_fits_itself(one):
    merged = QoS.merge(one)
    if not {"unknown", "best_available"} & {merged.reliability, merged.durability, merged.liveliness}:
        assert compatibility(merged, merged).verdict is Verdict.OK


def test_merged_presets_give_no_warning():
    """ROS 2's own profiles leave the liveliness to the middleware; busflow decides it."""
    for one, other in itertools.product(PRESETS.values(), repeat=2):
        found = compatibility(QoS.merge(one), QoS.merge(other))
        assert found.verdict is not Verdict.WARNING
