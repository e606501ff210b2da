"""Robot: links that hang on each other by joints, and the motion of each joint at a position. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from busflow.frames.rigid import Rigid, Vector, about, multiply


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


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint between two links."""

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
        own = self.multiplier * position + self.offset
        if self.kind is JointKind.PRISMATIC:
            x, y, z = self.axis
            return multiply(self.origin, (own * x, own * y, own * z, 0.0, 0.0, 0.0, 1.0))
        return multiply(self.origin, (0.0, 0.0, 0.0, *about(self.axis, own)))


@dataclass(frozen=True, slots=True)
class Robot:
    """A tree of links."""

    name: str
    root: str
    """The link that hangs on no other."""
    joints: tuple[Joint, ...]
    text: str
    """The file that describes it."""
