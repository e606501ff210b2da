"""`busflow foxglove`, through the command itself: a client speaks its protocol while the project's lab runs."""

import json
import re
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from busflow import QoS
from busflow.cli import main
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.sensor_msgs import Imu
from busflow.msgs.std_msgs import Float64
from busflow.msgs.std_srvs import Trigger
from busflow.wire.client.client import join
from busflow.wire.zenoh.keys import Token, TokenKind
from busflow.wire.zenoh.qos_text import to_text
from tests.cli.test_cli import HEAVY, in_one_process
from tests.golden import Golden

PATIENCE_S = 60.0
Refused = Callable[..., tuple[int, str]]
TRIGGER = TypeSupport(Trigger.Request).encode(Trigger.Request())


class Client:
    """A viewer that keeps what it is told."""

    def __init__(self, url: str, stack: ExitStack, **options: Any) -> None:
        options = {
            "subprotocols": ["foxglove.sdk.v1"],
            "max_size": None,
            "close_timeout": 0.5,
            **options,
        }
        self.socket = stack.enter_context(connect(url, compression=None, **options))
        self.info: dict[str, Any] = {}
        self.channels: dict[str, dict[str, Any]] = {}
        self.services: dict[str, dict[str, Any]] = {}
        self.until(lambda told: told.get("op") == "serverInfo")

    def ask(self, op: str, **fields: Any) -> None:
        self.socket.send(json.dumps({"op": op, **fields}))

    def receive(self) -> dict[str, Any]:
        """The next message; a binary one as its parts."""
        message = self.socket.recv(timeout=PATIENCE_S)
        if isinstance(message, bytes):
            return parts(message)
        told: dict[str, Any] = json.loads(message)
        match told["op"]:
            case "serverInfo":
                self.info = told
            case "advertise":
                self.channels |= {each["topic"]: each for each in told["channels"]}
            case "unadvertise":
                self.channels = {k: v for k, v in self.channels.items() if v["id"] not in told["channelIds"]}
            case "advertiseServices":
                self.services |= {each["name"]: each for each in told["services"]}
        return told

    def until(self, holds: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
        """Receive until a message is so."""
        seen: list[Any] = []
        for _ in range(5000):
            told = self.receive()
            if holds(told):
                return told
            seen = [*seen[-20:], str(told)[:200]]
        raise AssertionError(seen)

    def status(self, text: str) -> dict[str, Any]:
        return self.until(lambda told: told.get("op") == "status" and text in told["message"])

    def subscribe(self, topic: str, id_: int = 1) -> None:
        if topic not in self.channels:
            self.until(lambda _: topic in self.channels)
        self.ask("subscribe", subscriptions=[{"id": id_, "channelId": self.channels[topic]["id"]}])

    def message(self, id_: int = 1) -> dict[str, Any]:
        return self.until(lambda told: told.get("subscription") == id_)

    def call(self, name: str, payload: bytes, encoding: bytes = b"cdr") -> dict[str, Any]:
        if name not in self.services:
            self.until(lambda _: name in self.services)
        head = struct.pack("<BIII", 2, self.services[name]["id"], 7, len(encoding))
        self.socket.send(head + encoding + payload)
        return self.until(lambda told: 7 in (told.get("call"), told.get("callId")))

    def publish(self, id_: int, payload: bytes) -> None:
        self.socket.send(struct.pack("<BI", 1, id_) + payload)

    def parameters(self, *names: str) -> dict[str, Any]:
        self.ask("getParameters", parameterNames=names, id="look")
        told = self.until(lambda told: told.get("id") == "look")
        return {each["name"]: each.get("value") for each in told["parameters"]}


def parts(message: bytes) -> dict[str, Any]:
    match message[0]:
        case 1:
            _, subscription, stamp_ns = struct.unpack_from("<BIQ", message)
            return {"subscription": subscription, "stamp_ns": stamp_ns, "payload": message[13:]}
        case 2:
            return {"now_ns": struct.unpack_from("<BQ", message)[1]}
        case _:
            _, service, call, length = struct.unpack_from("<BIII", message)
            encoding, payload = message[13 : 13 + length].decode(), message[13 + length :]
            return {"service": service, "call": call, "encoding": encoding, "payload": payload}


class Served:
    """The command, while it serves."""

    def __init__(self, place: Any, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", "busflow", "foxglove", "--port", "0", *arguments],
            env={**place.environment, "PYTHONUNBUFFERED": "1"},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout
        self.greeting = self.process.stdout.readline() + self.process.stdout.readline()
        found = re.search(r"ws://\S+", self.greeting)
        if found is None:
            raise AssertionError(self.process.communicate())
        self.url = found[0]
        self.clients = ExitStack()

    def client(self, **options: Any) -> Client:
        return Client(self.url, self.clients, **options)

    def end(self, by: signal.Signals = signal.SIGINT) -> tuple[int, str, str]:
        """End it, and say with which exit code it did, and what it printed."""
        if self.process.poll() is None:
            self.process.send_signal(by)
        try:
            printed, told = self.process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.communicate()
            raise
        self.clients.close()
        return self.process.returncode, printed, told


@contextmanager
def serving(place: Any, *arguments: str) -> Iterator[Served]:
    served = Served(place, *arguments)
    try:
        yield served
    finally:
        served.end()


@pytest.fixture(scope="module")
def serving_lab1(lab1: Any) -> Iterator[Served]:
    with serving(lab1[0]) as found:
        yield found


@pytest.fixture(scope="module")
def serving_odds(odd_lab: Any) -> Iterator[Served]:
    with serving(odd_lab) as found:
        yield found


@pytest.fixture
def served(serving_lab1: Served) -> Iterator[Served]:
    """The lab is served; the test's clients go with it."""
    with serving_lab1.clients:
        yield serving_lab1


@pytest.fixture
def served_odds(serving_odds: Served) -> Iterator[Served]:
    """The run with the odd topics is served."""
    with serving_odds.clients:
        yield serving_odds


@pytest.fixture
def refused(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Refused:
    """The command in this process, where it serves nothing."""

    def refused(place: Any, *arguments: str) -> tuple[int, str]:
        place.look(monkeypatch)
        code = main(["foxglove", *arguments])
        out, err = capsys.readouterr()
        assert out == ""
        return code, err

    return refused


def test_its_help_imports_nothing_heavy():
    done = in_one_process("foxglove --help", heavy=(*HEAVY, "zenoh", "websockets"))
    assert done.stderr == "busflow foxglove --help: exit code 0, imported []\n"
    assert "--read-only" in done.stdout


# Topics.


def test_every_topic_is_a_channel_with_its_definition(served: Served):
    client = served.client()
    client.until(lambda _: client.channels)
    topics = ["/balance_state", "/imu/data", "/joint_states", "/parameter_events", "/rosout", "/stability_index"]
    assert list(client.channels) == topics
    channel = client.channels["/imu/data"]
    assert {word: channel[word] for word in ("encoding", "schemaName", "schemaEncoding")} == {
        "encoding": "cdr",
        "schemaName": "sensor_msgs/msg/Imu",
        "schemaEncoding": "ros2msg",
    }
    assert channel["schema"] == TypeSupport(Imu).definition
    assert client.socket.subprotocol == "foxglove.sdk.v1"
    assert client.info["name"] == "busflow: lab1"
    assert client.info["metadata"]["ROS_DISTRO"] == "jazzy"  # by which Lichtblick knows the standard types


def test_messages_are_sent_as_the_runs_own_bytes(served: Served, lab1: Any, monkeypatch: Any):
    lab1[0].look(monkeypatch)
    client = served.client()
    with join() as peer, peer.listen(peer.graph().topic("imu/data")) as listener:
        client.subscribe("/imu/data")
        got = {each["stamp_ns"]: each["payload"] for each in (client.message() for _ in range(10))}
        sent: dict[int, bytes] = {}
        while max(sent, default=0) < max(got):
            each = listener.get(PATIENCE_S)
            sent[each.stamp_ns] = each.payload
    both = got.keys() & sent.keys()
    assert both
    assert {stamp: got[stamp] for stamp in both} == {stamp: sent[stamp] for stamp in both}
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(client.channels["/imu/data"]["schema"], "sensor_msgs/msg/Imu"))
    for payload in got.values():
        read, ours = store.deserialize_cdr(payload, "sensor_msgs/msg/Imu"), TypeSupport(Imu).decode(payload)
        assert read.header.frame_id == ours.header.frame_id == "imu_link"
        assert read.linear_acceleration.z == ours.linear_acceleration.z == pytest.approx(9.8, abs=0.3)


def test_a_topic_is_sent_only_while_subscribed(served: Served, lab1: Any, monkeypatch: Any):
    lab1[0].look(monkeypatch)
    client = served.client()
    with join() as peer:

        def receivers() -> int:
            return sum(each.node_name.startswith("/_") for each in peer.tokens() if each.topic == "/imu/data")

        client.until(lambda _: client.channels)
        assert receivers() == 0
        client.subscribe("/imu/data")
        client.message()
        assert receivers() == 1
        client.ask("unsubscribe", subscriptionIds=[1])
        client.parameters()  # is answered after that
        assert receivers() == 0


def test_foreign_types_are_json_and_latched_messages_late(served_odds: Served):
    client = served_odds.client()
    client.until(lambda _: client.channels)
    assert "/_hidden/count" not in client.channels
    note = client.channels["/note"]
    assert (note["encoding"], note["schemaEncoding"]) == ("json", "jsonschema")
    assert json.loads(note["schema"])["properties"]["text"]["type"] == "string"
    client.subscribe("/note")
    assert json.loads(client.message()["payload"])["text"] == "a, b"
    for _ in range(2):
        late = served_odds.client()
        late.subscribe("/map_name")
        assert late.message()["payload"].endswith(b"attic\0")


def test_topics_come_and_go(served: Served, lab1: Any):
    client = served.client()
    client.until(lambda _: client.channels)
    client.ask("subscribeConnectionGraph")
    whole = client.until(lambda told: told.get("op") == "connectionGraphUpdate")
    assert {"name": "/imu/data", "publisherIds": ["/sensor_publisher"]} in whole["publishedTopics"]
    assert {"name": "/imu/data", "subscriberIds": ["/sensor_processor"]} in whole["subscribedTopics"]
    assert {"name": "/sensor_publisher/reset", "providerIds": ["/sensor_publisher"]} in whole["advertisedServices"]
    assert not [each["name"] for each in whole["advertisedServices"] if "parameters" in each["name"]]
    assert "/parameter_events" not in [each["name"] for each in whole["publishedTopics"]]
    command = [
        sys.executable,
        "-P",
        "-m",
        "busflow",
        "topic",
        "pub",
        "-r",
        "5",
        "chatter",
        "std_msgs/String",
        "{data: hi}",
    ]
    with subprocess.Popen(
        command, env=lab1[0].environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as pub:
        client.subscribe("/chatter")
        assert client.message()["payload"].endswith(b"hi\0")
        pub.send_signal(signal.SIGINT)
    client.until(lambda _: "/chatter" not in client.channels)
    client.subscribe("/imu/data", 2)
    client.message(2)


def test_only_topics_that_match_are_served(lab1: Any):
    with serving(lab1[0], "--topics", "imu/*", "*_state") as served:
        client = served.client()
        client.until(lambda _: client.channels)
        assert list(client.channels) == ["/balance_state", "/imu/data"]


def test_two_clients_have_separate_subscriptions(served: Served):
    one, other = served.client(), served.client(subprotocols=["foxglove.websocket.v1"])
    one.subscribe("/imu/data", 1)
    other.subscribe("/joint_states", 1)
    one.message()
    message = other.message()
    assert len(message["payload"]) > len(one.message()["payload"])
    one.socket.close()
    other.message()


def test_slow_client_alone_loses_messages(odd_lab: Any):
    with serving(odd_lab) as served:
        idle, busy = served.client(max_queue=1), served.client()
        idle.subscribe("/camera/image")
        busy.subscribe("/numbers")
        numbers = [struct.unpack_from("<q", busy.message()["payload"], 4)[0] for _ in range(300)]
        assert numbers == list(range(numbers[0], numbers[0] + 300))
        told = idle.status("messages were dropped")
        assert int(told["message"].split()[0]) > 0
        idle.message()
        _, _, printed = served.end()
    assert re.search(r" missed \d+ messages", printed)


def test_the_log_begins_with_kept_lines(served: Served):
    client = served.client()
    client.subscribe("/rosout")
    assert b"All sensors operational" in client.message()["payload"]


# Parameters.


def test_parameters_are_read_set_and_followed(served: Served, lab1: Any):
    client, other = served.client(), served.client()
    assert client.parameters("/sensor_publisher.noise.imu", "/nobody.x") == {"/sensor_publisher.noise.imu": 0.1}
    assert client.parameters()["/sensor_processor.max_joint_angle"] == 3.0
    other.ask("subscribeParameterUpdates", parameterNames=["/sensor_publisher.rate_hz"])
    other.parameters("/sensor_publisher.rate_hz")
    client.ask("setParameters", parameters=[{"name": "/sensor_publisher.rate_hz", "value": 20}], id="set")
    row = {"name": "/sensor_publisher.rate_hz", "value": 20.0, "type": "float64"}
    assert client.until(lambda told: told.get("id") == "set")["parameters"] == [row]
    changed = other.until(lambda told: told.get("op") == "parameterValues" and "id" not in told)
    assert changed["parameters"] == [row]
    command = [
        sys.executable,
        "-P",
        "-m",
        "busflow",
        "param",
        "set",
        "sensor_publisher",
        "rate_hz",
        "10",
        "noise.imu",
        "0.1",
    ]
    subprocess.run(command, env=lab1[0].environment, check=True, stdout=subprocess.DEVNULL)
    changed = other.until(lambda told: told.get("op") == "parameterValues" and "id" not in told)
    assert changed["parameters"] == [row | {"value": 10.0}]


def test_refused_parameter_is_reported_and_old_value_shown(served: Served, golden: Golden):
    client = served.client()
    client.ask("setParameters", parameters=[{"name": "/sensor_publisher.noise.imu", "value": 99}])
    told = client.status("noise.imu")
    assert told["level"] == 2
    golden(told["message"])
    assert client.until(lambda told: told.get("op") == "parameterValues")["parameters"][0]["value"] == 0.1
    client.ask("setParameters", parameters=[{"name": "/sensor_publisher.noise.imi", "value": 1}])
    golden(client.status("noise.imi")["message"])
    client.ask("setParameters", parameters=[{"name": "/sensor_publisher.noise.imu"}])
    golden(client.status("not removed")["message"])


# Services.


def test_a_service_is_called(served: Served):
    client = served.client()
    answer = client.call("/sensor_publisher/reset", TRIGGER)
    assert (answer["service"], answer["encoding"]) == (client.services["/sensor_publisher/reset"]["id"], "cdr")
    response = TypeSupport(Trigger.Response).decode(answer["payload"])
    assert response.success
    assert response.message.startswith("began anew after ")
    told = client.services["/sensor_publisher/reset"]
    assert told["type"] == "std_srvs/srv/Trigger"
    assert told["response"] == {
        "schemaName": "std_srvs/srv/Trigger_Response",
        "encoding": "cdr",
        "schemaEncoding": "ros2msg",
        "schema": "bool success\nstring message\n",
    }


def test_a_call_that_cannot_be_answered_says_why(served: Served, golden: Golden):
    client = served.client()
    name = "/sensor_publisher/get_parameters"
    client.services["/gone"] = {"id": 9999}
    for service, *call in ((name, b"\0\1\0\0\xff\xff\xff\xff"), (name, b"{}", b"json"), ("/gone", b"")):
        golden(client.call(service, *call)["message"])


def test_a_failed_call_is_shown_as_a_status(served: Served):
    client = served.client()
    name = "/sensor_publisher/get_parameters"
    client.call(name, b"\0\1\0\0\xff\xff\xff\xff")
    assert client.status(name)["level"] == 2


def test_surplus_bytes_of_a_request_are_left_out(served: Served):
    answer = served.client().call("/sensor_publisher/reset", TRIGGER + bytes(80))
    assert TypeSupport(Trigger.Response).decode(answer["payload"]).success


# Publishing.


def test_surplus_bytes_of_a_message_are_left_out(served_odds: Served):
    client = served_odds.client()
    client.subscribe("/commanded")
    row = {"id": 3, "topic": "/cmd", "encoding": "cdr", "schemaName": "std_msgs/msg/Float64"}
    client.ask("advertise", channels=[row])
    client.publish(3, TypeSupport(Float64).encode(Float64(data=0.5)) + bytes(24))
    assert TypeSupport(Float64).decode(client.message()["payload"]) == Float64(data=0.5)


def test_viewers_are_offered_json_first(served: Served):
    assert served.client().info["supportedEncodings"] == ["json", "cdr"]


@pytest.mark.parametrize(
    ("encoding", "payload"), [("cdr", TypeSupport(Float64).encode(Float64(data=0.5))), ("json", b'{"data": 0.5}')]
)
def test_what_a_client_publishes_arrives_in_a_node(served_odds: Served, encoding: str, payload: bytes):
    client = served_odds.client()
    client.subscribe("/commanded")
    client.ask(
        "advertise", channels=[{"id": 3, "topic": "/cmd", "encoding": encoding, "schemaName": "std_msgs/msg/Float64"}]
    )
    client.publish(3, payload)
    assert TypeSupport(Float64).decode(client.message()["payload"]) == Float64(data=0.5)
    client.publish(3, payload[:6])
    client.status("std_msgs/msg/Float64")
    client.ask("unadvertise", channelIds=[3])
    client.publish(3, payload)
    client.status("nothing is published under the number 3")


def test_a_strict_subscription_receives_a_viewers_messages(served_odds: Served):
    client = served_odds.client()
    client.subscribe("/commanded")
    row = {"id": 3, "topic": "/strict", "encoding": "json", "schemaName": "std_msgs/msg/Float64"}
    client.ask("advertise", channels=[row])
    client.publish(3, b'{"data": 7.5}')
    assert TypeSupport(Float64).decode(client.message()["payload"]) == Float64(data=7.5)


def test_unfit_subscriptions_are_named_to_a_viewer(served_odds: Served, odd_lab: Any, monkeypatch: pytest.MonkeyPatch):
    odd_lab.look(monkeypatch)
    client, support = served_odds.client(), TypeSupport(Float64)
    row = {"id": 3, "topic": "/fresh", "encoding": "json", "schemaName": "std_msgs/msg/Float64"}
    client.ask("advertise", channels=[row])
    client.publish(3, b"[]")
    client.status("std_msgs/msg/Float64")  # so the topic is open
    with join() as peer:
        end = ("/fresh", support.name, support.type_hash, to_text(QoS(deadline=0.5)))
        token = Token(str(peer.session.info.zid()), 0, 1, TokenKind.SUBSCRIPTION, "/", "strict", *end)
        with peer.session.liveliness().declare_token(str(token)):
            told = client.status("/strict does not receive /fresh: deadline: null is offered, 500ms is requested")
    assert told["level"] == 1


@pytest.mark.parametrize(
    ("channel", "why"),
    [
        ({"topic": "/cmd", "schemaName": "std_msgs/msg/String"}, "/cmd"),
        ({"topic": "/new", "schemaName": "std_msgs/msg/Nothing"}, "std_msgs/msg/Nothing"),
        ({"topic": "/a b\x1b[31m", "schemaName": "std_msgs/msg/String"}, "a b"),
        ({"topic": "/new", "schemaName": "std_msgs/msg/String", "encoding": "protobuf"}, "protobuf"),
    ],
)
def test_an_impossible_publication_is_refused_with_a_reason(
    served_odds: Served, channel: dict[str, str], why: str, golden: Golden
):
    client = served_odds.client()
    client.ask("advertise", channels=[{"id": 1, "encoding": "cdr", **channel}])
    told = client.status(why)
    assert told["level"] == 2
    golden(told["message"])


def test_read_only_viewers_look_and_do_nothing_else(lab1: Any, golden: Golden):
    with serving(lab1[0], "--read-only") as served:
        client = served.client()
        assert client.info["capabilities"] == ["parameters", "parametersSubscribe", "connectionGraph"]
        client.ask(
            "advertise", channels=[{"id": 1, "topic": "/x", "encoding": "cdr", "schemaName": "std_msgs/msg/String"}]
        )
        client.status("may not publish")
        client.ask("setParameters", parameters=[{"name": "/sensor_publisher.noise.imu", "value": 0.2}])
        client.status("may not set parameters")
        client.services["/any"] = {"id": 1}
        golden(client.call("/any", b"")["message"])
        assert client.parameters("/sensor_publisher.noise.imu") == {"/sensor_publisher.noise.imu": 0.1}
        client.subscribe("/imu/data")
        client.message()


# Who is let in.


@pytest.mark.parametrize(
    ("headers", "code"),
    [
        ({"origin": "https://evil.example"}, 403),
        ({"origin": "null"}, 403),
        ({"origin": "http://localhost.evil.example"}, 403),
        ({"additional_headers": {"Host": "evil.example:8765"}}, 403),
        ({"subprotocols": ["chat"]}, 400),
    ],
)
def test_a_page_of_another_site_is_refused(served: Served, headers: dict[str, Any], code: int):
    with pytest.raises(InvalidStatus) as caught:
        served.client(**headers)
    assert caught.value.response.status_code == code


@pytest.mark.parametrize(
    "origin", ["https://app.foxglove.dev", "http://localhost:8080", "file://", "http://lab.example"]
)
def test_foxgloves_and_allowed_pages_are_admitted(lab1: Any, origin: str):
    with serving(lab1[0], "--allow-origin", "http://lab.example") as served:
        client = served.client(origin=origin)
        client.until(lambda _: client.channels)
        _, _, told = served.end()
    assert f"({origin}) has come" in told


def test_refused_page_is_printed_once_and_escaped(lab1: Any):
    with serving(lab1[0]) as served:
        for _ in range(2):
            with pytest.raises(InvalidStatus):
                served.client(origin="http://evil\xc2\x9b31m")
        _, _, told = served.end()
    assert told.count("refused a connection") == 1
    assert "\x9b" not in told


def test_malformed_frame_is_answered_with_an_error(served: Served):
    client = served.client()
    for nonsense in (
        "{",
        "[]",
        '{"op": "dance"}',
        '{"op": "subscribe", "subscriptions": [{"id": -1}]}',
        b"",
        b"\xff",
        b"\2abc",
    ):
        client.socket.send(nonsense)
        assert client.status("")["level"] == 2
    client.ask("subscribe", subscriptions=[{"id": 1, "channelId": 999}])
    client.status("there is no channel 999")
    client.subscribe("/imu/data")
    client.subscribe("/imu/data", 2)
    client.status("/imu/data is subscribed to already")
    client.ask("unsubscribe", subscriptionIds=[9])
    client.status("nothing is subscribed to under the number 9")


def test_client_that_never_reads_is_disconnected(served: Served):
    greedy, other = served.client(max_queue=1), served.client()
    other.subscribe("/imu/data")

    def flood() -> None:
        for _ in range(100):
            for _ in range(500):
                greedy.ask("subscribeConnectionGraph")
                greedy.ask("unsubscribeConnectionGraph")
            other.message()

    with pytest.raises(ConnectionClosed):
        flood()
    other.message()


# Time.


def test_published_clock_is_the_viewers_time(lab1: Any):
    command = [sys.executable, "-P", "-m", "busflow", "topic", "pub", "-r", "20", "/clock", "rosgraph_msgs/Clock"]
    with serving(lab1[0]) as served:
        before = served.client()
        assert "time" not in before.info["capabilities"]
        with subprocess.Popen([*command, "{clock: {sec: 5, nanosec: 1}}"], env=lab1[0].environment, stdout=-3) as pub:
            before.until(lambda _: "/clock" in before.channels)
            client = served.client()
            assert "time" in client.info["capabilities"]
            assert client.until(lambda told: "now_ns" in told) == {"now_ns": 5_000_000_001}
            pub.send_signal(signal.SIGINT)


# The end.


def test_silent_run_is_reported_and_viewers_can_leave(place: Any, start_run: Any, project: Any):
    run = start_run(project, "talk.yaml")
    run.wait_for("heard")
    with serving(place) as served:
        client = served.client()
        run.process.send_signal(signal.SIGSTOP)
        assert client.status("does not answer")["level"] == 1
        run.process.send_signal(signal.SIGCONT)
        client.until(lambda told: told.get("op") == "removeStatus")
        client.subscribe("/numbers")
        client.message()
        run.process.send_signal(signal.SIGSTOP)
        client.ask("getParameters", id="x")
        assert served.end()[0] == 130


def test_ctrl_c_ends_despite_a_stalled_client(odd_lab: Any):
    with serving(odd_lab) as served:
        idle, busy = served.client(max_queue=1), served.client()
        for client in (idle, busy):
            client.subscribe("/camera/image")
        for _ in range(8):
            busy.message()
        code, _, told = served.end()
    assert (code, "Traceback" in told) == (130, False)
    assert "https://app.foxglove.dev/~/view?ds=foxglove-websocket&ds.url=ws%3A%2F%2F127.0.0.1%3A" in served.greeting


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_end_of_the_run_ends_the_command(place: Any, start_run: Any, project: Any, how: signal.Signals, golden: Golden):
    run = start_run(project, "talk.yaml")
    run.wait_for("heard")
    with serving(place) as served:
        client = served.client()
        client.subscribe("/numbers")
        client.message()
        run.process.send_signal(how)
        client.status("the run talk has ended")
        with pytest.raises(ConnectionClosed) as caught:
            client.until(lambda _: False)
        assert caught.value.rcvd is not None
        assert caught.value.rcvd.code == 1001
        assert served.process.wait(PATIENCE_S) == 0
        code, printed, _ = served.end()
    assert code == 0
    golden(printed.splitlines()[-1])


# Errors.


def test_a_port_that_is_taken_is_one_error(refused: Refused, lab1: Any, golden: Golden):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        code, told = refused(lab1[0], "--port", str(port))
    assert code == 2
    golden(told, mask={str(port): "PORT"})


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["--run", "lab2"], 4),
        (["--topics", "imu/dada"], 4),
        (["--topics", "imu data"], 2),
        (["imu/data"], 2),
        (["--port", "99999"], 2),
        (["--host", "no such host.invalid"], 2),
    ],
)
def test_a_mistake_is_one_error(refused: Refused, lab1: Any, arguments: list[str], code: int, golden: Golden):
    found, printed = refused(lab1[0], *arguments)
    assert found == code
    # The system's own words about a host differ.
    golden(printed, mask={r"(cannot be listened at: ).*": r"\1…"})


