"""Rigid motions: a translation and a rotation in one tuple of seven numbers; composed, inverted, interpolated. Pure."""

from __future__ import annotations

from math import acos, cos, isfinite, sin, sqrt
from typing import TypeAlias

Rigid: TypeAlias = tuple[float, float, float, float, float, float, float]
"""Translation x, y, z, then the unit quaternion x, y, z, w."""
Vector: TypeAlias = tuple[float, float, float]
Rotation: TypeAlias = tuple[float, float, float, float]
"""A quaternion x, y, z, w."""

IDENTITY: Rigid = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
TOLERANCE = 0.01
"""The most by which the squared length of a quaternion may differ from 1, as in tf2."""
_SMALL = 1e-12
"""The squared sine below which two rotations are so near that a straight line between them is exact."""


def unit(numbers: Rigid) -> Rigid:
    """Return the motion of these numbers, its quaternion made exactly as long as 1.

    Raises:
        ValueError: They are no motion; the text says why.

    >>> unit((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    Traceback (most recent call last):
    ValueError: its quaternion (0, 0, 0, 0) has the length 0, not 1: no rotation is (0, 0, 0, 1)
    """
    x, y, z, qx, qy, qz, qw = numbers
    squared = qx * qx + qy * qy + qz * qz + qw * qw
    if not -TOLERANCE <= squared - 1.0 <= TOLERANCE or not isfinite(x + y + z):
        raise ValueError(_fault(numbers, squared))
    if squared == 1.0:
        return numbers
    scale = 1.0 / sqrt(squared)
    return (x, y, z, qx * scale, qy * scale, qz * scale, qw * scale)


def _fault(numbers: Rigid, squared: float) -> str:
    if not isfinite(sum(numbers[:3])) or not isfinite(squared):
        return f"it holds a number that is not finite: {numbers}"
    shown = ", ".join(f"{each:g}" for each in numbers[3:])
    return f"its quaternion ({shown}) has the length {sqrt(squared):.3g}, not 1: no rotation is (0, 0, 0, 1)"


def multiply(a: Rigid, b: Rigid) -> Rigid:
    """Return the motion that does `b` first, then `a`."""
    ax, ay, az, px, py, pz, pw = a
    bx, by, bz, qx, qy, qz, qw = b
    # Twice the cross product of the rotation's vector with b's translation, and from it the rotated translation.
    tx, ty, tz = 2.0 * (py * bz - pz * by), 2.0 * (pz * bx - px * bz), 2.0 * (px * by - py * bx)
    return (
        ax + bx + pw * tx + py * tz - pz * ty,
        ay + by + pw * ty + pz * tx - px * tz,
        az + bz + pw * tz + px * ty - py * tx,
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
        pw * qw - px * qx - py * qy - pz * qz,
    )


def inverse(a: Rigid) -> Rigid:
    """Return the motion that undoes another."""
    x, y, z, qx, qy, qz, qw = a
    back = rotate((-qx, -qy, -qz, qw), (-x, -y, -z))
    return (*back, -qx, -qy, -qz, qw)


def rotate(rotation: Rotation, vector: Vector) -> Vector:
    """Return a rotated vector."""
    qx, qy, qz, qw = rotation
    x, y, z = vector
    tx, ty, tz = 2.0 * (qy * z - qz * y), 2.0 * (qz * x - qx * z), 2.0 * (qx * y - qy * x)
    return (x + qw * tx + qy * tz - qz * ty, y + qw * ty + qz * tx - qx * tz, z + qw * tz + qx * ty - qy * tx)


def between(a: Rigid, b: Rigid, share: float) -> Rigid:
    """Return the motion that lies a share of the way from `a` to `b`: on a line, and on the shortest arc."""
    ax, ay, az, px, py, pz, pw = a
    bx, by, bz, qx, qy, qz, qw = b
    rest = 1.0 - share
    dot = px * qx + py * qy + pz * qz + pw * qw
    if dot < 0.0:  # q and -q are one rotation: take the nearer
        dot, qx, qy, qz, qw = -dot, -qx, -qy, -qz, -qw
    squared_sine = (1.0 - dot) * (1.0 + dot)  # 1 - dot * dot would lose its digits where the two are near
    near, far = rest, share
    if squared_sine > _SMALL:
        angle, scale = acos(dot), 1.0 / sqrt(squared_sine)
        near, far = sin(rest * angle) * scale, sin(share * angle) * scale
    return (
        rest * ax + share * bx,
        rest * ay + share * by,
        rest * az + share * bz,
        near * px + far * qx,
        near * py + far * qy,
        near * pz + far * qz,
        near * pw + far * qw,
    )


def from_rpy(roll: float, pitch: float, yaw: float) -> Rotation:
    """Return the rotation by angles about the fixed axes x, y and z, in this order, as URDF states them."""
    cr, sr = cos(roll / 2), sin(roll / 2)
    cp, sp = cos(pitch / 2), sin(pitch / 2)
    cy, sy = cos(yaw / 2), sin(yaw / 2)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )
