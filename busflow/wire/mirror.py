"""Mirror: a bus as the other processes of its run see it, and they as the bus sees them.

Every end of a topic has a liveliness token, an outlet if it publishes, and a way in if others publish what it receives.
Everything here happens on the event loop; what Zenoh tells in its own threads is brought there first.
"""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from typing import TYPE_CHECKING, Any

import zenoh

from busflow import rosout
from busflow.clients import Client
from busflow.errors import BusflowError
from busflow.parameter_store import ParameterStore
from busflow.publishers import Publisher
from busflow.qos import Durability
from busflow.servers import Server
from busflow.subscriptions import Subscription
from busflow.wire.answers import Answers
from busflow.wire.history import History
from busflow.wire.inlet import Inlet, remote_endpoint
from busflow.wire.keys import DOMAIN, GRAPH, Kind, Token, split_name
from busflow.wire.outlet import Outlet
from busflow.wire.qos_form import to_text
from busflow.wire.questions import Inspected, Questions
from busflow.wire.sender import Sender
from busflow.wire.service_mirror import ServiceMirror
from busflow.wire.typesupport import TypeSupport

if TYPE_CHECKING:
    from busflow.bus import Attached
    from busflow.bus import End as AnyEnd
    from busflow.endpoint import Endpoint
    from busflow.wire.run_directory import RunCard

End = Publisher[Any] | Subscription[Any]


