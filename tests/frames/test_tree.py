"""The pure tree (`rigid`, `edge`, `tree`): against matrices, facts of tf2's tests, and each reason for no transform."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from busflow.errors import (
    FramesNotConnected,
    InvalidTransform,
    TransformError,
    TransformNotThere,
    TransformTooOld,
    UnknownFrame,
)
from busflow.frames.edge import KEPT_NS, MOST, Edge, Lack
from busflow.frames.rigid import IDENTITY, between, from_rpy, inverse, multiply, rotate, unit
from busflow.frames.tree import MOST_FRAMES, FrameTree, Gap

S = 1_000_000_000
HERE = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)


def matrix(rigid):
    """The matrix of a motion, by the formula of textbooks and not by `rotate`."""
    x, y, z, a, b, c, w = rigid
    return np.array(
        [
            [1 - 2 * (b * b + c * c), 2 * (a * b - c * w), 2 * (a * c + b * w), x],
            [2 * (a * b + c * w), 1 - 2 * (a * a + c * c), 2 * (b * c - a * w), y],
            [2 * (a * c - b * w), 2 * (b * c + a * w), 1 - 2 * (a * a + b * b), z],
            [0, 0, 0, 1],
        ]
    )


metres = st.floats(-100, 100)
turns = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: sum(each * each for each in q) > 0.01)


@st.composite
def rigids(draw):
    quaternion = draw(turns)
    length = math.sqrt(sum(each * each for each in quaternion))
    return unit((*(draw(metres) for _ in "xyz"), *(each / length for each in quaternion)))


@given(rigids(), rigids())
def test_products_and_inverses_are_those_of_matrices(a, b):
    assert matrix(multiply(a, b)) == pytest.approx(matrix(a) @ matrix(b), abs=1e-9)
    assert matrix(inverse(a)) == pytest.approx(np.linalg.inv(matrix(a)), abs=1e-9)
    assert rotate(a[3:], b[:3]) == pytest.approx(tuple(matrix(a)[:3, :3] @ b[:3]), abs=1e-9)


@given(rigids(), rigids(), st.floats(0, 1))
def test_interpolation_is_on_line_and_shortest_arc(a, b, share):
    got = between(a, b, share)
    assert got[:3] == pytest.approx(tuple((1 - share) * p + share * q for p, q in zip(a[:3], b[:3], strict=True)))
    assert math.sqrt(sum(each * each for each in got[3:])) == pytest.approx(1, abs=1e-9)
    turned = np.linalg.inv(matrix(a)) @ matrix(b)
    angle = math.acos(max(-1.0, min(1.0, (np.trace(turned[:3, :3]) - 1) / 2)))
    assume(angle < math.pi - 0.01)  # half a turn has two shortest arcs
    part = np.linalg.inv(matrix(a)) @ matrix(got)
    assert math.acos(max(-1.0, min(1.0, (np.trace(part[:3, :3]) - 1) / 2))) == pytest.approx(share * angle, abs=1e-6)


def test_near_rotations_are_interpolated_exactly():
    near = (0.0, 0.0, 0.0, *from_rpy(0, 0, 1e-7))
    assert between(IDENTITY, near, 0.25)[5] == pytest.approx(0.25 * near[5], rel=1e-9)
    assert between(IDENTITY, IDENTITY, 0.5) == IDENTITY


@given(st.floats(-math.pi, math.pi), st.floats(-1.5, 1.5), st.floats(-math.pi, math.pi))
def test_rpy_is_about_fixed_axes_in_order(roll, pitch, yaw):
    x, y, z = (np.eye(4) for _ in "xyz")
    x[1:3, 1:3] = [[math.cos(roll), -math.sin(roll)], [math.sin(roll), math.cos(roll)]]
    y[:3:2, :3:2] = [[math.cos(pitch), math.sin(pitch)], [-math.sin(pitch), math.cos(pitch)]]
    z[:2, :2] = [[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]]
    assert matrix((0, 0, 0, *from_rpy(roll, pitch, yaw))) == pytest.approx(z @ y @ x, abs=1e-9)


# The tree against a model of matrices.


@given(st.data())
def test_any_two_frames_agree_with_matrices(data):
    """Frames are added below random ones; each edge moves between two stamps, some are fixed."""
    tree, parents, at = FrameTree(), {}, data.draw(st.integers(0, S))
    count = data.draw(st.integers(1, 8))
    edges = {}
    for number in range(1, count + 1):
        parent, child = f"f{data.draw(st.integers(0, number - 1))}", f"f{number}"
        parents[child] = parent
        first, second = data.draw(rigids()), data.draw(rigids())
        if data.draw(st.booleans()):
            tree.take_fixed(parent, child, first)
            edges[child] = matrix(first)
        else:
            tree.take(parent, child, 0, first)
            tree.take(parent, child, S, second)
            edges[child] = matrix(between(unit(first), unit(second), at / S))

    def to_root(frame):
        return np.eye(4) if frame not in parents else to_root(parents[frame]) @ edges[frame]

    one, other = (f"f{data.draw(st.integers(0, count))}" for _ in range(2))
    rigid, stamp = tree.find(one, other, at)
    assert stamp == at
    assert matrix(rigid) == pytest.approx(np.linalg.inv(to_root(one)) @ to_root(other), abs=1e-6)


def test_latest_is_the_newest_common_time():
    tree = FrameTree()
    for stamp in range(5):
        tree.take("map", "odom", stamp * S, (float(stamp), 0, 0, 0, 0, 0, 1))
    for stamp in range(3):
        tree.take("odom", "base", stamp * S, (0, float(stamp), 0, 0, 0, 0, 1))
    tree.take_fixed("base", "imu", HERE)
    assert tree.find("map", "imu", None) == ((3.0, 4.0, 3.0, 0.0, 0.0, 0.0, 1.0), 2 * S)
    assert tree.find("imu", "base", None)[1] == 0
    assert tree.find("imu", "imu", None) == (IDENTITY, 0)


# Facts of tf2's cache_unittest.cpp and simple_tf2_core.cpp.


def test_stamps_out_of_order_are_sorted_in():
    """TimeCache.RepeatabilityReverseInsertOrder."""
    edge = Edge("a", "b")
    for number in reversed(range(100)):
        assert edge.add(number * 1_000_000, (float(number), 0, 0, 0, 0, 0, 1))
    assert [edge.at(number * 1_000_000)[0] for number in range(100)] == list(range(100))


def test_same_stamp_once_more_replaces_it():
    """TimeCache.DuplicateEntries: nothing doubles, and asking at the stamp works."""
    edge = Edge("a", "b")
    for x in (1.0, 2.0, 3.0):
        assert edge.add(S, (x, 0, 0, 0, 0, 0, 1))
    assert (edge.count, edge.at(S)) == (1, (3.0, 0, 0, 0, 0, 0, 1))


def test_no_interpolation_over_a_change_of_parent():
    """TimeCache.ReparentingInterpolationProtection: the time before the change is not made up."""
    tree = FrameTree()
    tree.take("a", "b", S, IDENTITY)
    tree.take("c", "b", 2 * S, HERE)
    assert tree.find("c", "b", 3 * S // 2).lack is Lack.OLD
    assert tree.find("c", "b", 2 * S) == (HERE, 2 * S)
    assert tree.moved == {"b": {"a", "c"}}


def test_slerp_of_a_quarter_turn_is_an_eighth():
    """tf2's bullet quaternion tests: the middle between no rotation and 90° about z is 45°."""
    quarter = (0.0, 0.0, 0.0, *from_rpy(0, 0, math.pi / 2))
    assert between(IDENTITY, quarter, 0.5)[3:] == pytest.approx(from_rpy(0, 0, math.pi / 4))
    negated = (0.0, 0.0, 0.0, *(-each for each in quarter[3:]))
    assert between(IDENTITY, negated, 0.5)[3:] == pytest.approx(from_rpy(0, 0, math.pi / 4))


