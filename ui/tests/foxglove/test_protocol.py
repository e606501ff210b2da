"""The protocol: what clients send is read or refused; what we say is what Foxglove's own server says."""

import contextlib
import json
import socket
import struct
from collections.abc import Iterator
from threading import Event
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.errors import MalformedMessage
from busflow_ui.foxglove import protocol
from busflow_ui.foxglove.connections import Connections
from busflow_ui.foxglove.protocol import Level
from tests.golden import Golden

SCHEMA = "string data\n"
VALUES = st.none() | st.integers() | st.text(max_size=3) | st.floats()
WORDS = ["id", "channelId", "topic", "encoding", "schemaName", "schema", "schemaEncoding", "name", "type", "value"]
CHANNEL = {"id": 1, "topic": "/a", "encoding": "cdr", "schemaName": "p/T"}
FIELDS = ["subscriptions", "subscriptionIds", "channels", "parameters", "parameterNames", "id"]


@pytest.mark.parametrize(
    ("message", "request_"),
    [
        ({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 2}]}, protocol.Subscribe(((1, 2),))),
        ({"op": "unsubscribe", "subscriptionIds": [1, 2]}, protocol.Unsubscribe((1, 2))),
        (
            {
                "op": "advertise",
                "channels": [{"id": 1, "topic": "/a", "encoding": "cdr", "schemaName": "p/T", "schema": ""}],
            },
            protocol.Advertise((protocol.ClientChannel(1, "/a", "cdr", "p/T"),)),
        ),
        *(
            (
                {"op": "advertise", "channels": [{**CHANNEL, "schema": "int8 a", **encoding}]},
                protocol.Advertise((protocol.ClientChannel(1, "/a", "cdr", "p/T", definition),)),
            )
            for encoding, definition in (
                ({}, "int8 a"),
                ({"schemaEncoding": "ros2msg"}, "int8 a"),
                ({"schemaEncoding": "jsonschema"}, ""),
            )
        ),
        ({"op": "unadvertise", "channelIds": [1]}, protocol.Unadvertise((1,))),
        ({"op": "getParameters", "parameterNames": ["/a.b"], "id": "x"}, protocol.GetParameters(("/a.b",), "x")),
        ({"op": "getParameters"}, protocol.GetParameters((), None)),
        (
            {
                "op": "setParameters",
                "parameters": [{"name": "a", "value": 2, "type": "float64"}, {"name": "b", "value": 2}],
            },
            protocol.SetParameters({"a": 2.0, "b": 2}, None),
        ),
        (
            {"op": "setParameters", "parameters": [{"name": "a", "value": [1, 2.5], "type": "float64_array"}]},
            protocol.SetParameters({"a": [1.0, 2.5]}, None),
        ),
        ({"op": "setParameters", "parameters": [{"name": "a"}]}, protocol.SetParameters({"a": None}, None)),
        ({"op": "subscribeParameterUpdates", "parameterNames": ["a"]}, protocol.FollowParameters(("a",), on=True)),
        ({"op": "unsubscribeParameterUpdates", "parameterNames": []}, protocol.FollowParameters((), on=False)),
        ({"op": "fetchAsset", "uri": "package://a/b.stl", "requestId": 7}, protocol.FetchAsset("package://a/b.stl", 7)),
        ({"op": "subscribeConnectionGraph"}, protocol.FollowGraph(on=True)),
        ({"op": "unsubscribeConnectionGraph"}, protocol.FollowGraph(on=False)),
    ],
)
def test_a_text_frame_says_what_is_wanted(message: dict[str, Any], request_: protocol.Request):
    assert protocol.read(json.dumps(message)) == request_


def test_a_binary_frame_says_what_is_wanted():
    assert protocol.read(b"\1\5\0\0\0abc") == protocol.Publish(5, b"abc")
    assert protocol.read(struct.pack("<BIII", 2, 6, 7, 3) + b"cdrxy") == protocol.CallService(6, 7, "cdr", b"xy")


@pytest.mark.parametrize(
    "message",
    [
        "{",
        "[" * 100_000,
        "[]",
        '{"op": ["subscribe"]}',
        '{"op": "fetchAsset", "uri": "package://x"}',
        '{"op": "fetchAsset", "uri": 1, "requestId": 1}',
        '{"op": "playbackControlRequest"}',
        '{"op": "subscribe"}',
        '{"op": "subscribe", "subscriptions": [1]}',
        '{"op": "subscribe", "subscriptions": [{"id": true, "channelId": 1}]}',
        '{"op": "unsubscribe", "subscriptionIds": [4294967296]}',
        '{"op": "advertise", "channels": [{"id": 1, "topic": "/a", "encoding": "cdr"}]}',
        json.dumps({"op": "advertise", "channels": [{**CHANNEL, "schema": 3}]}),
        '{"op": "getParameters", "parameterNames": [1]}',
        '{"op": "getParameters", "parameterNames": "a"}',
        json.dumps({"op": "setParameters", "parameters": [{"name": "a", "value": 10**400, "type": "float64"}]}),
        b"",
        b"\1abc",
        struct.pack("<BIII", 2, 6, 7, 4) + b"cdr",
    ],
    ids=lambda message: str(message)[:90],
)
def test_an_invalid_request_is_refused_with_the_reason(message: str | bytes, golden: Golden):
    with golden.raises(MalformedMessage):
        protocol.read(message)


@given(
    st.binary()
    | st.text()
    | st.recursive(st.none() | st.booleans() | st.integers() | st.text(), st.lists).map(json.dumps)
)
def test_every_frame_is_read_or_refused(message: str | bytes):
    with contextlib.suppress(MalformedMessage):
        protocol.read(message)


@given(
    st.sampled_from(["subscribe", "unsubscribe", "advertise", "setParameters", "getParameters"]),
    st.dictionaries(
        st.sampled_from(FIELDS),
        st.recursive(
            VALUES,
            lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(WORDS), inner),
            max_leaves=8,
        ),
    ),
)
def test_every_object_is_read_or_refused(op: str, fields: dict[str, Any]):
    with contextlib.suppress(MalformedMessage):
        protocol.read(json.dumps({"op": op, **fields}))


# Beside Foxglove's own server.


class Theirs:
    """Foxglove's server, and what a client of it received."""

    def __init__(self) -> None:
        foxglove = pytest.importorskip("foxglove", reason="foxglove-sdk is not installed: it is only compared with")
        websockets = pytest.importorskip("websockets.sync.client", reason="websockets is not installed")
        self.sdk: Any = foxglove
        self.context = foxglove.Context()
        self.followed = Event()
        capability = foxglove.Capability
        self.server = foxglove.start_server(
            port=0,
            context=self.context,
            server_listener=self,
            supported_encodings=["cdr"],
            asset_handler=lambda uri: b"solid" if uri == "package://lab/arm.stl" else None,
            capabilities=[capability.Parameters, capability.ConnectionGraph, capability.Time, capability.Services],
        )
        self.channel = foxglove.Channel(
            "/chatter",
            message_encoding="cdr",
            schema=foxglove.Schema(name="std_msgs/msg/String", encoding="ros2msg", data=SCHEMA.encode()),
            context=self.context,
        )
        self.connecting = websockets.connect(f"ws://127.0.0.1:{self.server.port}", subprotocols=["foxglove.sdk.v1"])

    def on_subscribe(self, *_: Any) -> None:
        self.followed.set()

    def on_unsubscribe(self, *_: Any) -> None: ...

    def on_get_parameters(self, *_: Any) -> list[Any]:
        return [self.sdk.Parameter("/node.whole", value=3), self.sdk.Parameter("/node.real", value=2.0)]

    def on_parameters_subscribe(self, *_: Any) -> None: ...

    def on_parameters_unsubscribe(self, *_: Any) -> None: ...

    def on_connection_graph_subscribe(self) -> None: ...

    def on_connection_graph_unsubscribe(self) -> None: ...


def wait_until_closed(port: int) -> None:
    """Wait until a port is free again: Foxglove's server closes its socket in a thread, at times after `stop()`."""
    while True:
        with contextlib.suppress(OSError), socket.create_server(("127.0.0.1", port)):
            return


@pytest.fixture
def theirs() -> Iterator[Theirs]:
    server = Theirs()
    yield server
    port = server.server.port
    server.server.stop()
    wait_until_closed(port)


