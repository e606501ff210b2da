"""Robot: links that hang on each other by joints, and the motion of each joint at a position. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from math import cos, sin

from busflow.errors import Problem
from busflow.frames.rigid import Rigid, Rotation, Vector, multiply, rotate


class JointKind(StrEnum):
    """How a joint lets its child move."""

    FIXED = "fixed"
    REVOLUTE = "revolute"
    CONTINUOUS = "continuous"
    PRISMATIC = "prismatic"
    FLOATING = "floating"
    PLANAR = "planar"


TURNS = frozenset({JointKind.REVOLUTE, JointKind.CONTINUOUS})
MOVES = TURNS | {JointKind.PRISMATIC}
"""The kinds that one position describes."""


@dataclass(frozen=True)
class Joint:
    """A joint between two links, of which the child slides or turns as its position says."""

    name: str
    kind: JointKind
    parent: str
    """The link that it hangs on."""
    child: str
    """The link that hangs on it."""
    origin: Rigid
    """The joint's place seen from the parent, and the child's place at position 0."""
    axis: Vector = (1.0, 0.0, 0.0)
    """Of length 1; it turns about this axis, or slides along it."""
    source: str = ""
    """The joint whose position decides: itself, unless it mimics another one."""
    multiplier: float = 1.0
    offset: float = 0.0
    """Its position is the source's times `multiplier`, and `offset` more."""

    def motion(self, position: float) -> Rigid:
        """Return the child's place seen from the parent at a position of the source, in rad or m.

        >>> slide = Joint("lift", JointKind.PRISMATIC, "base", "tray", (0, 0, 1, 0, 0, 0, 1), axis=(0, 0, 1))
        >>> slide.motion(0.25)[:3]
        (0.0, 0.0, 1.25)
        """
        if self.kind is JointKind.PRISMATIC:
            return (*self.translation(position), *self.origin[3:])
        return (*self.origin[:3], *self.rotation(position))

    def translation(self, position: float) -> Vector:
        """Return where the child's origin is at a position of the source, for a joint that slides."""
        own = self.multiplier * position + self.offset
        x, y, z, *_ = self.origin
        ax, ay, az = self._axis_from_parent
        return (x + own * ax, y + own * ay, z + own * az)

    def rotation(self, position: float) -> Rotation:
        """Return how the child is turned at a position of the source, for a joint that turns."""
        half = (self.multiplier * position + self.offset) / 2
        rest, turned = cos(half), sin(half)  # the shares of the rotations at 0 and at half a turn
        _, _, _, x, y, z, w = self.origin
        hx, hy, hz, hw = self._half_turn
        return (rest * x + turned * hx, rest * y + turned * hy, rest * z + turned * hz, rest * w + turned * hw)

    @cached_property
    def _axis_from_parent(self) -> Vector:
        return rotate(self.origin[3:], self.axis)

    @cached_property
    def _half_turn(self) -> Rotation:
        return multiply(self.origin, (0.0, 0.0, 0.0, *self.axis, 0.0))[3:]


@dataclass(frozen=True, slots=True)
class Robot:
    """A tree of links."""

    name: str
    root: str
    """The link that hangs on no other."""
    joints: tuple[Joint, ...]
    text: str
    """The file that describes it."""
    doubts: tuple[Problem, ...] = ()
    """Warnings of the file; where the links are does not depend on them."""
