"""The Foxglove WebSocket protocol: the messages that a server sends, and those of a client, read and checked.

Version `foxglove.sdk.v1`, which is `foxglove.websocket.v1` under a new name. Text frames are JSON objects whose `op`
says what they are; binary frames begin with a byte that does, and their numbers are little-endian. Pure: no socket.
Source: github.com/foxglove/foxglove-sdk, `rust/foxglove/src/protocol`.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, TypeAlias, cast

from busflow.errors import MalformedMessage

SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
"""Subprotocols that a client may ask for, the newer first; viewers from before 2025 know the older one alone."""

_DATA, _TIME, _CALL_ANSWERED, _ASSET = 1, 2, 3, 4
_CLIENT_DATA, _CLIENT_CALL = 1, 2
_DATA_HEAD = struct.Struct("<BIQ")
_TIME_HEAD = struct.Struct("<BQ")
_CALL_HEAD = struct.Struct("<BIII")
_ASSET_HEAD = struct.Struct("<BIBI")
_CLIENT_DATA_HEAD = struct.Struct("<BI")
_MOST_ID = (1 << 32) - 1


class Level(IntEnum):
    """Severity of a status message."""

    INFO = 0
    WARNING = 1
    ERROR = 2


# What a server sends.


def text(op: str, **fields: Any) -> str:
    """Return a text frame; fields that are None are left out."""
    frame = {"op": op, **{word: value for word, value in fields.items() if value is not None}}
    return json.dumps(frame, separators=(",", ":"), allow_nan=False)


def status(level: Level, message: str, *, id_: str | None = None) -> str:
    """Return a sentence for the viewer's user; a later one with the same id replaces it."""
    return text("status", level=int(level), message=message, id=id_)


def message_data(subscription: int, stamp_ns: int, payload: bytes) -> bytes:
    """Return a frame with one message of a topic."""
    return _DATA_HEAD.pack(_DATA, subscription, stamp_ns) + payload


def time(now_ns: int) -> bytes:
    """Return a frame with the nodes' time."""
    return _TIME_HEAD.pack(_TIME, now_ns)


def call_answered(service: int, call: int, encoding: str, payload: bytes) -> bytes:
    """Return a frame with the answer of a service."""
    word = encoding.encode()
    return _CALL_HEAD.pack(_CALL_ANSWERED, service, call, len(word)) + word + payload


def asset(request: int, content: bytes) -> bytes:
    """Return a frame with the content of a file that was asked for."""
    return _ASSET_HEAD.pack(_ASSET, request, 0, 0) + content


def asset_failed(request: int, reason: str) -> bytes:
    """Return a frame with the reason why a file is not sent."""
    text = reason.encode()
    return _ASSET_HEAD.pack(_ASSET, request, 1, len(text)) + text


# What a client sends.


@dataclass(frozen=True, slots=True)
class Subscribe:
    """Request to receive channels: pairs of the client's number for the subscription, and the channel's."""

    subscriptions: tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class Unsubscribe:
    """Request to end subscriptions, by the client's numbers."""

    subscriptions: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class ClientChannel:
    """Topic that a client is about to publish, under the client's number."""

    id: int
    topic: str
    encoding: str
    schema: str
    """Name of the type."""
    definition: str = ""
    """Definition of the type, if the client gives it as ROS 2 writes it."""


@dataclass(frozen=True, slots=True)
class Advertise:
    """Announcement that a client is about to publish."""

    channels: tuple[ClientChannel, ...]


@dataclass(frozen=True, slots=True)
class Unadvertise:
    """Notice that a client no longer publishes, by the client's numbers."""

    channels: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Publish:
    """Message that a client publishes."""

    channel: int
    payload: bytes


@dataclass(frozen=True, slots=True)
class GetParameters:
    """Request for parameters; for all if it names none."""

    names: tuple[str, ...]
    request: str | None


@dataclass(frozen=True, slots=True)
class SetParameters:
    """Request to set parameters; None removes a value."""

    values: Mapping[str, Any]
    request: str | None


@dataclass(frozen=True, slots=True)
class FollowParameters:
    """Request to follow parameters, or to stop; it means all parameters if it names none."""

    names: tuple[str, ...]
    on: bool


@dataclass(frozen=True, slots=True)
class FollowGraph:
    """Request to follow the graph of publishers and subscriptions, or to stop."""

    on: bool


@dataclass(frozen=True, slots=True)
class CallService:
    """Request to a service."""

    service: int
    call: int
    encoding: str
    payload: bytes


@dataclass(frozen=True, slots=True)
class FetchAsset:
    """Request for a file that a robot's description names."""

    uri: str
    request: int


Request: TypeAlias = (
    Subscribe
    | Unsubscribe
    | Advertise
    | Unadvertise
    | Publish
    | GetParameters
    | SetParameters
    | FollowParameters
    | FollowGraph
    | CallService
    | FetchAsset
)


def read(message: str | bytes) -> Request:
    """Read a client's message.

    Raises:
        MalformedMessage: It is no message of the protocol, or one that this server does not offer.
    """
    if isinstance(message, bytes):
        return _binary(message)
    try:
        frame = json.loads(message)
    except (ValueError, RecursionError):
        raise MalformedMessage("a text frame is a JSON object") from None
    if not isinstance(frame, dict):
        raise MalformedMessage("a text frame is a JSON object")
    fields = cast("dict[str, Any]", frame)
    op = fields.get("op")
    reader = _READERS.get(op) if isinstance(op, str) else None
    if reader is None:
        raise MalformedMessage(f"nothing is known of the operation {str(op)[:100]!r}")
    return reader(fields)


