"""SeenFrames: the frames that a client has seen on a run's topics or in a recording, and what is wrong with them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import TYPE_CHECKING

from busflow.clock import nanoseconds_of
from busflow.errors import InvalidTransform, Problem, Severity
from busflow.frames.shared import edge_of, numbers_of
from busflow.frames.tree import FrameTree
from busflow.text import counted, printable

if TYPE_CHECKING:
    from busflow.msgs.tf2_msgs import TFMessage

_MOST = 1000
"""The most frames and publishers of which something is kept beside the tree."""


@dataclass(slots=True)
class SeenEdge:
    """The account of one frame's transforms."""

    publishers: dict[str, None] = field(default_factory=dict[str, None])
    """The nodes that have published it, or may have, in the order in which they came."""
    one_of: bool = False
    """Whether it is only known that one of them has published it."""
    count: int = 0
    delay_ns: int = 0
    """The sum of the times from the stamp to the publication."""
    longest_ns: float = -inf

    @property
    def by(self) -> str:
        """The publishers, for people."""
        return shown_publishers(self.publishers, one_of=self.one_of)


class SeenFrames:
    """A tree of frames with the publishers of each edge."""

    def __init__(self) -> None:
        self.tree: FrameTree = FrameTree()
        self.edges: dict[str, SeenEdge] = {}
        """By child frame."""
        self._refused: dict[tuple[str, str], str] = {}

    def add(self, message: TFMessage, publishers: Sequence[str], published_ns: int, *, fixed: bool) -> None:
        """Take in a message with the time of its publication, and its publisher.

        That is one node in a run, and in a recording those of which one has published it; none where it is not known.
        """
        one_of = len(publishers) > 1
        for each in message.transforms:
            parent, child = edge_of(each)
            stamp_ns = nanoseconds_of(each.header.stamp)
            try:
                if fixed:
                    self.tree.take_fixed(parent, child, numbers_of(each))
                else:
                    self.tree.take(parent, child, stamp_ns, numbers_of(each))
            except InvalidTransform as error:
                if len(self._refused) < _MOST:
                    self._refused.setdefault((shown_publishers(publishers, one_of=one_of), child), str(error))
                continue
            seen = self.edges.setdefault(child, SeenEdge())
            seen.count += 1
            seen.one_of = seen.one_of or one_of
            if len(seen.publishers) < _MOST:
                seen.publishers |= dict.fromkeys(publishers)
            if not fixed:
                delay_ns = published_ns - stamp_ns
                seen.delay_ns += delay_ns
                seen.longest_ns = max(seen.longest_ns, delay_ns)

    def problems(self) -> list[Problem]:
        """Return what is wrong with the frames, each with the nodes and what to do."""
        return [*self._invalid(), *self._parents(), *self._publishers(), *self._time()]

    def _invalid(self) -> Iterator[Problem]:
        for (publisher, _), reason in self._refused.items():
            text = f"{publisher or 'an unknown node'} publishes an invalid transform: {reason}"
            yield Problem("invalid-transform", text, "correct it there; every receiver leaves it out")

    def _parents(self) -> Iterator[Problem]:
        for child, parents in self.tree.moved.items():
            by = self.edges[child].by or "unknown nodes"
            text = f"the frame {printable(child)} has had the parents {' and '.join(map(printable, sorted(parents)))}"
            yield Problem("two-parents", f"{text}, by {by}", "let one node publish one of them; a frame has one way up")

    def _publishers(self) -> Iterator[Problem]:
        for child, seen in self.edges.items():
            has_one_parent = child in self.tree.edges and child not in self.tree.moved
            if has_one_parent and len(seen.publishers) > 1 and not seen.one_of:
                edge = f"{printable(self.tree.edges[child].parent)} → {printable(child)}"
                text = f"{counted(len(seen.publishers), 'node')} publish {edge}: {seen.by}"
                fix = "stop all but one: receivers jump between them"
                yield Problem("two-publishers", text, fix, severity=Severity.WARNING)

    def _time(self) -> Iterator[Problem]:
        if self.tree.set_back:
            text = f"the stamps of transforms were set back {counted(self.tree.set_back, 'time')}"
            fix = "expected where a bag plays again; else look for a node with another clock: busflow tf monitor"
            yield Problem("time-set-back", text, fix, severity=Severity.WARNING)


def shown_publishers(publishers: Iterable[str], *, one_of: bool) -> str:
    """Return the publishers of an edge for people; with `one_of` only one of them has published it."""
    return f"{'one of ' if one_of else ''}{', '.join(publishers)}"
