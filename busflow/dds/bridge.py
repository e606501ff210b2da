"""DdsBridge: joins a run and a DDS domain, and carries between them what its patterns allow.

The bridge looks at both sides whenever one of them has changed, and makes what it has the same as what there should
be: a writer for each publisher of the run, a reader for each topic that the run receives, a token in the run for each
node and endpoint of a neighbour. Messages do not wait for that: they are carried in the threads in which they arrive.
"""

# The stubs of zenoh leave out what many of its functions return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import zenoh

from busflow.actions.names import action_of
from busflow.clock import SystemClock
from busflow.dds.calls import OTHER_SERVICES, BridgeParts
from busflow.dds.carried import Carried
from busflow.dds.idl import Carriers
from busflow.dds.known_types import KnownTypes
from busflow.dds.names import NameUse
from busflow.dds.neighbours import UNKNOWN, NeighbourEnd, Neighbours
from busflow.dds.node_lists import ListedNode
from busflow.dds.participant import Intake, Participant
from busflow.dds.services import Services
from busflow.dds.shown import ENCLAVE, Shown, ShownEnd
from busflow.dds.topics import Topics
from busflow.errors import MalformedMessage
from busflow.wire.client.client import Peer
from busflow.wire.zenoh.keys import GRAPH, Token, TokenKind
from busflow.wire.zenoh.run_directory import FoundRun, runs
from busflow.wire.zenoh.sender import SenderThread
from busflow.wire.zenoh.session import open_session

if TYPE_CHECKING:
    from busflow.bus.patterns import Selection

OTHER_TYPES = (
    "a neighbour with another DDS than Cyclone describes its types, as Fast DDS 3 does: what it publishes or receives "
    "crosses only if it does not (fastdds.type_propagation: docs/ros2.md)"
)
"""The log's line about types that both sides describe, each in its way, so that their endpoints do not match."""
_LISTED_NS = 1_000_000_000
"""How long ROS 2 may take to list the node of an endpoint; its messages wait meanwhile."""
_LOOK_S = 1.0
"""Interval of the checks whether the run still exists."""


@dataclass(frozen=True, slots=True)
class _RunJoinedAsProcess(FoundRun):
    """A run that is joined as a process of its own: a client, without a socket, would not see other clients."""

    socket: str = ""
    """The name of the socket in the run's directory."""

    @classmethod
    def of(cls, run: FoundRun, domain: int) -> Self:
        return cls(run.directory, run.card, run.is_double, f"dds-{domain}.sock")

    def open(self, patience_s: float) -> zenoh.Session:
        return open_session(self.directory, listen=self.socket, patience_s=patience_s)

    def is_alive(self, _session: zenoh.Session) -> bool:
        return any(each.directory == self.directory and each.card == self.card for each in runs())