def _binary(message: bytes) -> Request:
    kind = message[0] if message else None
    if kind == _CLIENT_DATA and len(message) >= _CLIENT_DATA_HEAD.size:
        _, channel = _CLIENT_DATA_HEAD.unpack_from(message)
        return Publish(channel, message[_CLIENT_DATA_HEAD.size :])
    if kind == _CLIENT_CALL and len(message) >= _CALL_HEAD.size:
        _, service, call, length = _CALL_HEAD.unpack_from(message)
        rest = message[_CALL_HEAD.size :]
        if length > len(rest):
            raise MalformedMessage(f"an encoding of {length} bytes is announced, and {len(rest)} follow")
        return CallService(service, call, rest[:length].decode(errors="replace"), rest[length:])
    raise MalformedMessage(f"a binary frame of {len(message)} bytes that begins with {message[:1]!r} is not known")


def _rows(fields: Mapping[str, Any], word: str) -> Iterable[Mapping[str, Any]]:
    rows = fields.get(word)
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in cast("list[Any]", rows)):
        raise MalformedMessage(f"{word} is a list of objects")
    return cast("list[Mapping[str, Any]]", rows)


def _number(value: object, word: str) -> int:
    if type(value) is not int or not 0 <= value <= _MOST_ID:
        raise MalformedMessage(f"{word} is a number from 0 to {_MOST_ID}, got {str(value)[:100]!r}")
    return value


def _numbers(fields: Mapping[str, Any], word: str) -> tuple[int, ...]:
    return tuple(_number(each, word) for each in _list(fields, word))


def _words(fields: Mapping[str, Any], word: str) -> tuple[str, ...]:
    return tuple(_word(each, word) for each in _list(fields, word))


def _word(value: object, word: str) -> str:
    if not isinstance(value, str):
        raise MalformedMessage(f"{word} is text, got {str(value)[:100]!r}")
    return value


def _list(fields: Mapping[str, Any], word: str) -> Sequence[Any]:
    found = fields.get(word, [])
    if not isinstance(found, list):
        raise MalformedMessage(f"{word} is a list")
    return cast("list[Any]", found)


def _request(fields: Mapping[str, Any]) -> str | None:
    return None if fields.get("id") is None else _word(fields["id"], "id")


def _subscribe(fields: Mapping[str, Any]) -> Subscribe:
    rows = _rows(fields, "subscriptions")
    return Subscribe(tuple((_number(row.get("id"), "id"), _number(row.get("channelId"), "channelId")) for row in rows))


def _advertise(fields: Mapping[str, Any]) -> Advertise:
    rows = _rows(fields, "channels")
    return Advertise(
        tuple(
            ClientChannel(
                _number(row.get("id"), "id"),
                *(_word(row.get(word), word) for word in ("topic", "encoding", "schemaName")),
                definition=_definition(row),
            )
            for row in rows
        )
    )


def _definition(row: Mapping[str, Any]) -> str:
    """Return the definition of a client's channel; empty where it has none, or has it in another language."""
    return _word(row.get("schema") or "", "schema") if row.get("schemaEncoding") in (None, "ros2msg") else ""


def _set_parameters(fields: Mapping[str, Any]) -> SetParameters:
    rows = _rows(fields, "parameters")
    return SetParameters({_word(row.get("name"), "name"): _typed(row) for row in rows}, _request(fields))


def _typed(row: Mapping[str, Any]) -> Any:
    """Return a value, whole numbers made floats where its type says so: JSON does not distinguish 1.0 from 1."""
    value, type_ = row.get("value"), row.get("type")
    try:
        if type_ == "float64" and type(value) is int:
            return float(value)
        if type_ == "float64_array" and isinstance(value, list):
            return [float(each) if type(each) is int else each for each in cast("list[Any]", value)]
    except OverflowError:
        raise MalformedMessage(f"{row['name'][:100]} is beyond every float64") from None
    return value


_READERS: Mapping[str, Callable[[Mapping[str, Any]], Request]] = {
    "subscribe": _subscribe,
    "unsubscribe": lambda fields: Unsubscribe(_numbers(fields, "subscriptionIds")),
    "advertise": _advertise,
    "unadvertise": lambda fields: Unadvertise(_numbers(fields, "channelIds")),
    "getParameters": lambda fields: GetParameters(_words(fields, "parameterNames"), _request(fields)),
    "setParameters": _set_parameters,
    "subscribeParameterUpdates": lambda fields: FollowParameters(_words(fields, "parameterNames"), on=True),
    "unsubscribeParameterUpdates": lambda fields: FollowParameters(_words(fields, "parameterNames"), on=False),
    "fetchAsset": lambda fields: FetchAsset(
        _word(fields.get("uri"), "uri"), _number(fields.get("requestId"), "requestId")
    ),
    "subscribeConnectionGraph": lambda _: FollowGraph(on=True),
    "unsubscribeConnectionGraph": lambda _: FollowGraph(on=False),
}
