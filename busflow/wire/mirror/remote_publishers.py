"""Neighbours: the publishers of other processes, and which of them publish on this bus.

One that fits is let in as a publisher of its topic, for as long as somebody here receives the topic. One that does not
fit is told in the log, once, and nothing of it is received: what others do wrong is no fault of a node here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from busflow.bus.bus import check_qos
from busflow.bus.subscription import Subscription
from busflow.errors import BusflowError
from busflow.wire.mirror.inlet import Inlet, remote_endpoint
from busflow.wire.zenoh.keys import Token, TokenKind

if TYPE_CHECKING:
    from busflow.bus.endpoint import Endpoint
    from busflow.bus.topic import Topic
    from busflow.wire.mirror.connection import Connection

_MOST = 10_000
"""Endpoints of other processes that are kept in mind: whoever shows more is at fault, or means harm."""


class RemotePublishers:
    """What publishers elsewhere send to the subscriptions here."""

    def __init__(self, connection: Connection) -> None:
        self._connection, self._bus, self._log = connection, connection.bus, connection.log
        self._inlets: dict[str, Inlet] = {}
        self._known: dict[str, Token] = {}
        self._refused: set[str] = set()
        self._gone: dict[str, dict[bytes, int]] = {}
        """By topic, how far publishers had come that were seen to go while their topic was received."""

    def come(self, token: Token) -> None:
        """An endpoint of another process is there."""
        if token.kind is TokenKind.PUBLISHER and len(self._known) < _MOST:
            self._known[str(token)] = token
            self._consider(token)

    def go(self, token: Token) -> None:
        """An endpoint of another process is there no more."""
        self._refused.discard(str(token))
        inlet = self._inlets.get(token.topic)
        if self._known.pop(str(token), None) is not None and inlet is not None:
            inlet.dismiss(token, lambda: self._close_if_unused(token.topic))

    def serve(self, subscription: Subscription[Any], *, is_new: bool) -> None:
        """A subscription has come: let those in who publish its topic, or out who do not fit.

        Unless it is new, it has the place, the queue and the messages of one before it.
        """
        for token in self._on(subscription.topic):
            self._consider(token)
        inlet = self._inlets.get(subscription.topic)
        if is_new and inlet is not None:
            inlet.serve(subscription)

    def leave(self, topic: Topic[Any]) -> None:
        """A subscription has gone: without any there is nothing to receive, and others may fit now."""
        if topic.subscriptions:
            for token in self._on(topic.name):
                self._consider(token)
        else:
            self._gone.pop(topic.name, None)
            if topic.name in self._inlets:
                self._inlets.pop(topic.name).close()

    def close(self) -> None:
        """Receive nothing more; the session has to be closed before, which ends a waiting recv()."""
        for inlet in self._inlets.values():
            inlet.close()
        self._inlets.clear()

    def _on(self, topic: str) -> list[Token]:
        return [token for token in self._known.values() if token.topic == topic]

    def _consider(self, token: Token) -> None:
        """Let a publisher in, or keep it out, as the subscriptions here are now."""
        topic = self._bus.topics.get(token.topic)
        if topic is None or not topic.subscriptions:
            return
        try:
            endpoint = self._fitting(token, topic)
            self._inlet(topic).admit(token, endpoint)
        except BusflowError as error:
            self._refuse(token, str(error))
        else:
            self._refused.discard(str(token))

    def _fitting(self, token: Token, topic: Topic[Any]) -> Endpoint:
        """What a publisher elsewhere is here.

        Raises:
            BusflowError: it does not fit.
        """
        support = self._connection.supports(topic.type)
        if (token.type, token.hash) != (support.name, support.type_hash):
            offered = f"another definition of {token.type}" if token.type == support.name else token.type
            raise BusflowError(f"it publishes {offered}, not {support.name}")
        endpoint = remote_endpoint(token, topic)
        for subscription in topic.subscriptions:
            check_qos(endpoint, subscription.endpoint)
        return endpoint

    def _refuse(self, token: Token, why: str) -> None:
        inlet = self._inlets.get(token.topic)
        if inlet is not None:
            inlet.ignore(token)
            self._close_if_unused(token.topic)
        if str(token) not in self._refused:
            self._refused.add(str(token))
            self._log.warning(f"{token.node_name} in another process is not received on {token.topic}: {why}")

    def _inlet(self, topic: Topic[Any]) -> Inlet:
        found = self._inlets.get(topic.name)
        if found is None:
            gone = self._gone.setdefault(topic.name, {})
            found = self._inlets[topic.name] = Inlet(topic, self._connection, gone=gone)
            for token in self._on(topic.name):
                if str(token) in self._refused:
                    found.ignore(token)
        return found

    def _close_if_unused(self, topic: str) -> None:
        inlet = self._inlets.get(topic)
        if inlet is not None and inlet.is_unused:
            self._inlets.pop(topic).close()
