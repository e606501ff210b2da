"""RemoteServer: stands in for a server of another process, so that local clients can call it."""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any

import zenoh

from busflow.actions.names import action_of
from busflow.bus.services.call import Activity, Call
from busflow.bus.services.service import Service
from busflow.errors import MalformedMessage, ServiceFailed, ServiceGone, ServiceUnavailable
from busflow.text import printable
from busflow.wire.mirror.connection import decoded
from busflow.wire.zenoh.keys import ATTACHMENT_BYTES, PATIENCE, REMARKS, Attachment, Token
from busflow.wire.zenoh.refusal import service_refusal

if TYPE_CHECKING:
    from busflow.wire.mirror.connection import Connection

_WAITING = 1000
"""Limit of the calls that wait for one remote server."""
_MOST_REMARK = 400
"""Characters of a remark that are kept."""
_MOST_DIGITS = 20
"""Limit of a number beside an answer."""
_FOREVER_S = 10 * 365 * 86_400
"""Zenoh's time limit of a query, which it requires; a call has its own limit."""


class RemoteServer:
    """Answers local calls by querying the server's process."""

    def __init__(
        self, service: Service[Any, Any], token: Token, key: str, connection: Connection, *, gid: bytes
    ) -> None:
        """Accept the service's calls from now on.

        Raises:
            DuplicateServer: the service has another server already.
        """
        self.token = token
        self._service, self._key, self._gid = service, key, gid
        self._session, self._sender, self._on_loop = connection.session, connection.replier, connection.on_loop
        self._request, self._response = map(connection.supports, (service.type.Request, service.type.Response))
        self._clock = connection.bus.clock
        self._call_count = 0
        self._waiting: dict[Call[Any, Any], zenoh.CancellationToken] = {}
        service.join(self)

    @property
    def node(self) -> str:
        """The full name of the server's node."""
        return self.token.node_name

    def holder(self, call: Call[Any, Any]) -> Activity | None:  # noqa: ARG002  # of any call
        """Return None: this process does not know the activity of a remote server. A call has its time limit."""
        return None

    def accept(self, call: Call[Any, Any]) -> None:
        """Send the call to the other process.

        Raises:
            ServiceUnavailable: too many calls wait for this server already.
            MalformedMessage: the request cannot be encoded.
        """
        if len(self._waiting) >= _WAITING:
            raise ServiceUnavailable(f"{_WAITING} calls of {self._service.name} wait for its server already")
        payload = self._request.encode(call.request)
        self._call_count += 1
        attachment = Attachment(self._call_count, self._clock.now().nanoseconds, self._gid).encode()
        self._waiting[call] = zenoh.CancellationToken()
        self._sender.hand(partial(self._query, call, self._waiting[call], payload, attachment))

    def withdraw(self, call: Call[Any, Any]) -> None:
        """Cancel a call that no task waits for any more."""
        token = self._waiting.pop(call, None)
        if token is not None:
            cancel: Any = token.cancel
            self._sender.hand(cancel)

    def statistics(self) -> None:
        """Return nothing: the server's process keeps its statistics."""

    def close(self) -> None:
        """Fail all waiting calls, because the server has gone."""
        waiting, self._waiting = self._waiting, {}
        for call in waiting:
            call.fail(ServiceGone(f"{self._service.name}: the process of {self.node} ended before it had answered"))
        if self._service.server is self:
            self._service.leave(self)

    def _query(self, call: Call[Any, Any], token: zenoh.CancellationToken, payload: bytes, attachment: bytes) -> None:
        """Send the query. The sender's thread runs this, because a stalled link would block the loop."""

        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                self._on_loop(self._succeed, call, reply.ok.payload, *_beside(reply.ok))
            elif reply.err is not None:
                self._on_loop(self._fail, call, reply.err.payload.to_bytes())

        def end() -> None:
            self._on_loop(self._fail, call, b"")

        with suppress(zenoh.ZError):  # the session is closed: the run ends
            self._session.get(
                self._key + self._parameters(call),
                zenoh.handlers.Callback(on_reply, drop=end, indirect=False),
                payload=payload,
                attachment=attachment,
                target=zenoh.QueryTarget.ALL_COMPLETE,
                consolidation=zenoh.ConsolidationMode.NONE,
                timeout=_FOREVER_S,
                cancellation_token=token,
            )

    def _parameters(self, call: Call[Any, Any]) -> str:
        stated = [] if call.limit_s is None else [f"{PATIENCE}={call.limit_s}"]
        stated += [f"{REMARKS}=2"] if action_of(self._service.name) else []
        return f"?{';'.join(stated)}" if stated else ""

    def _succeed(self, call: Call[Any, Any], payload: zenoh.ZBytes, remark: str, feedback_count: int) -> None:
        if self._waiting.pop(call, None) is None:
            return
        call.remark, call.feedback_count = remark, feedback_count
        try:
            call.succeed(decoded(payload, self._response))
        except MalformedMessage as error:
            call.fail(ServiceFailed(f"{self._service.name}: the answer of {self.node} is malformed: {error}"))

    def _fail(self, call: Call[Any, Any], reply: bytes) -> None:
        if self._waiting.pop(call, None) is not None:
            call.fail(service_refusal(self._service.name, self.node, reply))


def _beside(sample: zenoh.Sample) -> tuple[str, int]:
    """Return text and number behind the attachment of an answer, which only busflow's servers of actions write."""
    attachment = b"" if sample.attachment is None else sample.attachment.to_bytes()
    text, _, digits = attachment[ATTACHMENT_BYTES:].partition(b"\0")
    number = int(digits) if digits.isdigit() and len(digits) < _MOST_DIGITS else 0
    return printable(text.decode(errors="replace"), limit=_MOST_REMARK), number
