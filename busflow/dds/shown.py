"""Shown: the nodes and endpoints of neighbours, as tokens by which the run and its terminals see them."""

# The stubs of zenoh leave out what many of its functions return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Mapping
from itertools import count
from typing import TYPE_CHECKING

from busflow.dds.neighbours import NeighbourEnd
from busflow.wire.zenoh.keys import Token, TokenKind
from busflow.wire.zenoh.qos_text import written

if TYPE_CHECKING:
    import zenoh

    from busflow.dds.node_lists import ListedNode


ENCLAVE = "/dds"
"""Marks the tokens of bridges: the neighbours of one domain are not shown to those of another."""


class Shown:
    """The tokens that stand for neighbours in the run."""

    def __init__(self, session: zenoh.Session, domain: int) -> None:
        """Show nothing yet; `domain` is that of the run's keys."""
        self._session, self._zid, self._domain = session, str(session.info.zid()), domain
        self._ids = count(1)
        self._node_ids: dict[str, int] = {}
        self._nodes: dict[str, zenoh.LivelinessToken] = {}
        self._ends: dict[bytes, tuple[tuple[object, ...], Token, zenoh.LivelinessToken]] = {}

    def update_nodes(self, nodes: list[ListedNode]) -> None:
        """Show these nodes, and no others."""
        wanted = {node.full_name: node for node in nodes}
        for name in self._nodes.keys() - wanted.keys():
            self._nodes.pop(name).undeclare()
        for name in wanted.keys() - self._nodes.keys():
            number = self._node_ids.setdefault(name, len(self._node_ids))
            node = wanted[name]
            token = Token(
                self._zid,
                number,
                number,
                TokenKind.NODE,
                node.namespace,
                node.name,
                enclave=ENCLAVE,
                domain=self._domain,
            )
            self._nodes[name] = self._session.liveliness().declare_token(str(token))

    def update_ends(self, ends: Mapping[bytes, tuple[TokenKind, NeighbourEnd, ListedNode, str, str]]) -> bool:
        """Show these endpoints, and no others: by gid its kind, itself, its node, type and hash.

        Returns:
            Whether one of them is new.
        """
        for gid, (stated, _, declared) in list(self._ends.items()):
            if gid not in ends or _stated(*ends[gid]) != stated:
                declared.undeclare()
                del self._ends[gid]
        new = ends.keys() - self._ends.keys()
        for gid in sorted(new):
            kind, end, node, type_name, type_hash = ends[gid]
            token = Token(
                session=self._zid,
                node_id=self._node_ids.setdefault(node.full_name, len(self._node_ids)),
                entity_id=next(self._ids),
                kind=kind,
                namespace=node.namespace,
                node=node.name,
                topic=end.name.name,
                type=type_name,
                hash=type_hash,
                qos=written(end.qos),
                enclave=ENCLAVE,
                domain=self._domain,
            )
            declared = self._session.liveliness().declare_token(str(token))
            self._ends[gid] = _stated(*ends[gid]), token, declared
        return bool(new)

    def token(self, gid: bytes) -> Token | None:
        """Return the token that stands for an endpoint."""
        found = self._ends.get(gid)
        return None if found is None else found[1]


def _stated(kind: TokenKind, end: NeighbourEnd, node: ListedNode, type_name: str, type_hash: str) -> tuple[object, ...]:
    """Return what the token of an endpoint says."""
    return kind, end.name, node.namespace, node.name, type_name, type_hash, end.qos
