"""Shown: the nodes and endpoints of neighbours, as tokens by which the run and its terminals see them."""

# The stubs of zenoh leave out what many of its functions return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Mapping
from itertools import count
from typing import TYPE_CHECKING, NamedTuple

from busflow.dds.neighbours import NeighbourEnd
from busflow.wire.zenoh.keys import Token, TokenKind
from busflow.wire.zenoh.qos_text import written

if TYPE_CHECKING:
    import zenoh

    from busflow.dds.node_lists import ListedNode


ENCLAVE = "/dds"
"""Marks the tokens of bridges: the neighbours of one domain are not shown to those of another."""


class ShownEnd(NamedTuple):
    """An endpoint of a neighbour, as the run is to see it."""

    kind: TokenKind
    end: NeighbourEnd
    node: ListedNode
    type_name: str
    type_hash: str


class Shown:
    """The tokens that stand for neighbours in the run."""

    def __init__(self, session: zenoh.Session, domain: int) -> None:
        """Show nothing yet; `domain` is that of the run's keys."""
        self._session, self._zid, self._domain = session, str(session.info.zid()), domain
        self._ids = count(1)
        self._node_ids: dict[str, int] = {}
        self._nodes: dict[str, zenoh.LivelinessToken] = {}
        self._ends: dict[bytes, tuple[Token, zenoh.LivelinessToken]] = {}

    def update_nodes(self, nodes: list[ListedNode]) -> None:
        """Show these nodes, and no others."""
        wanted = {node.full_name: node for node in nodes}
        for name in self._nodes.keys() - wanted.keys():
            self._nodes.pop(name).undeclare()
        for name in wanted.keys() - self._nodes.keys():
            number = self._node_ids.setdefault(name, len(self._node_ids))
            node, domain = wanted[name], self._domain
            token = Token(
                self._zid, number, number, TokenKind.NODE, node.namespace, node.name, enclave=ENCLAVE, domain=domain
            )
            self._nodes[name] = self._session.liveliness().declare_token(str(token))

    def update_ends(self, ends: Mapping[bytes, ShownEnd]) -> bool:
        """Show these endpoints, by gid, and no others.

        Returns:
            Whether one of them is new.
        """
        for gid, (token, declared) in list(self._ends.items()):
            if gid not in ends or self._token_of(ends[gid], token.entity_id) != token:
                declared.undeclare()
                del self._ends[gid]
        new = ends.keys() - self._ends.keys()
        for gid in sorted(new):
            token = self._token_of(ends[gid], next(self._ids))
            self._ends[gid] = token, self._session.liveliness().declare_token(str(token))
        return bool(new)

    def _token_of(self, shown: ShownEnd, entity_id: int) -> Token:
        return Token(
            session=self._zid,
            node_id=self._node_ids.setdefault(shown.node.full_name, len(self._node_ids)),
            entity_id=entity_id,
            kind=shown.kind,
            namespace=shown.node.namespace,
            node=shown.node.name,
            topic=shown.end.name.name,
            type=shown.type_name,
            hash=shown.type_hash,
            qos=written(shown.end.qos),
            enclave=ENCLAVE,
            domain=self._domain,
        )

    def token(self, gid: bytes) -> Token | None:
        """Return the token that stands for an endpoint."""
        found = self._ends.get(gid)
        return None if found is None else found[0]
