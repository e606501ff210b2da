"""Mirror: shows a bus to the other processes of its run.

Every node and every endpoint has a liveliness token; a publisher has an outlet. `RemotePublishers` handles what other
processes publish, and `ServiceMirror` handles services. Everything here runs on the event loop; callbacks from Zenoh's
threads are passed to it first.
"""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection, Generator, Mapping
from contextlib import contextmanager, suppress
from functools import cache, partial
from typing import TYPE_CHECKING, Any, cast

import zenoh

from busflow import timeouts
from busflow.bus.bus import BusObserver, check_qos
from busflow.bus.endpoint import PARAMETER_EVENTS, ROSOUT
from busflow.bus.publisher import Publisher
from busflow.bus.qos import Durability
from busflow.bus.subscription import Subscription
from busflow.errors import BusflowError, MalformedMessage
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.runner.service_events import SUFFIX
from busflow.wire.line.lines import Lines
from busflow.wire.mirror.connection import Connection
from busflow.wire.mirror.held_messages import ask_processes
from busflow.wire.mirror.inlet import remote_endpoint
from busflow.wire.mirror.outlet import Outlet
from busflow.wire.mirror.remote_publishers import RemotePublishers
from busflow.wire.mirror.service_events import ServiceEvents
from busflow.wire.mirror.services import ServiceMirror
from busflow.wire.mirror.token_intake import TokenIntake
from busflow.wire.queries.kept_messages import KeptMessages
from busflow.wire.queries.queries import Questions
from busflow.wire.queries.server import Question, QuestionServer
from busflow.wire.zenoh.keys import GRAPH, HUMBLE, Token, TokenKind, split_name
from busflow.wire.zenoh.qos_text import from_text, to_text
from busflow.wire.zenoh.sender import SenderThread
from busflow.wire.zenoh.session import links_of

if TYPE_CHECKING:
    from pathlib import Path

    from busflow.bus.bus import AnyEndpoint
    from busflow.bus.services.client import Client
    from busflow.bus.services.server import Server
    from busflow.bus.topic import Topic
    from busflow.node.parameter_store import ParameterStore
    from busflow.runner.graph import Graph
    from busflow.wire.zenoh.run_directory import RunCard

MirroredEndpoint = Publisher[Any] | Subscription[Any]


