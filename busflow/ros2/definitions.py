"""`differences`: in which fields the definitions of one type differ, as the nodes that use them describe it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from difflib import ndiff
from typing import TYPE_CHECKING, cast

from busflow.errors import BusflowError, Problem, Severity
from busflow.interfaces.encoding.msg_text import ros2msg

if TYPE_CHECKING:
    from busflow.interfaces.encoding.description import TypeDescription
    from busflow.wire.client.client import Peer
    from busflow.wire.client.graph_view import GraphView
    from busflow.wire.zenoh.keys import Token

_LOW = Severity.WARNING
_MOST_LINES = 6
"""Lines of a definition that are shown of each side."""


def differences(peer: Peer, graph: GraphView) -> Iterator[Problem]:
    """Yield, for each topic with two definitions of one type, in what they differ."""
    seen: set[tuple[str, ...]] = set()
    for topic in graph.topics.values():
        ends: Mapping[str, Token] = {
            end.token.hash: end.token for end in (*topic.subscriptions, *topic.publishers) if end.token.known_hash
        }
        hashes = tuple(sorted(ends))
        if len(topic.types) == 1 and len(ends) > 1 and hashes not in seen:
            seen.add(hashes)
            yield _difference(peer, [ends[each] for each in hashes])


def _difference(peer: Peer, ends: Sequence[Token]) -> Problem:
    name = ends[0].type
    lines = {end.node_name: _lines(peer, end) for end in ends[:2]}
    unknown = [node for node, found in lines.items() if found is None]
    if unknown:
        text = f"definitions of {name}: {' and '.join(unknown)} does not say what its own is"
        fix = f"compare its .msg file with busflow interface show {name}"
        return Problem("definitions-differ", text, fix, severity=_LOW)
    (one, first), (other, second) = ((node, found or []) for node, found in lines.items())
    found = list(ndiff(first, second))
    ours, theirs = ([line[2:] for line in found if line.startswith(sign)] for sign in ("- ", "+ "))
    text = f"definitions of {name}: {one} has {_shown(ours)} where {other} has {_shown(theirs)}"
    return Problem("definitions-differ", text, "use the same definition on both sides", severity=_LOW)


def _lines(peer: Peer, end: Token) -> list[str] | None:
    """Return the definition of an endpoint's type; None if no node describes it."""
    with suppress(BusflowError):
        description = peer.type(end.type, end.hash).description
        return ros2msg(cast("TypeDescription", description)).splitlines()
    return None


def _shown(lines: Sequence[str]) -> str:
    more = f" and {len(lines) - _MOST_LINES} more" if len(lines) > _MOST_LINES else ""
    return "; ".join(lines[:_MOST_LINES]) + more if lines else "nothing"