def test_foxgloves_own_server_says_the_same(theirs: Theirs):
    graph = theirs.sdk.ConnectionGraph()
    graph.set_published_topic("/chatter", ["/talker"])
    graph.set_subscribed_topic("/chatter", ["/listener"])
    graph.set_advertised_service("/talker/reset", ["/talker"])
    with theirs.connecting as client:

        def told() -> Any:
            message = client.recv(timeout=60)
            return message if isinstance(message, bytes) else json.loads(message)

        info, advertised = told(), told()
        ours = json.loads(protocol.text("serverInfo", name="", **{each: info[each] for each in list(info)[2:]}))
        assert ours == info
        (channel,) = advertised["channels"]
        row = {"id": channel["id"], "topic": "/chatter", "encoding": "cdr", "schemaName": "std_msgs/msg/String"}
        row |= {"schemaEncoding": "ros2msg", "schema": SCHEMA}
        assert json.loads(protocol.text("advertise", channels=[row])) == advertised

        client.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 9, "channelId": channel["id"]}]}))
        assert theirs.followed.wait(60)
        theirs.channel.log(b"\0\1\0\0payload", log_time=1_700_000_000_123_456_789)
        assert told() == protocol.message_data(9, 1_700_000_000_123_456_789, b"\0\1\0\0payload")
        theirs.server.broadcast_time(5_000_000_001)
        assert told() == protocol.time(5_000_000_001)
        theirs.server.publish_status("careful", theirs.sdk.StatusLevel.Warning, "drops")
        assert told() == json.loads(protocol.status(Level.WARNING, "careful", id_="drops"))
        theirs.server.remove_status(["drops"])
        assert told() == json.loads(protocol.text("removeStatus", statusIds=["drops"]))

        client.send(json.dumps({"op": "getParameters", "parameterNames": [], "id": "all"}))
        rows = [{"name": "/node.whole", "value": 3}, {"name": "/node.real", "value": 2.0, "type": "float64"}]
        assert told() == json.loads(protocol.text("parameterValues", parameters=rows, id="all"))

        theirs.server.publish_connection_graph(graph)
        client.send(json.dumps({"op": "subscribeConnectionGraph"}))
        same = Connections({"/chatter": ("/talker",)}, {"/chatter": ("/listener",)}, {"/talker/reset": ("/talker",)})
        assert told() == json.loads(protocol.text("connectionGraphUpdate", **same.since(Connections())))

        theirs.channel.close()
        assert told() == json.loads(protocol.text("unadvertise", channelIds=[channel["id"]]))


def test_calls_are_answered_as_foxgloves_own_server_does(theirs: Theirs):
    sdk = theirs.sdk
    part = sdk.MessageSchema(
        encoding="cdr", schema=sdk.Schema(name="p/srv/S_Request", encoding="ros2msg", data=b"bool on\n")
    )
    schema = sdk.ServiceSchema(name="p/srv/S", request=part, response=part)
    theirs.server.add_services([sdk.Service("/talker/s", schema=schema, handler=lambda call: call.payload[::-1])])
    with theirs.connecting as client:
        told = [json.loads(client.recv(timeout=60)) for _ in range(3)]
        (service,) = told[2]["services"]
        row = {"encoding": "cdr", "schemaName": "p/srv/S_Request", "schemaEncoding": "ros2msg", "schema": "bool on\n"}
        ours = {"id": service["id"], "name": "/talker/s", "type": "p/srv/S", "request": row, "response": row}
        assert json.loads(protocol.text("advertiseServices", services=[ours])) == told[2]
        client.send(struct.pack("<BIII", 2, service["id"], 7, 3) + b"cdr" + b"abc")
        assert client.recv(timeout=60) == protocol.call_answered(service["id"], 7, "cdr", b"cba")
        client.send(struct.pack("<BIII", 2, 99, 8, 3) + b"cdr")
        failure = protocol.text("serviceCallFailure", serviceId=99, callId=8, message="Unknown service")
        assert json.loads(client.recv(timeout=60)) == json.loads(failure)


def test_files_are_sent_as_foxgloves_own_server_does(theirs: Theirs):
    with theirs.connecting as client:
        told = [json.loads(client.recv(timeout=60)) for _ in range(2)]
        assert "assets" in told[0]["capabilities"]
        client.send(json.dumps({"op": "fetchAsset", "uri": "package://lab/arm.stl", "requestId": 7}))
        assert client.recv(timeout=60) == protocol.asset(7, b"solid")
        client.send(json.dumps({"op": "fetchAsset", "uri": "package://lab/none.stl", "requestId": 8}))
        theirs_failed = client.recv(timeout=60)
        reason = theirs_failed[10:].decode()
        assert reason
        assert theirs_failed == protocol.asset_failed(8, reason)
