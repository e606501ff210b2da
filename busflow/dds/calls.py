"""Services across the bridge: `RunServer` answers neighbours from the run, `NeighbourServer` the run from a neighbour.

A request and its response begin with 16 bytes in which `rmw_cyclonedds` names the client and counts its calls. Fast DDS
writes none: it names the request in the inline QoS of the response (its related sample identity), which Cyclone neither
writes nor reads. Each would take the other's header for fields, so services go between Cyclone's participants alone.

Source: ros2/rmw_cyclonedds 3.2, `serdata.hpp` and `rmw_node.cpp`; ros2/rmw_fastrtps 9.2, `rmw_response.cpp`.
"""

# The stubs of zenoh and cyclonedds leave out what many of their functions take and return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import struct
import threading
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import zenoh
from cyclonedds.core import DDSException

from busflow.dds.names import DdsName, NameUse, is_of_cyclone, service_end_id, user_data
from busflow.dds.qos import SERVICE, stated_user_data
from busflow.errors import ServiceGone, ServiceUnavailable
from busflow.wire.queries.server import replying
from busflow.wire.zenoh.keys import Attachment
from busflow.wire.zenoh.refusal import encode_refusal, service_refusal

if TYPE_CHECKING:
    from busflow.dds.carried import Carried
    from busflow.dds.idl import Carriers
    from busflow.dds.participant import Intake, Participant
    from busflow.wire.client.client import Peer, ServiceKind
    from busflow.wire.zenoh.sender import SenderThread

OTHER_SERVICES = "a neighbour with another DDS than Cyclone, such as Fast DDS, has services: these do not cross"
"""The log's line about clients and servers that are neither answered nor called."""
_HEADER = struct.Struct("<Qq")
_ENCAPSULATION = 4
_UNSIGNED = (1 << 64) - 1
"""Mask that makes a handle unsigned: cyclonedds returns it as a signed number."""
_BODY = _ENCAPSULATION + _HEADER.size
_WAITING = 1000
"""Calls of one service that may wait for an answer."""
_FOREVER_S = 10 * 365 * 86_400
"""Zenoh's time limit of a query, which it requires: ROS 2's clients have none."""
_PIECE_S = 0.01
"""Interval of the checks whether the other side's reader is known."""
_CLIENT_PIECES = 10
"""Number of these checks for a client that has asked: 100 ms, as in ROS 2."""
_SERVER_PIECES = 100
"""Number of these checks for a server that has just come; after them the first request is written all the same."""


@dataclass(slots=True)
class BridgeParts:
    """Parts that all topics and services share: the run, this participant, the thread that writes requests, counts."""

    peer: Peer
    participant: Participant
    intake: Intake
    carriers: Carriers
    carried: Carried
    sender: SenderThread
    _ids: int = 0

    @property
    def session(self) -> zenoh.Session:
        """The run's session."""
        return self.peer.session

    def ends(self, kind: ServiceKind, *, is_server: bool) -> tuple[Any, Any, Any]:
        """Return a new reader and writer of a service, and the class of what is written.

        Raises:
            UnknownType: DDS cannot describe a type of the service.
        """
        self._ids += 1
        stated = {"serviceid" if is_server else "clientid": service_end_id(self.participant.gid, self._ids)}
        request, reply = DdsName(NameUse.REQUEST, kind.name), DdsName(NameUse.REPLY, kind.name)
        types = {request: kind.request, reply: kind.response}
        read, written = (request, reply) if is_server else (reply, request)
        carriers = {name: self.carriers.of(type_, is_half_of_service=True) for name, type_ in types.items()}
        data = {name: user_data(**stated, typehash=type_.type_hash) for name, type_ in types.items()}
        writer = self.participant.writer(written, carriers[written], SERVICE, data[written])
        reader = self.participant.reader(read, carriers[read], SERVICE, data[read])
        return reader, writer, carriers[written]

    def write(self, service: str, writer: Any, sample: Any) -> None:
        """Write a request or response; called in the sender's thread."""
        try:
            writer.write(sample)
        except DDSException as error:
            self.carried.dropped += 1
            self.carried.warn(f"{service}: a request or answer is not carried to DDS: {error.msg}")