class Mirror:
    """What a process shows of its graph in a Zenoh session, and takes in from it."""

    def __init__(
        self, graph: Inspected, session: zenoh.Session, card: RunCard, process: str, history: Mapping[str, int]
    ) -> None:
        """A mirror that shows nothing until `begin`, which the event loop has to call."""
        self._graph, self._session = graph, session
        self._log = graph.log.bind("busflow")
        self._sender = Sender()
        self._history = History(graph.bus, {rosout.TOPIC: 0} | dict(history))  # the log has a book of its own
        self._supports = cache(TypeSupport)
        self._questions = Questions(graph, card, process, self._supports, self._history)
        self._process = process
        self._zid = str(session.info.zid())
        self._node_ids: dict[str, int] = {}
        self._ids = 0
        self._tokens: dict[object, zenoh.LivelinessToken] = {}
        self._outlets: dict[Publisher[Any], Outlet] = {}
        self._inlets: dict[str, Inlet] = {}
        self._remote: dict[str, Token] = {}
        self._admitting = False
        self._services = ServiceMirror(
            graph.bus,
            self._supports,
            session=session,
            sender=self._sender,
            log=self._log,
            identify=self._identify,
            on_loop=self._on_loop,
        )
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ways: list[Any] = []

    def begin(self) -> None:
        """Show the nodes, and from now on every end that comes and goes; called before the first does."""
        self._loop = asyncio.get_running_loop()
        for unit in self._graph.units:
            self._node_id(unit.name)
        self._graph.bus.on_attach.append(self._on_attach)
        self._graph.bus.on_detach.append(self._on_detach)
        self._answers = Answers(
            self._session, self._process, self._questions.all(), sender=self._sender, on_loop=self._on_loop
        )

        def hear(sample: zenoh.Sample) -> None:
            self._on_loop(self._on_token, str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT)

        self._graph.rosout.announce(self._wanted_of_rosout())

        callback: Any = zenoh.handlers.Callback(hear, indirect=False)
        everything = f"{GRAPH}/{DOMAIN}/**"
        self._ways.append(self._session.liveliness().declare_subscriber(everything, callback, history=True))

    def close(self) -> None:
        """Show and take in nothing more, and close the session; the event loop may have ended."""
        self._graph.bus.on_attach = [hear for hear in self._graph.bus.on_attach if hear != self._on_attach]
        self._graph.bus.on_detach = [hear for hear in self._graph.bus.on_detach if hear != self._on_detach]
        self._loop = None
        for publisher in self._outlets:
            publisher.send_through(None)
        self._session.close()  # which ends what waits in recv() and put()
        for inlet in self._inlets.values():
            inlet.close()
        self._services.close()
        self._sender.close()

    # What is here.

    def _wanted_of_rosout(self) -> Durability:
        """What the nodes that receive the log, and are connected after its publisher, request of it."""
        ends = [end.endpoint for unit in self._graph.units for end in unit.runtime.subscriptions]
        latched = any(end.topic == rosout.TOPIC and end.qos.durability is Durability.TRANSIENT_LOCAL for end in ends)
        return Durability.TRANSIENT_LOCAL if latched else Durability.VOLATILE

    def _on_attach(self, attached: Attached) -> None:
        if isinstance(attached, Server | Client):
            self._services.attach(attached)
        if isinstance(attached, ParameterStore):
            self._services.attach_parameters(attached)
        if self._admitting or not isinstance(attached, Publisher | Subscription):
            return
        end: End = attached
        self._history.follow(self._graph.bus.topics[end.topic])
        kind = Kind.PUBLISHER if isinstance(end, Publisher) else Kind.SUBSCRIPTION
        token = self._token(end.endpoint, self._supports(end.type), kind)
        if isinstance(end, Publisher):
            self._outlets[end] = Outlet(
                end,
                self._supports(end.type),
                token,
                session=self._session,
                sender=self._sender,
                clock=self._graph.clock,
                log=self._log,
                on_loop=self._on_loop,
            )
            return
        self._tokens[_key(end)] = self._session.liveliness().declare_token(str(token))
        for remote in [each for each in self._remote.values() if each.topic == end.topic]:
            self._admit(remote)

    def _on_detach(self, end: AnyEnd) -> None:
        if isinstance(end, Publisher):
            outlet = self._outlets.pop(end, None)
            if outlet is not None:
                outlet.close()
            return
        if not isinstance(end, Subscription):
            self._services.detach(end)
            return
        token = self._tokens.pop(_key(end), None)
        if token is not None:
            token.undeclare()
        topic = self._graph.bus.topics[end.topic]
        if not topic.subscriptions and topic.name in self._inlets:
            self._inlets.pop(topic.name).close()

    def _token(self, endpoint: Endpoint, support: TypeSupport, kind: Kind) -> Token:
        session, node_id, entity_id = self._identify(endpoint.node)
        namespace, node = split_name(endpoint.node)
        return Token(
            session=session,
            node_id=node_id,
            entity_id=entity_id,
            kind=kind,
            namespace=namespace,
            node=node,
            topic=endpoint.topic,
            type=support.name,
            hash=support.type_hash,
            qos=to_text(endpoint.qos),
        )

    def _identify(self, node: str) -> tuple[str, int, int]:
        """The session, a node's number, and a new number for one of its ends."""
        node_id = self._node_id(node)
        self._ids += 1
        return self._zid, node_id, self._ids

    def _node_id(self, name: str) -> int:
        """The number of a node in its tokens; the first time declares the node."""
        found = self._node_ids.get(name)
        if found is None:
            self._ids += 1
            found = self._node_ids[name] = self._ids
            namespace, node = split_name(name)
            token = Token(self._zid, found, found, Kind.NODE, namespace, node)
            self._tokens[name] = self._session.liveliness().declare_token(str(token))
        return found

    # What is elsewhere.

    def _on_token(self, text: str, alive: bool) -> None:
        if f"/{self._zid}/" in text:
            return
        try:
            token = Token.parse(text)
        except BusflowError as error:
            self._log.debug(f"a token of another process is not understood: {error}")
            return
        if token.kind is Kind.SERVICE:
            self._services.hear(text, token, alive=alive)
        if token.kind is not Kind.PUBLISHER:
            return
        if alive:
            self._remote[text] = token
            self._admit(token)
        elif self._remote.pop(text, None):
            self._dismiss(token)

    def _admit(self, token: Token) -> None:
        """Let a publisher of another process publish here, if anybody here receives its topic."""
        topic = self._graph.bus.topics.get(token.topic)
        if topic is None or not topic.subscriptions:
            return
        support = self._supports(topic.type)
        if (token.type, token.hash) != (support.name, support.type_hash):
            told = "of another definition" if token.type == support.name else f"as {token.type}"
            self._log.warning(f"{token.node_name} in another process publishes {topic.name} {told}: it is not received")
            return
        self._admitting = True
        try:
            endpoint = remote_endpoint(token, topic)
            if topic.name not in self._inlets:
                self._inlets[topic.name] = Inlet(
                    topic, support, bus=self._graph.bus, session=self._session, log=self._log, on_loop=self._on_loop
                )
            self._inlets[topic.name].admit(token, endpoint)
        except (BusflowError, ValueError) as error:
            self._log.warning(f"{token.node_name} in another process is not received on {topic.name}: {error}")
        finally:
            self._admitting = False

    def _dismiss(self, token: Token) -> None:
        inlet = self._inlets.get(token.topic)
        if inlet is not None:
            inlet.dismiss(token, lambda: self._close_if_deserted(token.topic))

    def _close_if_deserted(self, topic: str) -> None:
        inlet = self._inlets.get(topic)
        if inlet is not None and inlet.deserted:
            self._inlets.pop(topic).close()

    def _on_loop(self, work: Any, *arguments: Any) -> None:
        """Have the event loop do this, from any thread."""
        loop = self._loop
        if loop is not None:
            with suppress(RuntimeError):  # the loop has ended meanwhile: there is nobody to tell
                loop.call_soon_threadsafe(work, *arguments)


def _key(subscription: Subscription[Any]) -> object:
    """What stays the same when a restarted node's subscription takes over its predecessor's place."""
    return subscription.endpoint.node, subscription.topic, subscription.endpoint.origin