def test_without_a_run_it_says_so(refused: Refused, place: Any, golden: Golden):
    code, told = refused(place)
    assert code == 4
    golden(told)


def test_another_address_is_served_with_a_warning(lab1: Any, golden: Golden):
    with serving(lab1[0], "--host", "0.0.0.0") as served:  # noqa: S104  # which is what is warned of
        _, _, told = served.end()
    golden(next(line for line in told.splitlines() if line.startswith("warning")))


def test_an_ipv6_address_is_served(lab1: Any):
    with serving(lab1[0], "--host", "::1") as served:
        assert served.url.startswith("ws://[::1]:")
        served.client().subscribe("/imu/data")


def test_number_of_viewers_is_limited(lab1: Any):
    with serving(lab1[0]) as served, ExitStack() as stack:
        options: dict[str, Any] = {"subprotocols": ["foxglove.sdk.v1"], "compression": None, "close_timeout": 0.1}
        sockets = [stack.enter_context(connect(served.url, **options)) for _ in range(48)]
        refusals = [reason for each in sockets if (reason := refusal(each)) is not None]
    assert refusals == ["32 viewers are connected"] * 16


def refusal(socket: Any) -> str | None:
    """Why a connection was ended at once; None where it was not."""
    try:
        socket.recv(timeout=PATIENCE_S)
    except ConnectionClosed as closed:
        return str(closed.rcvd.reason) if closed.rcvd is not None else "no reason"
    return None