class RunServer:
    """Shows a server of the run to neighbours, and answers their requests with its answers."""

    def __init__(self, kind: ServiceKind, parts: BridgeParts) -> None:
        """Begin to answer.

        Raises:
            UnknownType: DDS cannot describe a type of the service.
        """
        self._kind, self._parts = kind, parts
        self._key = parts.peer.key(kind)
        self._count = 0
        self._waiting: set[tuple[int, bytes]] = set()
        self._closed = threading.Event()
        self._reader, self._writer, self._carrier = parts.ends(kind, is_server=True)
        parts.intake.add(self._reader, self._on_requests)

    @property
    def gids(self) -> tuple[bytes, bytes]:
        """The gids in DDS of its reader and its writer."""
        return self._reader.guid.bytes, self._writer.guid.bytes

    def close(self) -> None:
        """Answer no more."""
        self._closed.set()
        self._parts.intake.remove(self._reader)

    def _on_requests(self, samples: list[Any]) -> None:
        for sample in samples:
            if not sample.sample_info.valid_data:
                continue
            header = sample.payload[_ENCAPSULATION:_BODY]
            client = sample.sample_info.publication_handle
            asking = self._reader.get_matched_publication_data(client)
            if asking is not None and not is_of_cyclone(asking.key.bytes):  # its fields begin where a header would be
                self._parts.carried.warn(OTHER_SERVICES)
                continue
            if len(self._waiting) >= _WAITING:
                self._parts.carried.dropped += 1
                self._parts.carried.warn(f"{self._kind.name}: {_WAITING} requests of neighbours wait already")
                continue
            self._waiting.add((client, header))
            payload = _without_header(sample.payload)
            self._parts.sender.hand(partial(self._ask, header, payload, client), len(payload))

    def _ask(self, header: bytes, payload: bytes, client: int) -> None:
        self._count += 1

        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                answer = reply.ok.payload.to_bytes()
                self._parts.sender.hand(partial(self._answer, header, answer, client), len(answer))
            elif reply.err is not None:
                why = service_refusal(self._kind.name, "its server", reply.err.payload.to_bytes())
                self._parts.carried.warn(f"{self._kind.name}: a neighbour's request has no answer: {why}")

        self._parts.session.get(
            self._key,
            zenoh.handlers.Callback(on_reply, drop=lambda: self._waiting.discard((client, header)), indirect=False),
            payload=payload,
            attachment=Attachment(self._count, 0, self._writer.guid.bytes).encode(),
            target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=_FOREVER_S,
        )

    def _answer(self, header: bytes, payload: bytes, client: int) -> None:
        """Write the answer, once the reader of the client that has asked is known here, or after 100 ms."""
        for _ in range(_CLIENT_PIECES):
            if self._knows_reader_of(client) or self._closed.wait(_PIECE_S):
                break
        sample = self._carrier.of(_with_header(header, payload))
        self._parts.write(self._kind.name, self._writer, sample)
        self._parts.carried.calls += 1

    def _knows_reader_of(self, client: int) -> bool:
        asking = self._reader.get_matched_publication_data(client)
        if asking is None or not (wanted := _client_id(asking)):  # it has gone, or does not say
            return True
        readers = (self._writer.get_matched_subscription_data(each) for each in self._writer.matched_sub)
        return any(reader is not None and _client_id(reader) == wanted for reader in readers)


class NeighbourServer:
    """Shows a neighbour's server to the run, and answers its clients with the neighbour's answers."""

    def __init__(self, kind: ServiceKind, parts: BridgeParts) -> None:
        """Begin to answer.

        Raises:
            UnknownType: DDS cannot describe a type of the service.
        """
        self._kind, self._parts = kind, parts
        self._count = 0
        self._waiting: dict[int, zenoh.Query] = {}
        self._lock = threading.Lock()
        self._reader, self._writer, self._carrier = parts.ends(kind, is_server=False)
        self._own = self._writer.instance_handle & _UNSIGNED
        self._closed = threading.Event()
        parts.intake.add(self._reader, self._on_replies)
        self._queryable: Any = parts.session.declare_queryable(
            parts.peer.key(kind), zenoh.handlers.Callback(self._on_query, indirect=False), complete=True
        )

    @property
    def name(self) -> str:
        """The full name of the service."""
        return self._kind.name

    @property
    def gids(self) -> tuple[bytes, bytes]:
        """The gids in DDS of its reader and its writer."""
        return self._reader.guid.bytes, self._writer.guid.bytes

    def close(self) -> None:
        """Answer no more; clients that wait get an error."""
        self._closed.set()
        self._queryable.undeclare()
        self._parts.intake.remove(self._reader)
        with self._lock:
            waiting, self._waiting = self._waiting, {}
        for query in waiting.values():
            self._refuse(query, ServiceGone(f"{self._kind.name}: its server, a neighbour in DDS, has gone"))

    def _on_query(self, query: zenoh.Query) -> None:
        with self._lock:
            self._count += 1
            number, is_full = self._count, len(self._waiting) >= _WAITING
            if not is_full:
                self._waiting[number] = query
        if is_full:
            self._refuse(query, ServiceUnavailable(f"{_WAITING} requests of {self._kind.name} wait already"))
            return
        payload = query.payload.to_bytes() if query.payload is not None else b""
        sample = self._carrier.of(_with_header(_HEADER.pack(self._own, number), payload))
        self._parts.sender.hand(partial(self._send, sample), len(payload))

    def _send(self, sample: Any) -> None:
        """Write a request, once the reader and the writer of the server are known here."""
        for _ in range(_SERVER_PIECES):
            if (self._writer.matched_sub and self._reader.matched_pub) or self._closed.wait(_PIECE_S):
                break
        self._parts.write(self._kind.name, self._writer, sample)

    def _on_replies(self, samples: list[Any]) -> None:
        for sample in samples:
            if not sample.sample_info.valid_data:
                continue
            client, number = _HEADER.unpack_from(sample.payload, _ENCAPSULATION)
            if client != self._own:  # an answer for another client
                continue
            with self._lock:
                query = self._waiting.pop(number, None)
            if query is not None:
                payload = _without_header(sample.payload)
                self._parts.sender.hand(partial(self._reply, query, payload), len(payload))
                self._parts.carried.calls += 1

    def _reply(self, query: zenoh.Query, payload: bytes) -> None:
        with replying(query):
            attachment = None if query.attachment is None else query.attachment.to_bytes()
            query.reply(query.key_expr, payload, attachment=attachment)

    def _refuse(self, query: zenoh.Query, error: ServiceGone | ServiceUnavailable) -> None:
        with replying(query):
            query.reply_err(encode_refusal(error))


def _with_header(header: bytes, message: bytes) -> bytes:
    return message[:_ENCAPSULATION] + header + message[_ENCAPSULATION:]


def _without_header(message: bytes) -> bytes:
    return message[:_ENCAPSULATION] + message[_BODY:]


def _client_id(end: Any) -> str:
    return stated_user_data(end.qos).get("clientid", "")
