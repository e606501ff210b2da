"""GoalOutlet: lets clients of other processes send goals to a server of this one, and ends what a lost client leaves.

Of a busflow client more is known than of ROS 2's: it states its time limit, and its gid is that of its token. So when
its token goes, its goals are canceled. A goal of a ROS 2 client outlives it, as in ROS 2.
"""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from busflow.actions.names import SEND_GOAL
from busflow.errors import MalformedMessage
from busflow.wire.mirror.service_outlet import ServiceOutlet
from busflow.wire.zenoh.keys import REMARKS, Attachment

if TYPE_CHECKING:
    import zenoh

    from busflow.bus.services.call import Call
    from busflow.bus.services.service import Service
    from busflow.interfaces.message import Message
    from busflow.wire.mirror.connection import Connection

MOST_REMARK_BYTES = 2000
"""The longest remark that is sent or read."""


class GoalOutlet(ServiceOutlet):
    """Passes requests of an action's service to the local server; an answer may have a remark."""

    def __init__(self, service: Service[Any, Any], keys: Iterable[str], connection: Connection, *, caller: str) -> None:
        """Start to answer; `caller` is the name of clients that state no gid."""
        self._service, self._caller = service, caller
        super().__init__(service.name, service.type, self._unused, keys, connection)

    async def _unused(self, _request: object) -> Message:
        raise NotImplementedError  # `_ask` is called in its place

    async def _ask(self, query: zenoh.Query, request: Message) -> tuple[Message, str]:
        call = self._service.begin(request, caller=self._name_of(query))
        try:
            response = await call.reply
            return response, self._remark(query, call)
        finally:
            self._service.end(call)

    def _remark(self, query: zenoh.Query, call: Call[Any, Any]) -> str:
        """Return what the client reads beside the answer: nothing if it is one of ROS 2's."""
        from busflow.actions.endpoints import ResultServer  # here already, unless the process serves no action

        asked, server = query.parameters.get(REMARKS), self._service.server
        if asked == "2" and isinstance(server, ResultServer):
            return f"{call.remark}\0{server.feedback_count(call)}"
        return call.remark if asked else ""

    def _name_of(self, query: zenoh.Query) -> str:
        """Return the caller's name, by which its goals are found when its token goes."""
        if query.attachment is None or not query.parameters.get(REMARKS):
            return self._caller
        try:
            return caller_of(Attachment.decode(query.attachment.to_bytes()).gid)
        except MalformedMessage:
            return self._caller


def caller_of(gid: bytes) -> str:
    """Return the name of the client with this gid.

    >>> caller_of(bytes(16))
    'client 00000000000000000000000000000000 of another process'
    """
    return f"client {gid.hex()} of another process"


def forget_client(service: Service[Any, Any], gid: bytes) -> None:
    """Cancel the goals of a client of another process that has gone."""
    if service.name.endswith(SEND_GOAL):
        from busflow.actions.endpoints import GoalServer  # here already, unless the process serves no action

        if isinstance(service.server, GoalServer):
            service.server.forget(caller_of(gid))
