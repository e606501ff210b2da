"""Edge: one child frame below its parent, with its last transforms in the order of their stamps. Pure."""

from __future__ import annotations

from bisect import bisect_left
from enum import Enum, auto

from busflow.clock import NS_PER_S
from busflow.frames.rigid import Rigid, between

KEPT_NS = 10 * NS_PER_S
"""How far back an edge knows its transforms, from its newest."""
MOST = 2000
"""How many transforms an edge keeps, whatever their stamps."""
_DISORDER_NS = NS_PER_S
"""How much older than the newest a transform may be and still only be late; beyond, time was set back."""


class Lack(Enum):
    """Why there is no transform."""

    UNKNOWN = auto()
    """No edge names the frame."""
    APART = auto()
    """The frames are in two trees."""
    OLD = auto()
    """The time is before the transforms that an edge keeps."""
    EARLY = auto()
    """The time is after the transforms that have come."""


class Edge:
    """A child frame below its parent: a transform for ever, or one for each stamp."""

    __slots__ = ("_first", "child", "fixed", "parent", "rigids", "stamps")

    def __init__(self, parent: str, child: str, fixed: Rigid | None = None) -> None:
        """Create an edge; with `fixed` it has this transform at all times."""
        self.parent: str = parent
        self.child: str = child
        self.fixed: Rigid | None = fixed
        self.stamps: list[int] = []
        """Stamps in ns, ascending; those before `_first` are given up and cleared now and then."""
        self.rigids: list[Rigid] = []
        self._first = 0

    def add(self, stamp_ns: int, rigid: Rigid) -> bool:
        """Keep a transform; return False if its stamp is so old that time was set back, and nothing is kept."""
        stamps, rigids = self.stamps, self.rigids
        if not stamps or stamp_ns > stamps[-1]:
            stamps.append(stamp_ns)
            rigids.append(rigid)
        elif stamp_ns < stamps[-1] - _DISORDER_NS:
            return False
        else:
            at = bisect_left(stamps, stamp_ns, self._first)
            if at < len(stamps) and stamps[at] == stamp_ns:
                rigids[at] = rigid  # the same stamp once more: the last word counts
            else:
                stamps.insert(at, stamp_ns)
                rigids.insert(at, rigid)
        self._give_up_old()
        return True

    def _give_up_old(self) -> None:
        """Leave what is too old or too much behind `_first`, and free it in larger pieces."""
        stamps, first = self.stamps, self._first
        oldest = stamps[-1] - KEPT_NS
        while stamps[first] < oldest or len(stamps) - first > MOST:
            first += 1
        if first > MOST:
            del stamps[:first], self.rigids[:first]
            first = 0
        self._first = first

    @property
    def count(self) -> int:
        """The number of transforms that it keeps."""
        return len(self.stamps) - self._first

    @property
    def oldest_ns(self) -> int | None:
        """The stamp of its oldest transform."""
        return self.stamps[self._first] if self.stamps else None

    @property
    def newest_ns(self) -> int | None:
        """The stamp of its newest transform."""
        return self.stamps[-1] if self.stamps else None

    @property
    def rate_hz(self) -> float | None:
        """How often it gets a transform, by the stamps of those that it keeps."""
        count = self.count
        span_ns = self.stamps[-1] - self.stamps[self._first] if count > 1 else 0
        return (count - 1) * NS_PER_S / span_ns if span_ns else None

    def at(self, stamp_ns: int) -> Rigid | Lack:
        """Return its transform at a time: stated, or interpolated between the two around it."""
        if self.fixed is not None:
            return self.fixed
        stamps, rigids = self.stamps, self.rigids
        index = bisect_left(stamps, stamp_ns, self._first)
        if index == len(stamps):
            return Lack.EARLY
        after = stamps[index]
        if after == stamp_ns:
            return rigids[index]
        if index == self._first:
            return Lack.OLD
        before = stamps[index - 1]
        return between(rigids[index - 1], rigids[index], (stamp_ns - before) / (after - before))
