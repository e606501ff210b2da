"""Remote publishers: admits compatible publishers of other processes to this bus, and refuses the others.

A compatible publisher becomes one of its topic's publishers here, while a node here subscribes to the topic. For an
incompatible publisher one line is logged, and none of its messages is received: a mistake in another process does not
fail a node here.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from typing import TYPE_CHECKING, Any

from busflow import timeouts
from busflow.bus.bus import check_qos
from busflow.bus.names import is_hidden
from busflow.bus.subscription import Subscription
from busflow.errors import BusflowError
from busflow.wire.mirror.arrivals import Arrivals
from busflow.wire.mirror.inlet import TOKENS_TAKE, Inlet, remote_endpoint
from busflow.wire.zenoh.keys import Token, TokenKind
from busflow.wire.zenoh.session import links_of

if TYPE_CHECKING:
    from busflow.bus.endpoint import Endpoint
    from busflow.bus.topic import Topic
    from busflow.wire.mirror.connection import Connection

_MOST_LINES = 20
"""Limit of the lines in the log about refused publishers, by topic."""


class RemotePublishers:
    """Connects publishers of other processes with the subscriptions here."""

    def __init__(self, connection: Connection) -> None:
        self._connection, self._bus, self._log = connection, connection.bus, connection.log
        self._inlets: dict[str, Inlet] = {}
        self._known: dict[str, Token] = {}
        self._refused: set[str] = set()
        self._lines: Counter[str] = Counter()
        """By topic, the publishers that were refused so far."""
        self._arrivals: dict[str, Arrivals] = {}
        """By topic that is received, the numbers of the messages that have arrived."""
        self._lineless: set[str] = set()
        """The sessions without a line of which the log has a line."""

    def add(self, token: Token) -> None:
        """Admit or refuse a new publisher of another process; other endpoints change nothing here."""
        if token.kind is TokenKind.PUBLISHER:
            self._known[str(token)] = token
            self._consider(token)

    def remove(self, token: Token) -> None:
        """Remove a publisher of another process, once its last messages are published."""
        self._refused.discard(str(token))
        inlet = self._inlets.get(token.topic)
        if self._known.pop(str(token), None) is not None and inlet is not None:
            inlet.dismiss(token, lambda: self._close_if_unused(token.topic))

    def serve(self, subscription: Subscription[Any], former: Subscription[Any] | None) -> None:
        """Connect a new subscription with the compatible publishers of its topic, and exclude the others.

        After a restart of its node it has the place, the queue and the messages of its predecessor, `former`. With
        nodes of ROS 2 the topic is received from now on: `ros2 topic pub --once` publishes as soon as it sees this.
        """
        if (arrivals := self._arrivals.get(subscription.topic)) is not None:
            arrivals.add(subscription, former, self._bus.topics[subscription.topic].subscriptions)
        for token in self._known_on(subscription.topic):
            self._consider(token)
        if self._connection.describes_types:
            self._inlet(self._bus.topics[subscription.topic])
        inlet = self._inlets.get(subscription.topic)
        if inlet is not None:
            inlet.suit()
            if former is None:
                inlet.serve(subscription)

    def on_subscription_end(self, topic: Topic[Any]) -> None:
        """Handle the end of a subscription: it was the topic's last, or publishers that it excluded may fit now."""
        if topic.subscriptions:
            for token in self._known_on(topic.name):
                self._consider(token)
            if (inlet := self._inlets.get(topic.name)) is not None:
                inlet.suit()
        else:
            self._arrivals.pop(topic.name, None)
            if topic.name in self._inlets:
                self._inlets.pop(topic.name).close()

    def close(self) -> None:
        """Stop receiving. The caller closes the session before, which ends a waiting recv()."""
        for inlet in self._inlets.values():
            inlet.close()
        self._inlets.clear()
        self._known.clear()

    def _known_on(self, topic: str) -> list[Token]:
        """Return the tokens of the topic's remote publishers."""
        return [token for token in self._known.values() if token.topic == topic]

    def _consider(self, token: Token) -> None:
        """Admit or refuse a publisher, by the subscriptions that exist now."""
        topic = self._bus.topics.get(token.topic)
        if topic is None or not topic.subscriptions:
            return
        try:
            endpoint = self._checked_endpoint(token, topic)
            self._inlet(topic).admit(token, endpoint)
        except BusflowError as error:
            self._refuse(token, str(error))
        else:
            self._refused.discard(str(token))

    def _checked_endpoint(self, token: Token, topic: Topic[Any]) -> Endpoint:
        """Return the endpoint of a remote publisher that fits the topic and its subscriptions.

        Raises:
            BusflowError: it does not fit.
        """
        support = self._connection.supports(topic.type)
        if not token.has_type(support.name, support.type_hash):
            if token.type == support.name:
                raise BusflowError(f"it publishes another definition of {token.type}; busflow doctor compares both")
            raise BusflowError(f"it publishes {token.type}, not {support.name}")
        endpoint = remote_endpoint(token, topic)
        for subscription in topic.subscriptions:
            check_qos(endpoint, subscription.endpoint)
        return endpoint

    def _refuse(self, token: Token, why: str) -> None:
        """Receive nothing of a publisher any more, and log the reason once."""
        inlet = self._inlets.get(token.topic)
        if inlet is not None:
            inlet.ignore(token)
            self._close_if_unused(token.topic)
        if str(token) not in self._refused:
            self._refused.add(str(token))
            self._lines[token.topic] += 1
            if self._lines[token.topic] <= _MOST_LINES:
                self._log.warning(f"{token.node_name} in another process is not received on {token.topic}: {why}")
            if self._lines[token.topic] == _MOST_LINES:
                self._log.warning(f"further publishers that are not received on {token.topic} are not named here")

    def _inlet(self, topic: Topic[Any]) -> Inlet:
        found = self._inlets.get(topic.name)
        if found is None:
            arrivals = self._arrivals.setdefault(topic.name, Arrivals(topic))
            found = self._inlets[topic.name] = Inlet(
                topic, self._connection, arrivals=arrivals, on_lineless=self._note_lineless
            )
            for token in self._known_on(topic.name):
                if str(token) in self._refused:
                    found.ignore(token)
        return found

    def _note_lineless(self, session: str) -> None:
        """Log that there is no line to a process of this machine, once it is known that it has not just ended."""
        if self._connection.lines is not None:
            delay_s = TOKENS_TAKE * timeouts.current.departure
            asyncio.get_running_loop().call_later(delay_s, self._warn_of_zenoh, session)

    def _warn_of_zenoh(self, session: str) -> None:
        """Log once why a process of this machine is received through Zenoh; a terminal's command always is."""
        lines, names = (
            self._connection.lines,
            {each.node_name for each in self._known.values() if each.session == session},
        )
        nodes = sorted(name for name in names if not is_hidden(name))
        if lines is None or session in self._lineless or not nodes:
            return
        self._lineless.add(session)
        if links_of(self._connection.session).get(session, "").startswith("unixsock"):
            why = lines.refusals.get(session, "the line to it has ended")
            self._log.warning(f"messages of the process of {', '.join(nodes)} come through Zenoh: {why}")

    def _close_if_unused(self, topic: str) -> None:
        inlet = self._inlets.get(topic)
        if inlet is not None and inlet.is_unused and not self._connection.describes_types:
            self._inlets.pop(topic).close()
