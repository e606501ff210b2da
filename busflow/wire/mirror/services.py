"""ServiceMirror: shows a bus's services to other processes, and connects the bus with the services of others."""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import zenoh

from busflow.actions.names import SEND_GOAL, action_of, action_type_of
from busflow.bus.services.client import Client
from busflow.bus.services.server import Server
from busflow.errors import BusflowError
from busflow.interfaces.message import ServiceType
from busflow.node.parameter_store import ParameterStore
from busflow.wire.mirror.goal_outlet import GoalOutlet, forget_client
from busflow.wire.mirror.service_inlet import RemoteServer
from busflow.wire.mirror.service_outlet import ServiceOutlet
from busflow.wire.queries.logger_services import LoggerServices
from busflow.wire.queries.parameter_services import ParameterServices
from busflow.wire.zenoh.keys import HUMBLE, Token, TokenKind

if TYPE_CHECKING:
    from busflow.bus.services.service import Service
    from busflow.interfaces.encoding.typesupport import TypeSupport
    from busflow.interfaces.message import Message
    from busflow.log import Log
    from busflow.wire.mirror.connection import Connection

Shown = Server[Any, Any] | Client[Any, Any] | ParameterStore
CALLER = "another process"
"""The caller's name in a server's log."""
MakeToken = Callable[[TokenKind, str, str, "TypeSupport", str], Token]
"""Makes a token with its own number, from kind, node, service, type and QoS."""


class ServiceMirror:
    """Shows local servers and clients to other processes, and connects remote servers with local clients."""

    def __init__(self, connection: Connection, make_token: MakeToken, log: Log) -> None:
        """Create a mirror of services; `log` is the run's log, whose levels the nodes' logger services set."""
        self._connection, self._make_token, self._log = connection, make_token, connection.log
        self._levels = log
        self._bus, self._session, self._supports = connection.bus, connection.session, connection.supports
        self._shown: dict[Shown, list[zenoh.LivelinessToken]] = {}
        self._gids: dict[str, bytes] = {}
        self._outlets: dict[Shown, list[ServiceOutlet]] = {}
        self._remote: dict[str, Token] = {}
        self._servers: dict[str, RemoteServer] = {}

    @property
    def shown(self) -> int:
        """The number of tokens that show local endpoints."""
        return sum(map(len, self._shown.values()))

    def attach_server(self, server: Server[Any, Any]) -> None:
        """Show a server; it answers before it is shown, since a client may call at once."""
        self._outlets[server] = [self._outlet_of(self._bus.services[server.service])]
        self._show(server, TokenKind.SERVICE)

    def attach_client(self, client: Client[Any, Any]) -> None:
        """Show a client, and connect it with a server of another process, if there is one."""
        self._gids[client.service] = self._show(client, TokenKind.CLIENT).gid
        for remote in [each for each in self._remote.values() if each.topic == client.service]:
            self._admit(remote)

    def _show(self, end: Server[Any, Any] | Client[Any, Any], kind: TokenKind) -> Token:
        token = self._make_token(kind, end.endpoint.node, end.service, self._supports(end.type), _QOS)
        self._shown[end] = [self._session.liveliness().declare_token(str(token))]
        return token

    def attach_parameters(self, store: ParameterStore) -> None:
        """Answer ROS 2's services for a node's parameters and log level; a restart replaces the former store."""
        self.detach_parameters(store.node)
        self._shown[store], self._outlets[store] = [], []
        parameters = ParameterServices(store, is_for_ros2=self._connection.describes_types)
        services = [*parameters.all(), *LoggerServices(self._levels, store.node).all()]
        if self._connection.describes_types:
            from busflow.wire.queries.type_services import TypeServices  # with messages that only ROS 2's nodes need

            services += TypeServices(self._bus, self._supports, store.node).all()
        for name, service_type, answer in services:
            token = self._make_token(TokenKind.SERVICE, store.node, name, self._supports(service_type), _QOS)
            self._outlets[store].append(self._outlet(name, service_type, answer))
            self._shown[store].append(self._session.liveliness().declare_token(str(token)))

    def detach_parameters(self, node: str) -> None:
        """Stop answering for the parameters and the log level of a node."""
        for former in [each for each in self._shown if isinstance(each, ParameterStore) and each.node == node]:
            self.hide(former)

    def hide(self, shown: Shown) -> None:
        """Stop showing an endpoint, or the services of a node's parameters."""
        for token in self._shown.pop(shown, ()):
            token.undeclare()
        for outlet in self._outlets.pop(shown, ()):
            outlet.close()

    def on_token(self, text: str, token: Token, *, alive: bool) -> None:
        """Handle a server of another process that has come or gone."""
        if alive:
            self._remote[text] = token
            self._admit(token)
        elif self._remote.pop(text, None):
            server = self._servers.pop(text, None)
            if server is not None:
                server.close()
                for other in [each for each in self._remote.values() if each.topic == token.topic]:
                    self._admit(other)

    def close(self) -> None:
        """Fail all calls that wait for another process; the session is closed before."""
        for server in self._servers.values():
            server.close()

    def _admit(self, token: Token) -> None:
        """Connect local clients with a remote server, if there are clients and no server yet."""
        service = self._bus.services.get(token.topic)
        if service is None or not service.clients or service.server is not None:
            return
        support = self._supports(service.type)
        if not token.has_type(support.name, support.type_hash):
            self._warn_of_type(token, support.name)
            return
        try:
            key, gid = self._connection.key(service.name, support, token.hash), self._gids[service.name]
            self._servers[str(token)] = RemoteServer(service, token, key, self._connection, gid=gid)
        except BusflowError as error:
            self._log.warning(f"{token.node_name} in another process is not called for {service.name}: {error}")

    def _warn_of_type(self, token: Token, own: str) -> None:
        """Log that a remote server's type is not that of the local clients; once for all parts of an action."""
        action, kind = action_of(token.topic), action_type_of(token.type) or token.type
        if action is not None and not token.topic.endswith(SEND_GOAL):
            return
        what, so = (token.topic, "is not called") if action is None else (f"the action {action}", "gets no goals")
        how = "with another definition" if token.type == own else f"as {kind}"
        self._log.warning(f"{token.node_name} in another process serves {what} {how}: it {so}")

    def client_gone(self, token: Token) -> None:
        """Handle the end of another process's client."""
        service = self._bus.services.get(token.topic)
        if service is not None:
            # after the first step of each of its requests, whose tasks were created before
            asyncio.get_running_loop().call_soon(forget_client, service, token.gid)

    def _outlet_of(self, service: Service[Any, Any]) -> ServiceOutlet:
        if action_of(service.name) is None:
            return self._outlet(service.name, service.type, partial(service.call, caller=CALLER))
        return GoalOutlet(service, self._keys(service.name, service.type), self._connection, caller=CALLER)

    def _outlet(
        self, name: str, service_type: type[ServiceType], answer: Callable[[Any], Awaitable[Message]]
    ) -> ServiceOutlet:
        return ServiceOutlet(name, service_type, answer, self._keys(name, service_type), self._connection)

    def _keys(self, service: str, service_type: type[ServiceType]) -> list[str]:
        """Return the keys of a service's requests: with nodes of ROS 2 also Humble's.

        A node of Humble may call as soon as it sees the server, so that key cannot wait until one is there.
        """
        hashes = ("", HUMBLE) if self._connection.describes_types else ("",)
        return [self._connection.key(service, self._supports(service_type), each) for each in hashes]


_QOS = "::,10:,:,:,,"
"""ROS 2's QoS for services: reliable, volatile, ten requests deep."""
