"""`moving`: each stamped type in another frame, against matrices."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow import Message, take
from busflow.errors import InvalidTransform
from busflow.frames.moving import moved, rotation_matrix, stamp_and_frame
from busflow.frames.rigid import from_rpy
from busflow.interfaces.field_types import float64
from busflow.msgs.geometry_msgs import (
    Accel,
    AccelStamped,
    AccelWithCovariance,
    AccelWithCovarianceStamped,
    Inertia,
    InertiaStamped,
    Point,
    Point32,
    PointStamped,
    Polygon,
    PolygonStamped,
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    QuaternionStamped,
    TransformStamped,
    Twist,
    TwistStamped,
    TwistWithCovariance,
    TwistWithCovarianceStamped,
    Vector3,
    Vector3Stamped,
    VelocityStamped,
    Wrench,
    WrenchStamped,
)
from busflow.msgs.nav_msgs import Odometry
from busflow.msgs.sensor_msgs import BatteryState, Imu, LaserScan, PointCloud2, PointField
from busflow.msgs.std_msgs import Header

THERE = (1.0, 2.0, 3.0, *from_rpy(0.3, -0.4, 1.2))
"""The motion that takes coordinates of `sensor` to `map`."""
TURN = np.array(rotation_matrix(THERE[3:]))
HEADER = Header(frame_id="sensor")
POSE = Pose(position=Point(x=4.0, y=5.0, z=6.0), orientation=Quaternion(x=0.0, y=0.0, z=math.sin(0.4), w=math.cos(0.4)))


def there(x, y, z):
    return pytest.approx(tuple(TURN @ (x, y, z) + (1, 2, 3)))


def xyz(value):
    return value.x, value.y, value.z


def check_pose(pose):
    assert xyz(pose.position) == there(4, 5, 6)
    turn = rotation_matrix((pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w))
    assert turn == pytest.approx(TURN @ rotation_matrix(from_rpy(0, 0, 0.8)))


def test_points_turn_and_shift_vectors_only_turn():
    point = moved(PointStamped(header=HEADER, point=Point(x=4.0, y=5.0, z=6.0)), "map", THERE)
    assert (point.header.frame_id, xyz(point.point)) == ("map", there(4, 5, 6))
    vector = moved(Vector3Stamped(header=HEADER, vector=Vector3(x=4.0, y=5.0, z=6.0)), "map", THERE)
    assert xyz(vector.vector) == pytest.approx(tuple(TURN @ (4, 5, 6)))


def test_poses_alone_in_arrays_and_as_rotations():
    check_pose(moved(PoseStamped(header=HEADER, pose=POSE), "map", THERE).pose)
    array = moved(PoseArray(header=HEADER, poses=(POSE, POSE)), "map", THERE)
    assert len(array.poses) == 2
    check_pose(array.poses[1])
    only = moved(QuaternionStamped(header=HEADER, quaternion=POSE.orientation), "map", THERE)
    check_pose(
        POSE.replace(position=Point(**dict(zip("xyz", TURN @ (4, 5, 6) + (1, 2, 3), strict=True)))).replace(
            orientation=only.quaternion
        )
    )


def test_polygon_keeps_its_corners_in_order():
    corners = (Point32(x=4.0, y=5.0, z=6.0), Point32(x=1.0))
    polygon = moved(PolygonStamped(header=HEADER, polygon=Polygon(points=corners)), "map", THERE).polygon
    assert [xyz(each) for each in polygon.points] == [
        pytest.approx(tuple(TURN @ corner + (1, 2, 3)), abs=1e-6) for corner in ((4, 5, 6), (1, 0, 0))
    ]


# Forces, velocities and inertias, against what follows from points and matrices.

numbers = st.floats(-10, 10)
triples = st.tuples(numbers, numbers, numbers)
rigids = st.builds(lambda at, angles: (*at, *from_rpy(*angles)), triples, triples)


def matrices(rigid):
    """The rotation and the translation of a motion, by the formula of textbooks."""
    a, b, c, w = rigid[3:]
    turn = [
        [1 - 2 * (b * b + c * c), 2 * (a * b - c * w), 2 * (a * c + b * w)],
        [2 * (a * b + c * w), 1 - 2 * (a * a + c * c), 2 * (b * c - a * w)],
        [2 * (a * c - b * w), 2 * (b * c + a * w), 1 - 2 * (a * a + b * b)],
    ]
    return np.array(turn), np.array(rigid[:3])


def vector(values):
    return Vector3(x=values[0], y=values[1], z=values[2])


@given(rigids, st.lists(st.tuples(triples, triples), min_size=1, max_size=4))
def test_wrench_is_of_the_forces_about_the_origin(rigid, forces):
    """Some forces, each at a place: the wrench is their sum and their torque about the origin of either frame."""

    def wrench(at, force):
        return Wrench(force=vector(force.sum(0)), torque=vector(np.cross(at, force).sum(0)))

    turn, shift = matrices(rigid)
    at, force = np.array(forces).transpose(1, 0, 2)
    result = moved(WrenchStamped(header=HEADER, wrench=wrench(at, force)), "map", rigid)
    expected = wrench(at @ turn.T + shift, force @ turn.T)
    assert result.header.frame_id == "map"
    assert xyz(result.wrench.force) == pytest.approx(xyz(expected.force), abs=1e-9)
    assert xyz(result.wrench.torque) == pytest.approx(xyz(expected.torque), abs=1e-9)


def inertia(masses, at):
    """The inertia of masses at places: its tensor is about the centre of mass."""
    total, com = masses.sum(), masses @ at / masses.sum()
    from_com = at - com
    tensor = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, from_com, strict=True))
    entries = {f"i{a}{b}": tensor["xyz".index(a)]["xyz".index(b)] for a, b in ("xx", "xy", "xz", "yy", "yz", "zz")}
    return Inertia(m=total, com=vector(com), **entries)


@given(rigids, st.lists(st.tuples(st.floats(0.1, 10), triples), min_size=1, max_size=4))
def test_inertia_is_that_of_the_moved_masses(rigid, parts):
    turn, shift = matrices(rigid)
    masses, at = np.array([mass for mass, _ in parts]), np.array([place for _, place in parts])
    result = moved(InertiaStamped(header=HEADER, inertia=inertia(masses, at)), "map", rigid).inertia
    expected = inertia(masses, at @ turn.T + shift)
    assert xyz(result.com) == pytest.approx(xyz(expected.com), abs=1e-9)
    for name in ("m", "ixx", "ixy", "ixz", "iyy", "iyz", "izz"):
        assert getattr(result, name) == pytest.approx(getattr(expected, name), abs=1e-8)


@given(rigids, triples, triples)
def test_velocity_and_acceleration_only_change_their_axes(rigid, linear, angular):
    turn, _ = matrices(rigid)
    parts = {"linear": vector(linear), "angular": vector(angular)}
    velocity = VelocityStamped(header=HEADER, body_frame_id="arm", reference_frame_id="map", velocity=Twist(**parts))
    result = moved(velocity, "map", rigid)
    assert (result.body_frame_id, result.reference_frame_id) == ("arm", "map")
    for each in (
        result.velocity,
        moved(TwistStamped(header=HEADER, twist=Twist(**parts)), "map", rigid).twist,
        moved(AccelStamped(header=HEADER, accel=Accel(**parts)), "map", rigid).accel,
    ):
        assert xyz(each.linear) == pytest.approx(tuple(turn @ linear), abs=1e-9)
        assert xyz(each.angular) == pytest.approx(tuple(turn @ angular), abs=1e-9)


PARTS = {"linear": Vector3(x=4.0, y=5.0, z=6.0), "angular": Vector3(z=1.0)}
COVARIANCE = np.arange(36.0).reshape(6, 6) + np.arange(36.0).reshape(6, 6).T


@pytest.mark.parametrize(
    ("kind", "field", "uncertain", "value"),
    [
        (PoseWithCovarianceStamped, "pose", PoseWithCovariance, POSE),
        (TwistWithCovarianceStamped, "twist", TwistWithCovariance, Twist(**PARTS)),
        (AccelWithCovarianceStamped, "accel", AccelWithCovariance, Accel(**PARTS)),
    ],
)
def test_covariance_turns_with_the_axes(kind, field, uncertain, value):
    inner = uncertain(**{field: value}, covariance=take(COVARIANCE.reshape(36).copy()))
    result = getattr(moved(kind(header=HEADER, **{field: inner}), "map", THERE), field)
    if field == "pose":
        check_pose(result.pose)
    else:
        assert xyz(getattr(result, field).linear) == pytest.approx(tuple(TURN @ (4, 5, 6)))
        assert xyz(getattr(result, field).angular) == pytest.approx(tuple(TURN @ (0, 0, 1)))
    both = np.zeros((6, 6))
    both[:3, :3] = both[3:, 3:] = TURN
    assert np.asarray(result.covariance).reshape(6, 6) == pytest.approx(both @ COVARIANCE @ both.T)


def cloud(height=2, width=3, kind=PointField.FLOAT32, *, big=False, padding=5):
    """A cloud with a colour before each point, padding behind each row, and points 0, 1, 2, …"""
    letter, size = {PointField.FLOAT32: ("f4", 4), PointField.FLOAT64: ("f8", 8)}[kind]
    step = 4 + 3 * size
    data = np.full(height * (width * step + padding), 7, np.uint8)
    dtype = np.dtype(f"{'>' if big else '<'}{letter}")
    for row in range(height):
        for column in range(width):
            at = row * (width * step + padding) + column * step + 4
            number = 3.0 * (row * width + column)
            data[at : at + 3 * size] = np.frombuffer(
                np.array([number, number + 1, number + 2], dtype).tobytes(), np.uint8
            )
    fields = [PointField(name="rgb", offset=0, datatype=PointField.UINT32, count=1)]
    fields += [PointField(name=name, offset=4 + at * size, datatype=kind, count=1) for at, name in enumerate("xyz")]
    return PointCloud2(
        header=HEADER, height=height, width=width, fields=tuple(fields), is_bigendian=big, point_step=step,
        row_step=width * step + padding, data=take(data),
    )  # fmt: skip


def points(message):
    size = {PointField.FLOAT32: 4, PointField.FLOAT64: 8}[message.fields[1].datatype]
    dtype = np.dtype(f"{'>' if message.is_bigendian else '<'}f{size}")
    raw = np.asarray(message.data).tobytes()
    starts = [
        row * message.row_step + column * message.point_step + 4
        for row in range(message.height)
        for column in range(message.width)
    ]
    return [tuple(np.frombuffer(raw, dtype, 3, start)) for start in starts]


@pytest.mark.parametrize("kind", [PointField.FLOAT32, PointField.FLOAT64])
@pytest.mark.parametrize("big", [False, True])
def test_every_point_of_a_cloud_moves(kind, big):
    before = cloud(kind=kind, big=big)
    after = moved(before, "map", THERE)
    assert points(after) == [pytest.approx(tuple(TURN @ point + (1, 2, 3)), rel=1e-5) for point in points(before)]
    rest = np.ones(before.data.size, bool)
    for row in range(2):
        for column in range(3):
            at = row * before.row_step + column * before.point_step + 4
            rest[at : at + before.point_step - 4] = False
    assert (np.asarray(after.data)[rest] == 7).all()
    assert points(before)[1] == (3, 4, 5)


@pytest.mark.parametrize(
    "message",
    [
        pytest.param(cloud().replace(fields=cloud().fields[:3]), id="no z"),
        pytest.param(cloud().replace(fields=(PointField(name="x", datatype=PointField.INT32),)), id="x is an integer"),
        pytest.param(cloud().replace(height=3), id="too few bytes"),
        pytest.param(cloud().replace(point_step=4_000_000_000, row_step=4_000_000_000), id="huge steps"),
        pytest.param(BatteryState(header=HEADER), id="BatteryState"),
        pytest.param(TransformStamped(header=HEADER), id="TransformStamped"),
        pytest.param(Odometry(header=HEADER), id="Odometry"),
        pytest.param(Imu(header=HEADER), id="Imu"),
        pytest.param(LaserScan(header=HEADER), id="LaserScan"),
    ],
)
def test_what_cannot_be_moved_says_why(message, golden):
    with golden.raises(InvalidTransform):
        moved(message, "map", THERE)


def test_an_empty_cloud_stays_empty():
    assert moved(cloud(0, 0).replace(width=5), "map", THERE).header.frame_id == "map"


def test_class_of_a_definition_file_moves_too():
    point = type("Point", (Message,), {"__annotations__": dict.fromkeys("xyz", float64)}, package="geometry_msgs")
    fields = {"header": Header, "point": point}
    stamped = type("PointStamped", (Message,), {"__annotations__": fields}, package="geometry_msgs")
    message = stamped(header=HEADER, point=point(x=4.0, y=5.0, z=6.0))
    result = moved(message, "map", THERE)
    assert type(result) is stamped
    assert xyz(result.point) == there(4, 5, 6)


def test_a_message_without_header_has_no_frame():
    with pytest.raises(InvalidTransform, match="Twist"):
        stamp_and_frame(Twist())
