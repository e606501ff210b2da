"""Moves stamped messages from their frame to another. Pure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, TypeAlias, TypeVar, cast

import numpy as np

from busflow.clock import nanoseconds_of
from busflow.errors import InvalidTransform
from busflow.frames.rigid import Rigid, Rotation, Vector, multiply, rotate
from busflow.interfaces.message import take, type_name
from busflow.msgs.geometry_msgs import (
    Point,
    Point32,
    PointStamped,
    PolygonStamped,
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    QuaternionStamped,
    Vector3,
    Vector3Stamped,
)
from busflow.msgs.sensor_msgs import PointCloud2, PointField
from busflow.text import printable

Stamped: TypeAlias = (
    PointStamped
    | Vector3Stamped
    | QuaternionStamped
    | PoseStamped
    | PoseWithCovarianceStamped
    | PoseArray
    | PolygonStamped
    | PointCloud2
)
"""The types that can be moved."""
S = TypeVar("S", bound=Stamped)
_FLOATS: Mapping[int, str] = {PointField.FLOAT32: "f4", PointField.FLOAT64: "f8"}


def moved(message: S, target: str, rigid: Rigid) -> S:
    """Return a message in another frame, given the motion that takes coordinates of its own frame there.

    Raises:
        InvalidTransform: there is no meaning to moving a message of this type, or a cloud has no x, y and z.
    """
    move = _MOVES.get(type(message))
    if move is None:
        known = ", ".join(sorted(each.__name__ for each in _MOVES))
        raise InvalidTransform(f"a {type_name(type(message))} cannot be taken to another frame; these can: {known}")
    header = message.header.replace(frame_id=target)
    return cast("S", move(message, rigid).replace(header=header))


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


def _vector(rigid: Rigid, vector: Vector) -> Vector:
    return rotate(rigid[3:], vector)


def _point(rigid: Rigid, point: Vector) -> Vector:
    x, y, z = rotate(rigid[3:], point)
    return (x + rigid[0], y + rigid[1], z + rigid[2])


def _pose(rigid: Rigid, pose: Pose) -> Pose:
    at, turn = pose.position, pose.orientation
    x, y, z, qx, qy, qz, qw = multiply(rigid, (at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w))
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))


def _point_stamped(message: PointStamped, rigid: Rigid) -> PointStamped:
    x, y, z = _point(rigid, (message.point.x, message.point.y, message.point.z))
    return message.replace(point=Point(x=x, y=y, z=z))


def _vector_stamped(message: Vector3Stamped, rigid: Rigid) -> Vector3Stamped:
    x, y, z = _vector(rigid, (message.vector.x, message.vector.y, message.vector.z))
    return message.replace(vector=Vector3(x=x, y=y, z=z))


def _quaternion_stamped(message: QuaternionStamped, rigid: Rigid) -> QuaternionStamped:
    return message.replace(quaternion=_pose(rigid, Pose(orientation=message.quaternion)).orientation)


def _pose_stamped(message: PoseStamped, rigid: Rigid) -> PoseStamped:
    return message.replace(pose=_pose(rigid, message.pose))


def _pose_with_covariance(message: PoseWithCovarianceStamped, rigid: Rigid) -> PoseWithCovarianceStamped:
    """Move the pose, and turn both its covariances, of the position and of the rotation, with the axes."""
    turn = np.kron(np.eye(2), rotation_matrix(rigid[3:]))
    covariance = turn @ np.asarray(message.pose.covariance).reshape(6, 6) @ turn.T
    pose = message.pose.replace(pose=_pose(rigid, message.pose.pose), covariance=take(covariance.reshape(36)))
    return message.replace(pose=pose)


def _pose_array(message: PoseArray, rigid: Rigid) -> PoseArray:
    return message.replace(poses=tuple(map(partial(_pose, rigid), message.poses)))


def _polygon(message: PolygonStamped, rigid: Rigid) -> PolygonStamped:
    points = (_point(rigid, (each.x, each.y, each.z)) for each in message.polygon.points)
    moved_points = tuple(Point32(x=x, y=y, z=z) for x, y, z in points)
    return message.replace(polygon=message.polygon.replace(points=moved_points))


def _cloud(message: PointCloud2, rigid: Rigid) -> PointCloud2:
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
    kind = _FLOATS.get(field.datatype) if field is not None else None
    if field is None or kind is None:
        raise InvalidTransform(
            f"a cloud needs x, y and z as FLOAT32 or FLOAT64 to be moved; this one has no such {name}"
        )
    dtype = np.dtype(f"{'>' if message.is_bigendian else '<'}{kind}")
    last = (message.height - 1) * message.row_step + (message.width - 1) * message.point_step + field.offset
    if message.height * message.width and last + dtype.itemsize > data.size:
        raise InvalidTransform(
            f"a cloud of {message.height} × {message.width} points has only {data.size} bytes of data"
        )
    shape, strides = (message.height, message.width), (message.row_step, message.point_step)
    if not message.height * message.width:
        return np.empty((0,), dtype)
    return np.ndarray(shape, dtype, data, field.offset, strides)


_MOVES: Mapping[type, Callable[[Any, Rigid], Any]] = {
    PointStamped: _point_stamped,
    Vector3Stamped: _vector_stamped,
    QuaternionStamped: _quaternion_stamped,
    PoseStamped: _pose_stamped,
    PoseWithCovarianceStamped: _pose_with_covariance,
    PoseArray: _pose_array,
    PolygonStamped: _polygon,
    PointCloud2: _cloud,
}
