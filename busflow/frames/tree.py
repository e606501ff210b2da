"""FrameTree: the frames of a robot, with the transforms between them over the last seconds. Pure.

Each frame but a root has one edge to its parent. A transform between two frames is the product along the path over
their common ancestor, at one time for all edges: interpolated where that lies between two stamps, refused beyond.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from busflow.clock import NS_PER_S
from busflow.errors import (
    FramesNotConnected,
    InvalidTransform,
    TransformError,
    TransformNotThere,
    TransformTooOld,
    UnknownFrame,
)
from busflow.frames.edge import KEPT_NS, Edge, Lack
from busflow.frames.rigid import IDENTITY, Rigid, inverse, multiply, unit
from busflow.text import did_you_mean, printable

MOST_FRAMES = 10_000
"""The most edges of a tree: a publisher that invents names must not take all memory."""
_NONE_YET = "no transform has come yet: start what publishes them, or state fixed ones in the launch file under frames:"


@dataclass(frozen=True, slots=True)
class Gap:
    """What is missing for a transform."""

    lack: Lack
    frames: tuple[str, str]
    """The unknown frame twice, both roots, or the parent and child of the edge without a transform at that time."""
    stamp_ns: int
    """The time that was asked for."""

    @property
    def is_hopeless(self) -> bool:
        """Whether no later transform can fill it."""
        return self.lack is Lack.OLD

    @property
    def child(self) -> str:
        """The child of the edge whose next transform may fill it; empty where a new edge must."""
        return self.frames[1] if self.lack is Lack.EARLY else ""


class FrameTree:
    """The frames of one robot, or of several that share a topic."""

    def __init__(self) -> None:
        self.edges: dict[str, Edge] = {}
        """The edges by child."""
        self.set_back: int = 0
        """How often the time was set back, as by a bag that plays again, and the moving edges were emptied."""
        self.moved: dict[str, set[str]] = {}
        """Frames that were given another parent, with all parents they had."""
        self._paths: dict[tuple[str, str], tuple[tuple[Edge, ...], tuple[Edge, ...]]] = {}

    # Taking in.

    def take(self, parent: str, child: str, stamp_ns: int, numbers: Rigid) -> bool:
        """Take in the transform of a moving edge; return whether the edge is new.

        Raises:
            InvalidTransform: it cannot be part of the tree.
        """
        rigid, edge = _motion(parent, child, numbers), self.edges.get(child)
        is_new = edge is None or edge.parent != parent or edge.fixed is not None
        if edge is None or is_new:
            edge = self._place(Edge(parent, child))
        if not edge.add(stamp_ns, rigid):
            self.forget_moving()
            self.set_back += 1
            is_new, edge = True, self._place(Edge(parent, child))
            edge.add(stamp_ns, rigid)
        return is_new

    def take_fixed(self, parent: str, child: str, numbers: Rigid) -> bool:
        """Take in the transform of an edge that never moves; return whether it is new.

        Raises:
            InvalidTransform: it cannot be part of the tree.
        """
        edge = self.edges.get(child)
        is_known = edge is not None and edge.parent == parent and edge.fixed is not None
        self._place(Edge(parent, child, _motion(parent, child, numbers)))
        return not is_known

    def forget_moving(self) -> None:
        """Empty the tree of what moves; fixed edges stay."""
        self.edges = {child: edge for child, edge in self.edges.items() if edge.fixed is not None}
        self._paths.clear()

    def loop(self, parent: str, child: str) -> tuple[str, ...]:
        """Return the frames from `parent` up to `child`, if an edge between the two would close a loop; else none."""
        path = [parent]
        while path[-1] != child:
            edge = self.edges.get(path[-1])
            if edge is None:
                return ()
            path.append(edge.parent)
        return tuple(path)

    def check(self, parent: str, child: str, numbers: Rigid) -> None:
        """Check that an edge can be part of the tree.

        Raises:
            InvalidTransform: its numbers are impossible, it lacks a name, closes a loop, or there are too many frames.
        """
        _motion(parent, child, numbers)
        self._check_edge(parent, child)

    def _check_edge(self, parent: str, child: str) -> None:
        reason = None
        if not parent or not child:
            reason = "it lacks the name of a frame"
        elif loop := self.loop(parent, child):
            shown = " → ".join(map(printable, reversed(loop)))
            reason = f"it would close the loop {shown}{f' → {printable(child)}' if len(loop) > 1 else ''}"
        elif child not in self.edges and len(self.edges) >= MOST_FRAMES:
            reason = f"the tree has {MOST_FRAMES} frames already"
        if reason is not None:
            raise _refusal(parent, child, reason)

    def _place(self, edge: Edge) -> Edge:
        """Put an edge into the tree, in place of a former one, if it can be part of the tree."""
        self._check_edge(edge.parent, edge.child)
        former = self.edges.get(edge.child)
        if former is not None and former.parent != edge.parent:
            self.moved.setdefault(edge.child, {former.parent}).add(edge.parent)
        self.edges[edge.child] = edge
        self._paths.clear()
        return edge

    # Asking.

    @property
    def frames(self) -> set[str]:
        """The names of all frames."""
        return {*self.edges, *(edge.parent for edge in self.edges.values())}

    @property
    def roots(self) -> list[str]:
        """The frames without a parent, sorted."""
        return sorted({edge.parent for edge in self.edges.values()} - self.edges.keys())

    def root(self, frame: str) -> str:
        """Return the last frame above a frame."""
        while (edge := self.edges.get(frame)) is not None:
            frame = edge.parent
        return frame

    def children(self, frame: str) -> Iterator[Edge]:
        """Yield the edges below a frame, by name."""
        yield from sorted((edge for edge in self.edges.values() if edge.parent == frame), key=lambda edge: edge.child)

    def find(self, target: str, source: str, stamp_ns: int | None) -> tuple[Rigid, int] | Gap:
        """Return the motion that gives coordinates in `target` for those in `source`, and its time; or what is missing.

        Without a time it is the newest at which all edges are known, 0 where none of them moves.
        """
        path = self._paths.get((target, source))
        if path is None:
            found = self._path(target, source, stamp_ns or 0)
            if isinstance(found, Gap):
                return found
            path = self._paths[target, source] = found
        if stamp_ns is None:
            stamp_ns = min((edge.stamps[-1] for side in path for edge in side if edge.fixed is None), default=0)
        up, down = (_product(side, stamp_ns) for side in path)
        if isinstance(up, Gap):
            return up
        if isinstance(down, Gap):
            return down
        return (up if down is IDENTITY else multiply(inverse(down), up)), stamp_ns

    def _path(self, target: str, source: str, stamp_ns: int) -> tuple[tuple[Edge, ...], tuple[Edge, ...]] | Gap:
        """Return the edges from each of two frames up to their common ancestor: those of the source first."""
        for frame in (target, source):
            if frame not in self.edges and frame not in self.frames:
                return Gap(Lack.UNKNOWN, (frame, frame), stamp_ns)
        roots = self.root(target), self.root(source)
        if roots[0] != roots[1]:
            return Gap(Lack.APART, roots, stamp_ns)
        above_target, above_source = list(self._above(target)), list(self._above(source))
        while above_target and above_source and above_target[-1] is above_source[-1]:
            above_target.pop()
            above_source.pop()
        return tuple(above_source), tuple(above_target)

    def _above(self, frame: str) -> Iterator[Edge]:
        while (edge := self.edges.get(frame)) is not None:
            yield edge
            frame = edge.parent

    def error(self, gap: Gap, asked: tuple[str, str], publisher: str = "") -> TransformError:
        """Return the error of a gap: what is missing, why, and what to do.

        Args:
            gap: what is missing.
            asked: the target and the source that were asked for.
            publisher: what publishes the edge that lags, in words, where that is known.
        """
        target, source = map(printable, asked)
        first, second = map(printable, gap.frames)
        if gap.lack is Lack.UNKNOWN:
            return UnknownFrame(
                f"there is no frame {first!r}; {did_you_mean(gap.frames[0], self.frames, none=_NONE_YET)}"
            )
        if gap.lack is Lack.APART:
            return FramesNotConnected(
                f"{target} and {source} are in trees apart: the root of {target} is {first}, that of {source} is "
                f"{second}; publish a transform that joins them, such as {first} → {second}"
            )
        edge = self.edges.get(gap.frames[1])
        if edge is None or (limit := edge.oldest_ns if gap.lack is Lack.OLD else edge.newest_ns) is None:
            return TransformError(f"{first} → {second} has just been emptied, since time was set back; ask again")
        apart = _span(abs(gap.stamp_ns - limit))
        if gap.lack is Lack.OLD:
            return TransformTooOld(
                f"{first} → {second} at {gap.stamp_ns / NS_PER_S:.3f} s is {apart} older than what is known, and "
                f"{KEPT_NS // NS_PER_S} s are kept; ask sooner, or for the newest: latest({target!r}, {source!r})"
            )
        rate = f", at {edge.rate_hz:.3g} Hz" if edge.rate_hz is not None else ""
        by = f" ({publisher}{rate})" if publisher else rate.replace(", at", ", which comes at")
        return TransformNotThere(
            f"{first} → {second} is {apart} behind{by}; wait longer with lookup(…, timeout=…), "
            f"or ask for the newest: latest({target!r}, {source!r})"
        )


def _motion(parent: str, child: str, numbers: Rigid) -> Rigid:
    """Return the motion of an edge.

    Raises:
        InvalidTransform: its numbers are impossible.
    """
    try:
        return unit(numbers)
    except ValueError as error:
        raise _refusal(parent, child, str(error)) from None


def _refusal(parent: str, child: str, reason: str) -> InvalidTransform:
    return InvalidTransform(f"{printable(parent) or '?'} → {printable(child) or '?'}: {reason}")


def _product(edges: Sequence[Edge], stamp_ns: int) -> Rigid | Gap:
    """Return the motion that edges make one after the other at a time, the lowest first; or what is missing."""
    product = IDENTITY
    for edge in edges:
        part = edge.fixed or edge.at(stamp_ns)
        if isinstance(part, Lack):
            return Gap(part, (edge.parent, edge.child), stamp_ns)
        product = part if product is IDENTITY else multiply(part, product)
    return product


def _span(ns: int) -> str:
    return f"{ns / 1e6:.3g} ms" if ns < NS_PER_S else f"{ns / NS_PER_S:.3f} s"
