"""Recordings hold what a run published, and recording does not change the run.

Tests of `recorder.py`, `capture.py`, `channels.py`, `options.py`, `provenance.py`, `share.py` and `ticks.py`.
"""

import asyncio
import errno
import functools
import json
import os
import threading

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

import busflow
from busflow import (
    Message,
    Node,
    Parameters,
    QoS,
    ServiceFailed,
    publisher,
    service,
    subscription,
    supervised,
    timer,
)
from busflow.bus.qos import PARAMETER_EVENTS
from busflow.errors import ExitCode, IncompleteRecording, InvalidParameter, RecordingRefused
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.interfaces.message import int64
from busflow.launchfile.model.description import RecordSpec
from busflow.msgs.rcl_interfaces import ParameterEvent
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_srvs import SetBool, Trigger
from busflow.recording.bag.bag import Bag
from busflow.recording.bag.offered_qos import offered
from busflow.recording.recorder.destination import Destination
from busflow.recording.recorder.share import Share
from busflow.recording.recorder.ticks import TICKS, Tick
from busflow.recording.tools.convert import TargetFormat, convert
from busflow.testing import harness, virtual_time
from busflow.testing.trace import Trace
from plugins.sensor_publisher import SensorPublisher

LAB = "configs/lab1.yaml"


def messages(path):
    with path.open("rb") as file:
        found = make_reader(file, validate_crcs=True).iter_messages(log_time_order=False)
        return [(channel.topic, message.sequence, message.log_time, message.data) for _, channel, message in found]


@virtual_time
async def test_every_message_is_recorded_with_number_and_time(tmp_path):
    path = tmp_path / "run.mcap"
    async with harness(LAB, record=path) as lab:
        await lab.advance(1.0)
        seen = [(topic, message) for topic in ("/imu/data", "/balance_state") for message in lab.received(topic)]
    recorded = messages(path)
    assert [sequence for _, sequence, _, _ in recorded] == list(range(1, len(recorded) + 1))
    assert len([1 for topic, *_ in recorded if topic in {"/imu/data", "/balance_state"}]) == len(seen) == 20
    assert [topic for topic, *_ in recorded[2:4]] == ["/_ticks", "/imu/data"]
    assert recorded[3][2] == seen[0][1].header.stamp.sec * 10**9 + seen[0][1].header.stamp.nanosec


def traced(seed, record):
    lines = []

    @virtual_time(seed=seed)
    async def run():
        lab = harness(LAB, record=record)
        Trace(lab.graph, lines.append)
        async with lab:
            await lab.advance(2.0)
            lab.set_parameters(SensorPublisher, rate_hz=20)
            await lab.advance(1.0)

    run()
    return lines


@pytest.mark.parametrize("seed", [None, 1, 2, 3])
def test_recording_does_not_change_the_run(tmp_path, seed):
    path = tmp_path / "run.mcap"
    assert traced(seed, path) == traced(seed, False)
    assert len(messages(path)) > 150


@virtual_time
async def test_a_tick_is_recorded_before_its_messages(tmp_path):
    path = tmp_path / "run.mcap"
    async with harness(LAB, record=path) as lab:
        await lab.advance(0.5)
    with Bag(path) as bag:
        recorded = [
            Tick.parse(each.channel.plain(each.payload)["data"], each.log_time_ns) for each in bag.entries([TICKS])
        ]
        began_ns = bag.facts.started_ns
    ours = [each for each in recorded if each.timer == "tell_status"]
    assert ours == [Tick("/sensor_processor", "tell_status", 0.5, 500_000_000, began_ns + 500_000_000)]
    assert [each.elapsed_ns for each in recorded if each.timer == "publish_sensors"] == [n * 10**8 for n in range(1, 6)]


@pytest.mark.parametrize("text", ["", "/node", "/node timer 0.1", "/node timer x 3", "/node timer 0.1 y"])
def test_what_is_no_tick_is_none(text):
    assert Tick.parse(text, 0) is None


def real_time(test):
    @functools.wraps(test)
    def run(*args, **kwargs):
        asyncio.run(test(*args, **kwargs))

    return run


def entries(path, topic=None):
    with Bag(path) as bag:
        return [(entry.channel, entry) for entry in bag.entries() if topic is None or entry.channel.topic == topic]


