"""Services: the services that cross the bridge, as both sides have them now."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from busflow.dds.calls import BridgeParts, NeighbourServer, RunServer
from busflow.dds.names import NameUse
from busflow.errors import UnknownType
from busflow.wire.zenoh.keys import Token, TokenKind

if TYPE_CHECKING:
    from busflow.dds.known_types import KnownTypes
    from busflow.dds.neighbours import NeighbourEnd
    from busflow.wire.client.client import ServiceKind

_REQUEST = "_Request"


class Services:
    """The servers of the run that neighbours call, and the servers of neighbours that the run calls."""

    def __init__(self, parts: BridgeParts, types: KnownTypes) -> None:
        self._parts, self._types = parts, types
        self._servers: dict[str, RunServer | None] = {}
        """By token of a server of the run; None for one that cannot cross."""
        self._neighbours: dict[bytes, NeighbourServer] = {}
        """By gid of the reader of requests of a neighbour's server."""
        self._kinds: dict[bytes, ServiceKind] = {}

    def update(self, run: Sequence[Token], ends: Sequence[NeighbourEnd]) -> None:
        """Show each side the servers that the other one has now."""
        self._update_servers({str(token): token for token in run if token.kind is TokenKind.SERVICE})
        asked = [end for end in ends if end.name.use is NameUse.REQUEST and not end.is_writer]
        self._update_neighbours({end.gid: end for end in asked})

    def kind_of(self, end: NeighbourEnd) -> ServiceKind | None:
        """Return the service of a neighbour's server, if its type is known."""
        return self._kinds.get(end.gid)

    def learn(self, ends: Sequence[NeighbourEnd]) -> None:
        """Look up the types of neighbours' services that are not known yet, in the run and on this machine."""
        asked = {end.gid: end for end in ends if end.name.use is NameUse.REQUEST and end.type.endswith(_REQUEST)}
        self._kinds = {gid: kind for gid, kind in self._kinds.items() if gid in asked}
        unknown = [end for gid, end in asked.items() if gid not in self._kinds]
        known = self._types.services(sorted({end.name.name for end in unknown}))
        for end in unknown:
            type_name = end.type.removesuffix(_REQUEST)
            kind = known.get(end.name.name)
            if kind is not None and kind.type != type_name:
                text = f"{end.name.name} in DDS is a {type_name}, and in the run a {kind.type}: it is not called"
                self._parts.carried.warn(text)
                continue
            kind = kind or self._types.installed_service(end.name.name, type_name)
            if kind is not None:
                self._kinds[end.gid] = kind

    def gids(self, node: str, run: Sequence[Token]) -> tuple[frozenset[bytes], frozenset[bytes]]:
        """Return the gids in DDS of the readers and of the writers of the servers and clients of a node of the run."""
        own = [token for token in run if token.node_name == node]
        servers = (self._servers.get(str(token)) for token in own if token.kind is TokenKind.SERVICE)
        called = {token.topic for token in own if token.kind is TokenKind.CLIENT}
        found = [server.gids for server in servers if server is not None]
        found += [server.gids for server in self._neighbours.values() if server.name in called]
        return frozenset(reader for reader, _ in found), frozenset(writer for _, writer in found)

    def close(self) -> None:
        """Answer and call nothing any more."""
        for server in (*self._servers.values(), *self._neighbours.values()):
            if server is not None:
                server.close()

    def _update_servers(self, wanted: Mapping[str, Token]) -> None:
        for text in self._servers.keys() - wanted.keys():
            if (server := self._servers.pop(text)) is not None:
                server.close()
        new = {text: token for text, token in wanted.items() if text not in self._servers}
        kinds = self._types.services(sorted({token.topic for token in new.values()}))
        for text, token in sorted(new.items()):
            kind = kinds.get(token.topic) or self._types.installed_service(token.topic, token.type)
            self._servers[text] = None
            if kind is None or kind.hash != token.hash:
                self._parts.carried.warn(f"{token.topic} does not cross the bridge to DDS: its type is not known here")
                continue
            try:
                self._servers[text] = RunServer(kind, self._parts)
            except UnknownType as error:
                self._parts.carried.warn(f"{token.topic} does not cross the bridge to DDS: {error}")

    def _update_neighbours(self, wanted: Mapping[bytes, NeighbourEnd]) -> None:
        for gid in self._neighbours.keys() - wanted.keys():
            self._neighbours.pop(gid).close()
        called = {end.name.name for gid, end in wanted.items() if gid in self._neighbours}
        for gid in sorted(wanted.keys() - self._neighbours.keys()):
            name, kind = wanted[gid].name.name, self._kinds.get(gid)
            if kind is None or name in called:  # of two servers of one name, as of two answers, the first counts
                continue
            called.add(name)
            try:
                self._neighbours[gid] = NeighbourServer(kind, self._parts)
            except UnknownType as error:
                self._parts.carried.warn(f"{name} in DDS is not called: {error}")