class DdsBridge:
    """A bridge between a run and a DDS domain."""

    def __init__(
        self,
        run: FoundRun,
        domain: int,
        selection: Selection,
        *,
        interface: str | None = None,
        log: Callable[[str], None],
    ) -> None:
        """Join both sides; `serve` then carries messages and calls.

        Args:
            run: the run, on this machine.
            domain: the domain's number.
            selection: the topics, services and actions that cross.
            interface: the network interface; None for the loopback interface.
            log: writes a line of the log, as a warning.

        Raises:
            InspectionUnavailable: the run does not answer, or DDS cannot open its sockets.
            InvalidName: no network interface has such a name.
        """
        self.carried: Carried = Carried(log)
        self._selection = selection
        self._changed = threading.Event()
        self._ending = False
        self._clock = SystemClock()
        self._tokens: dict[str, Token] = {}
        self._unlisted: dict[bytes, int] = {}
        """By gid of an endpoint that no node list has yet, the time at which it came."""
        carriers = Carriers()
        self._participant = participant = Participant(domain, interface)
        if not participant.is_confined:
            self.carried.warn("other machines can send to the sockets of DDS: this system cannot keep them out")
        self._peer = Peer(_RunJoinedAsProcess.of(run, domain))
        self._shown = Shown(self._peer.session, self._peer.domain)
        self._sender = SenderThread("busflow.dds.calls", on_error=self._on_error)
        self._intakes = [
            Intake(participant, f"busflow.dds.{what}", on_error=self._on_error) for what in ("topics", "services")
        ]
        parts, calls = (
            BridgeParts(self._peer, participant, intake, carriers, self.carried, self._sender)
            for intake in self._intakes
        )
        types = KnownTypes(self._peer, self.carried)
        self._topics, self._services = Topics(parts, types, self._shown), Services(calls, types)
        self._neighbours = Neighbours(participant, carriers, on_change=self._changed.set, on_fault=self.carried.fault)
        self._watch: Any = self._peer.session.liveliness().declare_subscriber(
            f"{GRAPH}/{self._peer.domain}/**", zenoh.handlers.Callback(self._on_token, indirect=False), history=True
        )

    def serve(self) -> None:
        """Carry until `stop` is called, or the run ends."""
        while not self._ending and self._peer.alive:
            if self._changed.wait(_LOOK_S) or self._waits_for_list:
                self._changed.clear()
                self._update()

    def stop(self) -> None:
        """End `serve`, from any thread or a signal handler."""
        self._ending = True
        self._changed.set()

    def close(self) -> None:
        """Leave both sides."""
        self._neighbours.close()
        self._services.close()
        self._topics.close()
        for intake in self._intakes:
            intake.close()
        self._peer.close()
        self._sender.close()
        self._participant.close()

    @property
    def _waits_for_list(self) -> bool:
        now_ns = self._clock.monotonic_ns()
        return any(now_ns - since_ns < 2 * _LISTED_NS for since_ns in self._unlisted.values())

    def _allows(self, name: str) -> bool:
        return self._selection.includes(action_of(name) or name)

    def _on_token(self, sample: zenoh.Sample) -> None:
        """Note a node or endpoint of the run that has come or gone; called in Zenoh's thread."""
        text = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.DELETE:
            self._tokens.pop(text, None)
        else:
            try:
                token = Token.parse(text)
            except MalformedMessage:  # a process of the run says so
                return
            if token.enclave == ENCLAVE:
                return
            self._tokens[text] = token
        self._changed.set()

    def _on_error(self, error: Exception) -> None:
        self.carried.warn(f"{type(error).__name__}: {error}")

    def _update(self) -> None:
        """Bring outlets, inlets, servers and tokens up to date with both sides."""
        tokens = list(self._tokens.values())
        run = [token for token in tokens if token.topic and self._allows(token.topic)]
        allowed = [end for end in self._neighbours.ends if self._allows(end.name.name)]
        ends = [end for end in allowed if end.can_cross]
        if len(ends) < len(allowed):
            self.carried.warn(OTHER_SERVICES)
        if any(end.may_not_match for end in ends):
            self.carried.warn(OTHER_TYPES)
        self._services.learn(ends)
        is_new = self._show(run, ends)
        self._topics.update(run, ends)
        self._services.update(run, ends)
        if is_new:
            self._peer.settle()
        self._topics.admit()
        nodes = [token for token in tokens if token.kind is TokenKind.NODE]
        self._neighbours.list_own(tuple(self._listed(node, run) for node in nodes))

    def _show(self, run: Sequence[Token], ends: Sequence[NeighbourEnd]) -> bool:
        """Show neighbours' nodes and endpoints in the run; return whether an endpoint is new."""
        hashes = {(token.topic, token.type): token.hash for token in run}
        found: dict[bytes, ShownEnd] = {}
        nodes_of = self._nodes_of(ends)
        for end in ends:
            if (node := nodes_of.get(end.gid)) is None:
                continue
            if end.name.use is NameUse.TOPIC:
                kind = TokenKind.PUBLISHER if end.is_writer else TokenKind.SUBSCRIPTION
                type_hash = end.hash or hashes.get((end.name.name, end.type), "")
                found[end.gid] = ShownEnd(kind, end, node, end.type, type_hash)
            elif end.name.use is NameUse.REQUEST:
                kind = TokenKind.CLIENT if end.is_writer else TokenKind.SERVICE
                service = self._services.kind_of(end)
                type_name = end.type.removesuffix("_Request")
                found[end.gid] = ShownEnd(kind, end, node, type_name, "" if service is None else service.hash)
        nodes = {node.full_name: node for node in (*self._neighbours.nodes, *(each.node for each in found.values()))}
        self._shown.update_nodes(list(nodes.values()))
        return self._shown.update_ends(found)

    def _nodes_of(self, ends: Sequence[NeighbourEnd]) -> dict[bytes, ListedNode]:
        """Return the nodes of endpoints, without those that are going to be listed."""
        now_ns, before, self._unlisted = self._clock.monotonic_ns(), self._unlisted, {}
        found: dict[bytes, ListedNode] = {}
        for end in ends:
            node = self._neighbours.node_of(end)
            if node is None:
                since_ns = self._unlisted[end.gid] = before.get(end.gid, now_ns)
                node = UNKNOWN if now_ns - since_ns >= _LISTED_NS else None
            if node is not None:
                found[end.gid] = node
        return found

    def _listed(self, node: Token, run: Sequence[Token]) -> ListedNode:
        readers, writers = self._topics.gids(node.node_name, run)
        answering, answers = self._services.gids(node.node_name, run)
        return ListedNode(node.namespace, node.node, readers | answering, writers | answers)