def plain(path, topic):
    return [channel.plain(entry.payload) for channel, entry in entries(path, topic)]


class Gain(Parameters):
    gain: float = 1.0
    note: str | None = None


class Count(Message, package="test"):
    number: int64 = 0


class Odd(Message, package="test"):
    """ROS has no word for a value that may be missing."""

    value: float | None = None


class Counter(Node):
    """Publishes ten times a second, something that others do not see too, and answers."""

    parameters: Gain
    counts = publisher(Count, "count")
    hidden = publisher(Count, "_inner")
    odd = publisher(Odd, "odd")
    never = publisher(Count, "never")
    latched = publisher(Count, "latched", qos=QoS(depth=1, durability="transient_local"))

    async def start(self) -> None:
        self.number = 0

    @timer(0.1)
    def count(self) -> None:
        self.number += 1
        self.counts.publish(Count(number=self.number * int(self.parameters.gain)))
        self.hidden.publish(Count(number=self.number))
        self.odd.publish(Odd(value=self.number / 2 if self.number % 2 else None))
        self.latched.publish(Count(number=self.number))
        if self.number == 3:
            self.log.warning("three", half=1.5)

    @service(SetBool, "~/set")
    def set(self, request: SetBool.Request) -> SetBool.Response:
        if not request.data:
            raise RuntimeError("no")
        return SetBool.Response(success=True, message="set")


@virtual_time
async def test_parameter_changes_are_recorded_in_order_with_messages(tmp_path):
    path = tmp_path / "run.mcap"
    async with harness(Counter, record=path) as lab:
        await lab.advance(0.25)
        lab.set_parameters(Counter, gain=10)
        lab.set_parameters(Counter, gain=10, note="louder")
        await lab.advance(0.2)
    first, gain, note = plain(path, "/parameter_events")
    assert first["node"] == "/counter"
    assert [(each["name"], each["value"]["double_value"]) for each in first["new_parameters"]] == [("gain", 1.0)]
    assert [(each["name"], each["value"]["double_value"]) for each in gain["changed_parameters"]] == [("gain", 10.0)]
    assert [each["name"] for each in note["new_parameters"]] == ["note"]
    order = [channel.topic for channel, _ in entries(path) if channel.topic in {"/parameter_events", "/count"}]
    told, counted = "/parameter_events", "/count"
    assert order == [told, counted, counted, told, told, counted, counted]
    assert [each["number"] for each in plain(path, "/count")] == [1, 2, 30, 40]


@virtual_time
async def test_parameter_events_with_a_subscriber_are_recorded_once(tmp_path):
    class Listener(Node):
        events = subscription(ParameterEvent, "/parameter_events", qos=PARAMETER_EVENTS)

    path = tmp_path / "run.mcap"
    async with harness(Counter, Listener, record=path) as lab:
        lab.set_parameters(Counter, gain=2)
        await lab.advance(0.1)
        assert len(lab.received("/parameter_events")) == 2
    assert len(plain(path, "/parameter_events")) == 2


@virtual_time
async def test_a_call_is_recorded_with_request_and_answer(tmp_path):
    path = tmp_path / "run.mcap"
    async with harness(Counter, record=path) as lab:
        await lab.call(SetBool, "/counter/set", SetBool.Request(data=True))
        with pytest.raises(ServiceFailed):
            await lab.call(SetBool, "/counter/set", SetBool.Request(data=False))
    asked, answered, failed = plain(path, "/counter/set/_service_event")
    assert [each["info"]["event_type"] for each in (asked, answered, failed)] == [1, 2, 1]
    assert [each["info"]["sequence_number"] for each in (asked, answered, failed)] == [1, 1, 2]
    assert (asked["request"], asked["response"]) == (({"data": True},), ())
    assert (answered["request"], answered["response"]) == ((), ({"success": True, "message": "set"},))
    assert failed["request"] == ({"data": False},)
    assert len({bytes(each["info"]["client_gid"]) for each in (asked, answered, failed)}) == 1
    (channel, _), *_ = entries(path, "/counter/set/_service_event")
    assert channel.type_name == "std_srvs/srv/SetBool_Event"
    assert "SetBool_Request[<=1] request" in channel.definition


