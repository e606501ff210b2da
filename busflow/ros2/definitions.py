"""`differences`: how the definitions of one type differ, as a diff of what the nodes that use them describe."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from difflib import unified_diff
from typing import TYPE_CHECKING, cast

from busflow.errors import BusflowError, Problem, Severity
from busflow.interfaces.encoding.msg_text import ros2msg

if TYPE_CHECKING:
    from busflow.interfaces.encoding.description import TypeDescription
    from busflow.wire.client.client import Peer
    from busflow.wire.client.graph_view import GraphView
    from busflow.wire.zenoh.keys import Token

_MOST_LINES = 40
"""Lines of a diff that are shown."""
_CONTEXT = 1
"""Lines of a diff around each change."""


def differences(peer: Peer, graph: GraphView) -> Iterator[Problem]:
    """Yield a finding for each topic with two definitions of one type: the lines that differ."""
    seen: set[tuple[str, ...]] = set()
    for topic in graph.topics.values():
        ends: Mapping[str, Token] = {
            end.token.hash: end.token for end in (*topic.subscriptions, *topic.publishers) if end.token.known_hash
        }
        hashes = tuple(sorted(ends))
        if len(topic.types) == 1 and len(ends) > 1 and hashes not in seen:
            seen.add(hashes)
            yield _difference(peer, list(ends.values()))


def _difference(peer: Peer, ends: Sequence[Token]) -> Problem:
    name = ends[0].type
    lines = {end.node_name: _lines(peer, end) for end in ends[:2]}
    unknown = [node for node, found in lines.items() if found is None]
    if unknown:
        text = f"definitions of {name} differ, and {' and '.join(unknown)} does not say what its own is"
        fix = f"compare its .msg file with busflow interface show {name}"
        return Problem("definitions-differ", text, fix, severity=Severity.WARNING)
    (one, first), (other, second) = ((node, found or []) for node, found in lines.items())
    details = list(unified_diff(first, second, one, other, lineterm="", n=_CONTEXT))
    if len(details) > _MOST_LINES:
        details[_MOST_LINES:] = [f"and {len(details) - _MOST_LINES} lines more"]
    text, fix = f"{one} and {other} have different definitions of {name}", "use the same definition on both sides"
    return Problem("definitions-differ", text, fix, severity=Severity.WARNING, details=tuple(details))


def _lines(peer: Peer, end: Token) -> list[str] | None:
    """Return the definition of an endpoint's type; None if no node describes it."""
    with suppress(BusflowError):
        description = peer.type(end.type, end.hash).description
        return ros2msg(cast("TypeDescription", description)).splitlines()
    return None