class Mirror(BusObserver):
    """Shows a process's graph in a Zenoh session, and receives from the session."""

    def __init__(
        self,
        graph: Graph,
        session: zenoh.Session,
        card: RunCard,
        process: str,
        history: Mapping[str, int],
        about: Callable[[], Mapping[str, Any]] = dict,
        lines: Path | None = None,
    ) -> None:
        """Create a mirror; it shows nothing until the event loop calls `begin`.

        Args:
            graph: the nodes of this process.
            session: the Zenoh session that shows them.
            card: the run's description of itself.
            process: this process's name.
            history: by final topic name, how many messages are kept for `--last`.
            about: returns the facts about this process that are not in its graph, and those about processes that
                cannot answer.
            lines: the directory with the sockets of the lines to the run's other processes; None without lines.
        """
        self._graph, self._session, self._process = graph, session, process
        self._log = graph.log.bind("busflow")
        self._history = KeptMessages(graph.bus, {ROSOUT: 0} | dict(history))  # 0: a `LogBook` keeps the log's lines
        self._supports = cache(TypeSupport)
        self._zid = str(session.info.zid())
        self._lines = None if lines is None else Lines(lines, self._zid, self._on_route, self._log)
        self._connection = self._connected(card)
        self._intake = TokenIntake(graph.bus.dispatcher, self._on_loop, self._on_token, self._log)
        self._remote_publishers = RemotePublishers(self._connection)
        self._presence = Presence()
        self._questions = Questions(
            *(graph, card, process, self._supports, self._history, self._presence.tokens),
            about=lambda: {"shared_memory": 0 if self._lines is None else self._lines.capacity, **about()},
        )
        self._node_ids, self._ids = dict[str, int](), 0
        self._nodes: dict[str, zenoh.LivelinessToken] = {}
        self._left: dict[str, set[str]] = {}
        """By node, the topics on which it had an endpoint that has ended."""
        self._subscriptions: dict[Subscription[Any], zenoh.LivelinessToken] = {}
        self._outlets: dict[Publisher[Any], Outlet] = {}
        self._services = ServiceMirror(self._connection, self._token, graph.log)
        self._service_events = ServiceEvents(self._connection)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._reminder: asyncio.TimerHandle | None = None
        self._declared: list[Any] = []

    def _connected(self, card: RunCard) -> Connection:
        sender, replier = (SenderThread(name, on_error=self._log_bug) for name in ("busflow.sender", "busflow.replier"))
        return Connection(
            *(self._graph.bus, self._session, self._supports, sender, replier, self._log, self._on_loop, self._lines),
            domain=card.domain,
            describes_types=card.ros2_domain is not None,
        )

    def begin(self) -> None:
        """Show the nodes, and from now on every new endpoint; called before the first endpoint is attached."""
        self._loop = asyncio.get_running_loop()
        if self._lines is not None:
            self._lines.begin()  # before any token: others connect as soon as they see one
        for supervisor in self._graph.supervisors:
            self._node_id(supervisor.name)
        self._graph.bus.observe(self)
        answers = QuestionServer(
            self._session,
            self._process,
            {name: self._after_matching(question) for name, question in self._questions.all().items()},
            sender=self._connection.replier,
            log=self._log,
            on_loop=self._intake.hand,
        )

        def on_sample(sample: zenoh.Sample) -> None:
            self._intake.take(str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT)

        self._graph.rosout.announce(self._rosout_durability())

        callback: Any = zenoh.handlers.Callback(on_sample, indirect=False)
        everything = f"{GRAPH}/{self._connection.domain}/**"
        self._declared += [answers, self._session.liveliness().declare_subscriber(everything, callback, history=True)]

    def hide(self, node: str) -> None:
        """Stop showing a node that has left the graph, and the topics that no other node has."""
        self._services.detach_parameters(node)
        self._questions.left_topics |= self._left.pop(node, set())
        self._node_ids.pop(node, None)
        if (token := self._nodes.pop(node, None)) is not None:
            token.undeclare()
        self._presence.notify()

    def close(self) -> None:
        """Stop showing and receiving, and close the session."""
        bus = self._graph.bus
        if self._loop is not None:
            bus.observers.remove(self)
        self._loop = None
        for publisher in self._outlets:
            publisher.send_through(None)
        self._history.close()
        self._questions.close()
        self._connection.finish()
        self._session.close()  # this ends a waiting recv() or put()
        self._remote_publishers.close()
        self._services.close()
        if self._lines is not None:
            self._lines.close()
        self._connection.sender.close()
        self._connection.replier.close()

    def about(self) -> Mapping[str, Any]:
        """Return how many tokens were too many; with nodes of ROS 2 also `links`, by the session at their other end."""
        links = {"links": links_of(self._session)} if self._connection.describes_types else {}
        return {"ignored_tokens": self._intake.ignored, **links}

    # For the barrier, which waits until all processes are linked.

    @property
    def presence(self) -> Presence:
        """Tokens of the run's other sessions that this process has handled."""
        return self._presence

    @property
    def shown(self) -> int:
        """How many tokens this process shows."""
        return len(self._nodes) + len(self._subscriptions) + len(self._outlets) + self._services.shown

    def unconnected(self, sessions: Collection[str]) -> list[str]:
        """Return the topics published here that one of these sessions cannot receive yet."""
        return sorted({outlet.publisher.topic for outlet in self._unreached(sessions)})

    def _unreached(self, sessions: Collection[str] | None = None) -> list[Outlet]:
        """Return the outlets whose topics one of these sessions, or of all, receives, but nothing from here yet."""
        if self._lines is not None:
            self._lines.read()
        wanted = self._presence.received(sessions)
        found = [(outlet, wanted.get(end.topic, ())) for end, outlet in self._outlets.items()]
        return [outlet for outlet, receivers in found if not all(map(outlet.reaches, receivers))]

    def _after_matching(self, question: Question) -> Question:
        """Wrap a question so that the outlets of topics with known subscriptions open before the answer."""

        def answer(arguments: Mapping[str, Any]) -> object:
            for outlet in self._unreached():
                outlet.check_subscribers()
            return question(arguments)

        return answer

    # Endpoints of this process.

    def _rosout_durability(self) -> Durability:
        """Return the durability that the publisher of `/rosout` needs for the subscriptions of this process's nodes."""
        ends = [end.endpoint for each in self._graph.supervisors for end in each.runtime.endpoints.subscriptions]
        latched = any(end.topic == ROSOUT and end.qos.latched for end in ends)
        return Durability.TRANSIENT_LOCAL if latched else Durability.VOLATILE

    def topic_added(self, topic: Topic[Any]) -> None:
        """Keep the topic's last messages for other terminals."""
        self._history.follow(topic)

    def publisher_added(self, publisher: Publisher[Any]) -> None:
        """Show a publisher; after a restart it takes the place of its predecessor."""
        if publisher.endpoint.remote:
            return
        topic = publisher.topic
        with self._showing(publisher.endpoint.origin):
            former = _predecessor(publisher, self._outlets, self._graph.bus.topics[topic].publishers)
            if former is None:
                token, expected = self._token_of(publisher), self._presence.deepest(topic)
                self._outlets[publisher] = Outlet(
                    publisher, token, self._connection, expected=expected, on_open=self._presence.notify
                )
                self._suit_receivers(topic)
            else:
                self._outlets[publisher] = outlet = self._outlets.pop(former)
                outlet.follow(publisher)
            publisher.remote_receivers = partial(self._receivers_of, publisher)

    def subscription_added(self, subscription: Subscription[Any]) -> None:
        """Show a subscription, and connect it with the publishers of other processes."""
        with self._showing(subscription.endpoint.origin):
            present = self._graph.bus.topics[subscription.topic].subscriptions
            former = _predecessor(subscription, self._subscriptions, present)
            if former is None:
                token = self._session.liveliness().declare_token(str(self._token_of(subscription)))
            else:
                token = self._subscriptions.pop(former)
            self._subscriptions[subscription] = token
            self._remote_publishers.serve(subscription, former)

    def server_added(self, server: Server[Any, Any]) -> None:
        """Show a server."""
        with self._showing(server.endpoint.origin):
            self._services.attach_server(server)
            self._service_events.offer(server.service)

    def client_added(self, client: Client[Any, Any]) -> None:
        """Show a client, and connect it with a server of another process."""
        with self._showing(client.endpoint.origin):
            self._services.attach_client(client)
            self._service_events.offer(client.service)

    def parameters_added(self, store: ParameterStore) -> None:
        """Answer for a node's parameters and log level."""
        with self._showing("a node"):
            store.is_shown = True
            self._services.attach_parameters(store)
            self._questions.parameter_log.follow(store)

    @contextmanager
    def _showing(self, origin: str) -> Generator[None]:
        try:
            yield
        except Exception as error:  # noqa: BLE001  # a node runs even if others cannot see it
            self._log.warning(f"other processes do not see {origin}: {type(error).__name__}: {error}")
        self._presence.notify()

    def endpoint_removed(self, end: AnyEndpoint) -> None:
        """Stop showing an endpoint."""
        if isinstance(end, Publisher | Subscription):
            self._left.setdefault(end.endpoint.node, set()).add(end.topic)
        if isinstance(end, Publisher):
            outlet = self._outlets.pop(end, None)
            if outlet is not None:
                outlet.close()
        elif isinstance(end, Subscription):
            token = self._subscriptions.pop(end, None)
            if token is not None:
                token.undeclare()
            self._remote_publishers.on_subscription_end(self._graph.bus.topics[end.topic])
        else:
            self._services.hide(end)
        self._presence.notify()

    def _token(self, kind: TokenKind, node: str, name: str, support: TypeSupport, qos: str) -> Token:
        """Make the token of a node's new endpoint on the topic or service `name`; `qos` is in token form."""
        node_id = self._node_id(node)
        self._ids += 1
        namespace, short = split_name(node)
        return Token(
            session=self._zid,
            node_id=node_id,
            entity_id=self._ids,
            kind=kind,
            namespace=namespace,
            node=short,
            topic=name,
            type=support.name,
            hash=support.type_hash,
            qos=qos,
            domain=self._connection.domain,
        )

    def _token_of(self, end: MirroredEndpoint) -> Token:
        kind = TokenKind.PUBLISHER if isinstance(end, Publisher) else TokenKind.SUBSCRIPTION
        endpoint = end.endpoint
        qos = to_text(endpoint.qos, is_request=kind is TokenKind.SUBSCRIPTION)
        return self._token(kind, endpoint.node, end.topic, self._supports(end.type), qos)

    def _node_id(self, name: str) -> int:
        """Return a node's number in its tokens; the first call declares the node."""
        found = self._node_ids.get(name)
        if found is None:
            self._ids += 1
            found = self._node_ids[name] = self._ids
            namespace, node = split_name(name)
            token = Token(self._zid, found, found, TokenKind.NODE, namespace, node, domain=self._connection.domain)
            self._nodes[name] = self._session.liveliness().declare_token(str(token))
        return found

    # Endpoints of other processes.

    def _on_token(self, text: str, alive: bool) -> None:
        if self._loop is None:
            return
        try:
            token = Token.parse(text)
        except MalformedMessage as error:
            self._log.debug(f"a token of another process cannot be read: {error}")
            return
        if token.session == self._zid:
            return
        try:
            self._handle(text, token, alive=alive)
        finally:
            self._presence.note(text, token, alive=alive)
            if token.kind is TokenKind.SUBSCRIPTION:
                self._expect(token.topic, has_come=alive)
                self._suit_receivers(token.topic)
                if (topic := self._graph.bus.topics.get(token.topic)) is not None:
                    topic.report_changes()

    def _expect(self, topic: str, *, has_come: bool) -> None:
        """Make a topic's publishers hold messages for a new remote subscription, or no more after the last one."""
        local, depth = self._graph.bus.topics.get(topic), self._presence.deepest(topic)
        if local is None or (depth and not has_come):
            return
        for end in local.publishers:
            if (outlet := self._outlets.get(cast("Publisher[Any]", end))) is not None:
                outlet.expect(depth)

    def _suit_receivers(self, topic: str) -> None:
        """Let a topic's publishers send under the keys of ROS 2 Humble too while nodes of it receive the topic."""
        receivers = self._presence.receivers(topic)
        for end, outlet in self._outlets.items():
            if end.topic == topic:
                type_name = self._supports(end.type).name
                outlet.reach_humble(is_there=any(each.has_type(type_name, HUMBLE) for each in receivers))

    def _receivers_of(self, publisher: Publisher[Any]) -> frozenset[Token]:
        """Return the subscriptions of other processes that match a publisher."""
        support, topic = self._supports(publisher.type), self._graph.bus.topics[publisher.topic]
        receivers = self._presence.receivers(publisher.topic)
        found = [each for each in receivers if each.has_type(support.name, support.type_hash)]
        return frozenset(each for each in found if _suffices(publisher, each, topic))

    def _handle(self, text: str, token: Token, *, alive: bool) -> None:
        if token.kind is TokenKind.SERVICE:
            self._services.on_token(text, token, alive=alive)
        elif token.kind is TokenKind.CLIENT and not alive:
            self._services.client_gone(token)
        elif token.kind is TokenKind.SUBSCRIPTION and token.topic == PARAMETER_EVENTS:
            self._announce_parameters()
        elif token.kind is TokenKind.SUBSCRIPTION and token.topic.endswith(SUFFIX):
            self._service_events.on_token(text, token, alive=alive)
        elif alive:
            self._remote_publishers.add(token)
        else:
            self._remote_publishers.remove(token)

    def _announce_parameters(self) -> None:
        """Make every node publish its parameter events from now on: another process subscribes to them."""
        for supervisor in self._graph.supervisors:
            supervisor.runtime.parameter_events.declare()

    def _on_route(self, key: str) -> None:
        """Open or close the outlets of a key, because a process has begun or ceased to receive it by a line."""
        for outlet in self._outlets.values():
            if outlet.key == key:
                outlet.check_routes()
        if self._loop is not None and self._reminder is None:
            self._reminder = self._loop.call_later(timeouts.current.departure, self._remind)

    def _remind(self) -> None:
        """Let processes look at their lines that receive a topic no more: a plugin may have closed the descriptors."""
        self._reminder = None
        if self._loop is not None and self._unreached():
            ask_processes(self._connection, lambda _answered: None)  # each looks at its lines before it answers

    def _on_loop(self, work: Any, *arguments: Any) -> None:
        """Call a function on the event loop, from any thread."""
        loop = self._loop
        if loop is not None:
            with suppress(RuntimeError):  # the loop has ended meanwhile: nothing is left to notify
                loop.call_soon_threadsafe(work, *arguments)

    def _log_bug(self, error: Exception) -> None:
        """Log an unexpected error; from any thread."""
        self._on_loop(lambda: self._log.error("unexpected error in a sender thread of busflow", exc_info=error))