@virtual_time
async def test_log_is_recorded_without_a_subscription(tmp_path):
    path = tmp_path / "run.mcap"
    async with harness(Counter, record=path) as lab:
        await lab.advance(0.5)
    (line,) = plain(path, "/rosout")
    assert (line["name"], line["msg"], line["level"]) == ("/counter", "three half=1.5", 30)


@virtual_time
async def test_what_ros_cannot_describe_is_recorded_as_json(tmp_path):
    path = tmp_path / "run.mcap"
    async with harness(Counter, record=path) as lab:
        await lab.advance(0.2)
    (channel, first), (_, second) = entries(path, "/odd")
    assert channel.encoding == "json"
    assert [json.loads(bytes(entry.payload)) for entry in (first, second)] == [{"value": 0.5}, {"value": None}]
    assert json.loads(channel.definition)["properties"]["value"]


@virtual_time
async def test_silent_topics_are_recorded_and_hidden_ones_omitted(tmp_path):
    path = tmp_path / "run.mcap"
    async with harness(Counter, record=path) as lab:
        await lab.advance(0.2)
    with Bag(path) as bag:
        counts = {channel.topic: channel.count for channel in bag.channels}
        qos = {channel.topic: offered(channel.qos) for channel in bag.channels}
    assert counts["/never"] == 0
    assert "/_inner" not in counts
    assert qos["/latched"].durability.value == "transient_local"


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"topics": ["/count"]}, {"/count"}),
        ({"topics": ["count", "/nev*"]}, {"/count", "/never"}),
        ({"topics": ["/_inner"]}, {"/_inner"}),
        ({"topics": ["/counter/*"]}, {"/counter/set/_service_event"}),
        ({"exclude": ["/**"]}, set()),
        ({"exclude": ["/**/_service_event", "/rosout"]}, {"/count", "/never", "/odd", "/latched"}),
        ({"topics": ["/*"], "exclude": ["/o*", "/never"]}, {"/count", "/latched", "/rosout"}),
    ],
)
def test_selected_topics_and_all_parameters_are_recorded(tmp_path, keys, expected):
    path = tmp_path / "run.mcap"

    @virtual_time
    async def run():
        async with harness(Counter, record={"to": str(path), **keys}) as lab:
            await lab.advance(0.5)

    run()
    with Bag(path) as bag:
        assert {channel.topic for channel in bag.channels} == expected | {"/parameter_events", TICKS}
        assert bag.complete


@virtual_time
async def test_unmatched_pattern_is_logged(tmp_path, golden):
    async with harness(Counter, record={"to": str(tmp_path / "run.mcap"), "topics": ["/cuont"]}) as lab:
        await lab.advance(0.1)
    golden("\n".join(line.event for line in lab.log))


@pytest.mark.parametrize(
    "wrong", [{"to": "a.mcap", "topic": ["/a"]}, {"topics": []}, {"to": "a.mcap", "topics": ["$"]}]
)
@virtual_time
async def test_keys_that_cannot_be_are_refused(wrong):
    with pytest.raises(InvalidParameter):
        harness(Counter, record=wrong)


class Crooked(Message, package="test"):
    text: str = ""


class Twister(Node):
    """Every third message is made past its check."""

    texts = publisher(Crooked, "text")

    async def start(self) -> None:
        self.number = 0

    @timer(0.1)
    def talk(self) -> None:
        self.number += 1
        self.texts.publish(Crooked.model_construct(text=5) if self.number % 3 == 0 else Crooked(text="plain"))


@virtual_time
async def test_an_unwritable_message_is_a_gap_with_warning(tmp_path, golden):
    path = tmp_path / "run.mcap"
    async with harness(Twister, record=path) as lab:
        await lab.advance(1.0)
        assert len(lab.received("/text")) == 10
    assert [line.level for line in lab.log] == ["warning"]
    golden(lab.log[0].event)
    told = lab.graph.report().recording
    assert (told.missed, told.complete) == (3, False)
    with Bag(path) as bag:
        found = [entry.sequence for entry in bag.entries(["/text"])]
        assert not bag.complete
        assert (bag.ledger.missed, bag.ledger.complete) == (3, False)
    assert len(found) == 7
    assert found[:3] == [2, 4, 9]  # each after a tick; the sixth is missing, the seventh is the warning itself


