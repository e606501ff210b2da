"""Moves stamped messages from their frame to another. Pure.

A point turns and shifts, a vector only turns; each type moves as what it is made of. Types are known by their names, so
that none is imported before a message of it comes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, cast

import numpy as np

from busflow.clock import nanoseconds_of
from busflow.errors import InvalidTransform
from busflow.frames.rigid import Rigid, Rotation, multiply, rotate
from busflow.interfaces.message import take, type_name
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.msgs.geometry_msgs import (
        AccelStamped,
        AccelWithCovarianceStamped,
        InertiaStamped,
        PointStamped,
        PolygonStamped,
        PoseArray,
        PoseStamped,
        PoseWithCovarianceStamped,
        QuaternionStamped,
        TwistStamped,
        TwistWithCovarianceStamped,
        Vector3Stamped,
        VelocityStamped,
        WrenchStamped,
    )
    from busflow.msgs.sensor_msgs import PointCloud2

    Stamped: TypeAlias = (
        PointStamped
        | Vector3Stamped
        | QuaternionStamped
        | PoseStamped
        | PoseWithCovarianceStamped
        | PoseArray
        | PolygonStamped
        | PointCloud2
        | WrenchStamped
        | TwistStamped
        | TwistWithCovarianceStamped
        | VelocityStamped
        | AccelStamped
        | AccelWithCovarianceStamped
        | InertiaStamped
    )
    """The types that can be moved."""

S = TypeVar("S", bound="Stamped")
_Move: TypeAlias = Callable[[Rigid, Any], Any]
"""Returns a value of another frame, given the motion that takes coordinates of its own frame there."""


def moved(message: S, target: str, rigid: Rigid) -> S:
    """Return a message in another frame, given the motion that takes coordinates of its own frame there.

    Raises:
        InvalidTransform: there is no meaning to moving a message of this type, or a cloud has no x, y and z.
    """
    name = type_name(type(message))
    move = _MOVES.get(name)
    if move is None:
        known = ", ".join(sorted(each.rpartition("/")[2] for each in _MOVES))
        reason = _REASONS.get(name, f"these can: {known}")
        raise InvalidTransform(f"a {name} cannot be taken to another frame; {reason}")
    return cast("S", move(rigid, message).replace(header=message.header.replace(frame_id=target)))


def stamp_and_frame(message: Stamped) -> tuple[int, str]:
    """Return a message's time in ns, and its frame.

    Raises:
        InvalidTransform: it has no header.
    """
    header: Any = getattr(message, "header", None)
    if header is None:
        raise InvalidTransform(f"{printable(type(message).__name__)} has no header, which says its frame and time")
    return nanoseconds_of(header.stamp), header.frame_id


def rotation_matrix(rotation: Rotation) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the matrix of a rotation: its columns are the rotated axes."""
    return np.array([rotate(rotation, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]).T


# What messages are made of.


def _vector(rigid: Rigid, vector: Any) -> Any:
    x, y, z = rotate(rigid[3:], (vector.x, vector.y, vector.z))
    return vector.replace(x=x, y=y, z=z)


def _point(rigid: Rigid, point: Any) -> Any:
    x, y, z = rotate(rigid[3:], (point.x, point.y, point.z))
    return point.replace(x=x + rigid[0], y=y + rigid[1], z=z + rigid[2])


def _quaternion(rigid: Rigid, turn: Any) -> Any:
    _, _, _, x, y, z, w = multiply(rigid, (0.0, 0.0, 0.0, turn.x, turn.y, turn.z, turn.w))
    return turn.replace(x=x, y=y, z=z, w=w)


def _pose(rigid: Rigid, pose: Any) -> Any:
    return pose.replace(position=_point(rigid, pose.position), orientation=_quaternion(rigid, pose.orientation))


def _motion(rigid: Rigid, motion: Any) -> Any:
    """Return a velocity or an acceleration along other axes; it stays that of the same point of the body.

    This is the convention of `geometry_msgs/msg/VelocityStamped`, and KDL's `Rotation * Twist`. Which point of the body
    it is, a message without `body_frame_id` does not say (ros2/common_interfaces#228), so it cannot be exchanged.
    """
    return motion.replace(linear=_vector(rigid, motion.linear), angular=_vector(rigid, motion.angular))


def _wrench(rigid: Rigid, wrench: Any) -> Any:
    """Return a force and a torque about the origin of the other frame, as tf2 does since ros2/geometry2#538.

    The force has a lever there: the translation.
    """
    force, torque = _vector(rigid, wrench.force), _vector(rigid, wrench.torque)
    x, y, z, *_ = rigid
    lever = torque.replace(
        x=torque.x + y * force.z - z * force.y,
        y=torque.y + z * force.x - x * force.z,
        z=torque.z + x * force.y - y * force.x,
    )
    return wrench.replace(force=force, torque=lever)


def _inertia(rigid: Rigid, inertia: Any) -> Any:
    """Return an inertia with its centre of mass there; the tensor is about that centre, and so it only turns."""
    xx, xy, xz, yy, yz, zz = (getattr(inertia, f"i{axes}") for axes in ("xx", "xy", "xz", "yy", "yz", "zz"))
    turn = rotation_matrix(rigid[3:])
    tensor = (turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T).tolist()
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = tensor
    return inertia.replace(com=_point(rigid, inertia.com), ixx=xx, ixy=xy, ixz=xz, iyy=yy, iyz=yz, izz=zz)


def _each(move: _Move) -> _Move:
    """Return what moves each of several values."""
    return lambda rigid, values: tuple(move(rigid, each) for each in values)


def _field(name: str, move: _Move) -> _Move:
    """Return what moves one field of a message."""
    return lambda rigid, message: message.replace(**{name: move(rigid, getattr(message, name))})


def _uncertain(name: str, move: _Move) -> _Move:
    """Return what moves one field, and turns its covariance: six by six, of what is along the axes and about them."""
    move_field = _field(name, move)

    def move_both(rigid: Rigid, message: Any) -> Any:
        turn = np.kron(np.eye(2), rotation_matrix(rigid[3:]))
        covariance = turn @ np.asarray(message.covariance).reshape(6, 6) @ turn.T
        return move_field(rigid, message).replace(covariance=take(covariance.reshape(36)))

    return move_both


def _cloud(rigid: Rigid, message: PointCloud2) -> PointCloud2:
    """Move the points of a cloud in one product; its other values stay as they are."""
    data = np.array(message.data, dtype=np.uint8)
    axes = [_axis(message, data, name) for name in "xyz"]
    points = np.stack([axis.reshape(-1).astype(np.float64) for axis in axes])
    there = rotation_matrix(rigid[3:]) @ points + np.array(rigid[:3])[:, np.newaxis]
    for axis, values in zip(axes, there, strict=True):
        axis[...] = values.reshape(axis.shape)
    return message.replace(data=take(data))


def _axis(message: PointCloud2, data: np.ndarray[Any, Any], name: str) -> np.ndarray[Any, Any]:
    """Return a view of one coordinate of all points."""
    field = next((each for each in message.fields if each.name == name), None)
    kind = {field.FLOAT32: "f4", field.FLOAT64: "f8"}.get(field.datatype) if field is not None else None
    if field is None or kind is None:
        raise InvalidTransform(
            f"a cloud needs x, y and z as FLOAT32 or FLOAT64 to be moved; this one has no such {name}"
        )
    dtype = np.dtype(f"{'>' if message.is_bigendian else '<'}{kind}")
    if not message.height * message.width:
        return np.empty((0,), dtype)
    last = (message.height - 1) * message.row_step + (message.width - 1) * message.point_step + field.offset
    if last + dtype.itemsize > data.size:
        raise InvalidTransform(
            f"a cloud of {message.height} × {message.width} points has only {data.size} bytes of data"
        )
    shape, strides = (message.height, message.width), (message.row_step, message.point_step)
    return np.ndarray(shape, dtype, data, field.offset, strides)


_MOVES: Mapping[str, _Move] = {
    "geometry_msgs/msg/PointStamped": _field("point", _point),
    "geometry_msgs/msg/Vector3Stamped": _field("vector", _vector),
    "geometry_msgs/msg/QuaternionStamped": _field("quaternion", _quaternion),
    "geometry_msgs/msg/PoseStamped": _field("pose", _pose),
    "geometry_msgs/msg/PoseWithCovarianceStamped": _field("pose", _uncertain("pose", _pose)),
    "geometry_msgs/msg/PoseArray": _field("poses", _each(_pose)),
    "geometry_msgs/msg/PolygonStamped": _field("polygon", _field("points", _each(_point))),
    "geometry_msgs/msg/WrenchStamped": _field("wrench", _wrench),
    "geometry_msgs/msg/TwistStamped": _field("twist", _motion),
    "geometry_msgs/msg/TwistWithCovarianceStamped": _field("twist", _uncertain("twist", _motion)),
    "geometry_msgs/msg/VelocityStamped": _field("velocity", _motion),
    "geometry_msgs/msg/AccelStamped": _field("accel", _motion),
    "geometry_msgs/msg/AccelWithCovarianceStamped": _field("accel", _uncertain("accel", _motion)),
    "geometry_msgs/msg/InertiaStamped": _field("inertia", _inertia),
    "sensor_msgs/msg/PointCloud2": _cloud,
}
_REASONS: Mapping[str, str] = {
    "geometry_msgs/msg/TransformStamped": "it joins two frames: ask for latest(target, child_frame_id)",
    "nav_msgs/msg/Odometry": "its pose and its velocity are in two frames: take them as PoseStamped and TwistStamped",
    "sensor_msgs/msg/Imu": "its orientation is seen from another frame than its rates: take these as Vector3Stamped",
    "sensor_msgs/msg/LaserScan": "its ranges are along the axes of its own frame: make a PointCloud2 of it",
}
"""What to do in place of moving messages of types that cannot be moved."""