# What is kept.


def test_ring_keeps_ten_seconds_and_no_more():
    edge = Edge("a", "b")
    for number in range(100 * 60):
        edge.add(number * S // 100, HERE)
    assert edge.newest_ns - edge.oldest_ns == KEPT_NS
    assert len(edge.stamps) <= edge.count + MOST + 1
    assert edge.at(edge.oldest_ns - 1) is Lack.OLD
    assert edge.rate_hz == pytest.approx(100)


def test_ring_keeps_so_many_whatever_their_stamps():
    edge = Edge("a", "b")
    for number in range(5 * MOST):
        edge.add(number, HERE)
    assert edge.count == MOST
    assert len(edge.stamps) <= 2 * MOST + 1


def test_time_set_back_empties_what_moves():
    tree = FrameTree()
    tree.take_fixed("base", "imu", HERE)
    tree.take("odom", "base", 100 * S, HERE)
    tree.take("map", "odom", 100 * S, HERE)
    assert tree.take("odom", "base", 90 * S, IDENTITY)
    assert tree.set_back == 1
    assert tree.edges.keys() == {"imu", "base"}
    assert tree.find("odom", "imu", None) == (HERE, 90 * S)


# What is refused.


@pytest.mark.parametrize(
    ("parent", "child", "numbers"),
    [
        pytest.param("a", "b", (math.nan, 0, 0, 0, 0, 0, 1), id="x is not a number"),
        pytest.param("a", "b", (0, 0, math.inf, 0, 0, 0, 1), id="z is infinite"),
        pytest.param("a", "b", (0, 0, 0, math.nan, 0, 0, 1), id="a rotation is not a number"),
        pytest.param("a", "b", (1e200, 0, 0, 1e200, 0, 0, 1), id="too large"),
        pytest.param("a", "b", (0, 0, 0, 0, 0, 0, 0), id="a rotation of no length"),
        pytest.param("a", "b", (0, 0, 0, 0, 0, 0, 1.1), id="a rotation of another length"),
        pytest.param("a", "a", IDENTITY, id="its own parent"),
        pytest.param("imu", "map", IDENTITY, id="a loop"),
        pytest.param("", "b", IDENTITY, id="no parent"),
        pytest.param("a", "", IDENTITY, id="no child"),
    ],
)
def test_impossible_transform_is_refused_with_its_reason(parent, child, numbers, golden):
    tree = FrameTree()
    tree.take_fixed("map", "base", IDENTITY)
    tree.take("base", "imu", S, IDENTITY)
    before = dict(tree.edges)
    with golden.raises(InvalidTransform) as refused:
        tree.take_fixed(parent, child, numbers)
    with pytest.raises(InvalidTransform, match=f"^{re.escape(str(refused.value))}$"):
        tree.take(parent, child, S, numbers)
    assert tree.edges == before


def test_a_nearly_unit_quaternion_is_made_one():
    tree = FrameTree()
    tree.take_fixed("a", "b", (0, 0, 0, 0, 0, 0, 1.004))
    assert tree.find("a", "b", None)[0] == IDENTITY


def test_a_tree_holds_so_many_frames():
    tree = FrameTree()
    for number in range(MOST_FRAMES):
        tree.take_fixed("map", f"f{number}", IDENTITY)
    with pytest.raises(InvalidTransform, match=f" {MOST_FRAMES} "):
        tree.take_fixed("map", "one_more", IDENTITY)
    tree.take_fixed("map", "f1", HERE)


# What is missing, in words.


@pytest.fixture
def tree():
    tree = FrameTree()
    for number in range(50):
        tree.take("odom", "base_link", 20 * S + number * 20_000_000, IDENTITY)
    tree.take_fixed("map", "goal", IDENTITY)
    return tree


@pytest.mark.parametrize(
    ("target", "source", "stamp", "kind"),
    [
        ("odom", "base_lnk", None, UnknownFrame),
        ("map", "base_link", None, FramesNotConnected),
        ("odom", "base_link", 10 * S, TransformTooOld),
        ("base_link", "odom", 20 * S + 992_000_000, TransformNotThere),
    ],
)
def test_each_gap_says_what_to_do(tree, target, source, stamp, kind, golden):
    gap = tree.find(target, source, stamp)
    error = tree.error(gap, (target, source), "/odometry")
    assert type(error) is kind
    golden(str(error))
    assert gap.is_hopeless is (kind is TransformTooOld)


def test_an_empty_tree_says_what_to_start(golden):
    empty = FrameTree()
    error = empty.error(empty.find("a", "b", None), ("a", "b"))
    golden(str(error))


def test_an_edge_emptied_meanwhile_is_an_error_too(tree):
    gap = tree.find("odom", "base_link", 30 * S)
    assert isinstance(gap, Gap)
    tree.forget_moving()
    assert type(tree.error(gap, ("odom", "base_link"))) is TransformError