@virtual_time
async def test_where_nothing_may_be_missing_the_run_ends(tmp_path, golden):
    record = {"to": str(tmp_path / "run.mcap"), "on_drop": "fail"}
    with golden.raises(IncompleteRecording):
        async with harness(Twister, record=record) as lab:
            await lab.advance(1.0)
    assert lab.graph.exit_code == ExitCode.INCOMPLETE
    assert lab.graph.report().duration_s == pytest.approx(0.3)


@virtual_time
async def test_an_existing_file_is_never_overwritten(tmp_path):
    path = tmp_path / "run.mcap"
    path.write_bytes(b"precious")
    with pytest.raises(RecordingRefused):
        async with harness(Counter, record=path):
            pass
    assert path.read_bytes() == b"precious"


@virtual_time
async def test_restarted_node_records_parameters_only_once(tmp_path):
    class Brittle(Node):
        parameters: Gain

        @timer(0.3)
        def break_(self) -> None:
            raise RuntimeError("broken")

    path = tmp_path / "run.mcap"
    restarted = supervised(Brittle, restart="on-failure")
    async with harness(restarted, record=path) as lab:
        await lab.advance(0.2)
        lab.set_parameters(Brittle, gain=3)
        await lab.advance(3.0)
    assert lab.graph.report().nodes[0].restarts >= 1
    assert len(plain(path, "/parameter_events")) == 2


@real_time
async def test_a_run_in_real_time_is_recorded_whole(tmp_path):
    path = tmp_path / "run.mcap"
    async with busflow.launch(Counter, record=path) as graph:
        async for message in graph.subscribe(Count, "count"):
            if message.number == 3:
                break
        assert "busflow.recorder" in {thread.name for thread in threading.enumerate()}
    assert "busflow.recorder" not in {thread.name for thread in threading.enumerate()}
    told = graph.report().recording
    assert told.complete
    with Bag(path) as bag:
        assert bag.complete
        assert bag.facts.clock == "system"
        assert [entry.sequence for entry in bag.entries()] == list(range(1, told.recorded + 1))
    assert [each["number"] for each in plain(path, "/count")][:3] == [1, 2, 3]
    assert bag.ledger.report["topics"]


@real_time
async def test_what_is_large_is_recorded_whole(tmp_path):
    path = tmp_path / "run.mcap"
    frames = [Image(data=np.full(500_000, n, np.uint8), width=n) for n in range(5)]
    async with busflow.launch(Counter, record=path) as graph:
        out = graph.advertise(Image, "frames")
        for frame in frames:
            out.publish(frame)
    support = TypeSupport(Image)
    assert [support.decode(entry.payload) for _, entry in entries(path, "/frames")] == frames


@virtual_time
async def test_deleted_file_is_logged_and_run_goes_on(tmp_path, golden):
    path = tmp_path / "run.mcap"
    async with harness(Counter, record=path) as lab:
        await lab.advance(1.0)
        path.unlink()
        await lab.advance(2.0)
        assert len(lab.received("/count")) == 30
    (told,) = [line.event for line in lab.log if line.node == "busflow"]
    golden(told)
    assert not lab.graph.report().recording.complete
    assert not path.exists()


@virtual_time
async def test_only_messages_in_the_file_are_recorded(tmp_path):
    path, moved = tmp_path / "run.mcap", tmp_path / "moved.mcap"
    async with harness(Counter, record=path) as lab:
        await lab.advance(1.0)
        path.rename(moved)
        await lab.advance(2.0)
    outcome = lab.graph.report().recording
    with Bag(moved) as bag:
        assert outcome.recorded == len([*bag.entries()]) > 0
    assert outcome.missed > 0
    assert outcome.recorded + outcome.missed > 30


@virtual_time
async def test_a_truncated_file_is_not_complete(tmp_path, golden):
    path = tmp_path / "run.mcap"
    async with harness(Counter, record=path) as lab:
        await lab.advance(1.0)
        os.truncate(path, 100)
        await lab.advance(2.0)
    outcome = lab.graph.report().recording
    assert not outcome.complete
    golden(outcome.why)
    assert path.stat().st_size == 100
    with Bag(path) as bag:
        assert outcome.recorded == len([*bag.entries()])
    assert outcome.recorded + outcome.missed > 30