def _predecessor(end: Any, known: Mapping[Any, object], present: list[Any]) -> Any:
    """Return the endpoint that this one replaces after a restart of the node, or None."""
    for each in known:
        if _place(each) == _place(end) and each is not end and each not in present:
            return each
    return None


def _suffices(publisher: Publisher[Any], receiver: Token, topic: Topic[Any]) -> bool:
    """Return whether a publisher offers the QoS that a subscription of another process requests."""
    try:
        check_qos(publisher.endpoint, remote_endpoint(receiver, topic))
    except BusflowError:
        return False
    return True


def _place(end: MirroredEndpoint) -> object:
    return end.endpoint.node, end.topic, end.endpoint.origin


class Presence:
    """Liveliness tokens of the run's other sessions that this process has handled, with listeners for changes."""

    def __init__(self) -> None:
        self.tokens: dict[str, Token] = {}
        """Tokens by their text. Two clients are not linked to each other: they get each other's tokens from a process
        of the run.
        """
        self.on_change: list[Callable[[], None]] = []
        self._depths: dict[str, dict[str, int]] = {}
        """By topic, the depth of each subscription, by its token's text."""

    def note(self, text: str, token: Token, *, alive: bool) -> None:
        """Record that a token has come or gone, after its effects have been handled."""
        if not alive:
            self.tokens.pop(text, None)
            self._depths.get(token.topic, {}).pop(text, None)
        else:
            self.tokens[text] = token
            if token.kind is TokenKind.SUBSCRIPTION:
                self._depths.setdefault(token.topic, {})[text] = _depth(token)
        self.notify()

    def deepest(self, topic: str) -> int:
        """Return the depth of the deepest subscription to a topic; 0 without any."""
        return max(self._depths.get(topic, {}).values(), default=0)

    def receivers(self, topic: str) -> list[Token]:
        """Return the subscriptions to a topic."""
        return [self.tokens[text] for text in self._depths.get(topic, ())]

    def notify(self) -> None:
        """Call the listeners."""
        for listener in tuple(self.on_change):
            listener()

    def count(self, session: str) -> int:
        """Return how many tokens of a session are known."""
        return sum(token.session == session for token in self.tokens.values())

    def received(self, sessions: Collection[str] | None = None) -> Mapping[str, set[str]]:
        """Return the topics to which nodes of these sessions, or of any session, subscribe, and which of them do."""
        found: dict[str, set[str]] = {}
        for token in self.tokens.values():
            if token.kind is TokenKind.SUBSCRIPTION and (sessions is None or token.session in sessions):
                found.setdefault(token.topic, set()).add(token.session)
        return found


def _depth(token: Token) -> int:
    try:
        return max(1, from_text(token.qos).depth)
    except MalformedMessage:
        return 1