@real_time
async def test_messages_that_a_slow_disk_keeps_are_missed(tmp_path, monkeypatch, limits, golden):
    free = threading.Event()
    write = Destination.write
    async with busflow.launch(Counter, record=tmp_path / "run.mcap") as graph:
        limits(recording_end=0.05)
        monkeypatch.setattr(Destination, "write", lambda self, data: free.wait(30) and write(self, data))
        await anext(graph.subscribe(Count, "count"))
    outcome = graph.report().recording
    free.set()
    assert outcome.missed > 0
    assert (outcome.recorded, outcome.complete) == (0, False)
    golden(outcome.why)


@virtual_time
async def test_full_disk_ends_run_with_on_drop_fail(tmp_path, monkeypatch, golden):
    path, write = tmp_path / "run.mcap", Destination.write

    def write_until_full(self, data):
        if path.stat().st_size > 4000:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(self, data)

    monkeypatch.setattr(Destination, "write", write_until_full)
    with golden.raises(IncompleteRecording):
        async with harness(Counter, record={"to": str(path), "on_drop": "fail"}) as lab:
            await lab.advance(10.0)
    outcome = lab.graph.report().recording
    assert outcome.missed > 0
    with Bag(path) as bag:
        assert outcome.recorded == len([*bag.entries()]) > 0
    assert lab.graph.report().duration_s < 10.0


@virtual_time
async def test_rosbags_reads_it_as_it_reads_ros2_s(tmp_path):
    path = tmp_path / "run.mcap"
    async with harness(LAB, record=path) as lab:
        await lab.advance(1.0)
        await lab.call(Trigger, "/sensor_publisher/reset")
        last = lab.received("/imu/data")[-1]
    with AnyReader([path]) as reader:
        qos = {each.topic: each.ext.offered_qos_profiles for each in reader.connections}
        found = [
            reader.deserialize(payload, each.msgtype)
            for each, _, payload in reader.messages()
            if each.topic == "/imu/data"
        ]
    assert found[-1].linear_acceleration.z == last.linear_acceleration.z
    assert found[-1].header.frame_id == last.header.frame_id
    assert len(found) == 10
    assert qos["/imu/data"][0].reliability.name == "BEST_EFFORT"
    assert qos["/imu/data"][0].depth == 5


@virtual_time
async def test_a_channel_names_its_publishers(tmp_path):
    path = tmp_path / "run.mcap"
    async with harness(LAB, record=path) as lab:
        await lab.advance(1.0)
    with path.open("rb") as stream:
        channels = make_reader(stream).get_summary().channels.values()
    assert {each.topic: each.metadata.get("callerid") for each in channels}["/imu/data"] == "/sensor_publisher"
    with Bag(path) as bag:
        convert(bag, tmp_path / "made.mcap", TargetFormat.MCAP, json.dumps)
    with Bag(tmp_path / "made.mcap") as made:
        assert {each.topic: each.publisher_names for each in made.channels}["/imu/data"] == ("/sensor_publisher",)


def named_status(**fields):
    body = {"__annotations__": dict.fromkeys(fields, int64), "__module__": __name__, **fields}
    return type(Message)("Status", (Message,), body, package="lab")


@virtual_time
async def test_two_types_of_one_name_stay_apart(tmp_path):
    arm_status, leg_status = named_status(joints=6), named_status(joints=12, load=80)

    class Limbs(Node):
        arm = publisher(arm_status, "arm")
        leg = publisher(leg_status, "leg")

        @timer(0.1)
        def tell(self):
            self.arm.publish(arm_status())
            self.leg.publish(leg_status())

    async with harness(Limbs, record=tmp_path / "run.mcap") as lab:
        await lab.advance(0.1)
    with Bag(tmp_path / "run.mcap") as bag:
        found = {entry.channel.topic: entry.channel.plain(entry.payload) for entry in bag.entries(["arm", "leg"])}
    assert found == {"/arm": {"joints": 6}, "/leg": {"joints": 12, "load": 80}}


def test_share_survives_its_way_as_json(tmp_path):
    spec = RecordSpec(to="run.mcap", topics=("/a",), exclude=("/b",))
    share = Share("main", tmp_path / "run.mcap", spec, frozenset({"/one", "/two"}), {"/c": "other"})
    assert Share.of_json(json.loads(json.dumps(share.as_json()))) == share
