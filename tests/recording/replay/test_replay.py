"""Nodes run again on a recording: the same result without a change, the first difference after one.

Tests of `replay.py`, `history.py`, `inputs.py`, `nodes.py` and `rerun.py`.
"""

import asyncio
import hashlib
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer
from pydantic import Field

import busflow
from busflow import Node, Parameters, client, publisher, service, subscription, timer
from busflow.errors import BagError, IncompleteRecording, InvalidParameter, LaunchError, NotRunning, ReplayDiffers
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.sensor_msgs import Imu
from busflow.msgs.std_msgs import Float64, Header, Int64, String
from busflow.msgs.std_srvs import SetBool, Trigger
from busflow.recording.bag.bag import Bag
from busflow.testing import harness, replay, virtual_time
from plugins.sensor_processor import SensorProcessor
from tests.vectors import cases

LAB = "configs/lab1.yaml"
HUMANOID = "configs/humanoid.yaml"


def recorded(path, *what, seconds=1.0, act=None, **more):
    """A recording of a graph on virtual time; `act` does what a test wants in the middle."""

    @virtual_time
    async def main():
        async with harness(*what, record=path, **more) as lab:
            if act is not None:
                await act(lab)
            await lab.advance(seconds)

    main()
    return path


@pytest.fixture(scope="module")
def lab_bag(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("lab") / "lab.mcap", LAB, seconds=10.0, seed=7)


# The lab.


def test_the_lab_is_the_same(lab_bag):
    outcome = replay(lab_bag, SensorProcessor)
    outcome.assert_same()
    assert outcome.compared == {"/balance_state": 100, "/stability_index": 100}
    assert outcome.nodes == ("/sensor_processor",)
    assert [line.event for line in outcome.log] == ["All sensors operational"]
    assert len(outcome.outputs["/balance_state"]) == 100
    assert outcome.notes == []


def test_random_numbers_are_the_same(lab_bag):
    replay(lab_bag, LAB, nodes=["sensor_publisher"]).assert_same()
    replay(lab_bag, LAB, nodes="/sensor_publisher").assert_same()


def test_a_replay_of_all_repeats_the_recordings_bytes(lab_bag, tmp_path):
    first, second = tmp_path / "first.mcap", tmp_path / "second.mcap"
    for path in (first, second):
        replay(lab_bag, LAB, record=path).assert_same()
    hashes = {hashlib.sha256(path.read_bytes()).hexdigest() for path in (lab_bag, first, second)}
    assert len(hashes) == 1


class Tilted(SensorProcessor):
    """The lab's processor with a bug: it takes the wrong axis."""

    def on_imu(self, imu: Imu) -> None:
        self.imu_received_s = self.clock.seconds()
        balance = min(1.0, abs(imu.linear_acceleration.x) / 2.0)
        self.balance.publish(Float64(data=balance))
        self.stability.publish(Float64(data=1.0 - balance))


def buggy():
    """The bug under the node's own name."""
    return Tilted(name="sensor_processor")


def test_a_planted_bug_is_found(lab_bag, golden):
    outcome = replay(lab_bag, buggy())
    assert not outcome.same
    assert outcome.difference_count == 200
    with pytest.raises(ReplayDiffers) as caught:
        outcome.assert_same()
    first, second, *rest = str(caught.value).splitlines()
    golden(first)
    assert second.startswith("  /balance_state #1 at 0.100000000 s: data: 0.")
    assert rest[-1] == "  … and 195 more"
    assert isinstance(caught.value, AssertionError)


def test_a_tolerance_forgives_what_is_small(lab_bag):
    class Rounded(SensorProcessor):
        def on_imu(self, imu: Imu) -> None:
            before = self.balance.published
            super().on_imu(imu)
            assert self.balance.published == before + 1

    def nudged(amount):
        class Nudged(SensorProcessor):
            def on_imu(self, imu: Imu) -> None:
                self.imu_received_s = self.clock.seconds()
                rotation = np.hypot(np.hypot(imu.angular_velocity.x, imu.angular_velocity.y), imu.angular_velocity.z)
                balance = min(1.0, (abs(imu.linear_acceleration.y) + float(rotation)) / 2.0) + amount
                self.balance.publish(Float64(data=balance))
                self.stability.publish(Float64(data=1.0 - balance))

        return Nudged(name="sensor_processor")

    replay(lab_bag, Rounded(name="sensor_processor")).assert_same()
    assert not replay(lab_bag, nudged(1e-7)).same
    assert replay(lab_bag, nudged(1e-7), tolerance=1e-6).same
    assert not replay(lab_bag, nudged(1e-5), tolerance=1e-6).same


def test_doubled_late_and_missing_messages_are_differences(lab_bag, golden):
    class Twice(SensorProcessor):
        def on_imu(self, imu: Imu) -> None:
            super().on_imu(imu)
            super().on_imu(imu)

    class Late(SensorProcessor):
        async def on_imu(self, imu: Imu) -> None:
            await self.clock.sleep(0.01)
            super().on_imu(imu)

    class Silent(SensorProcessor):
        def on_imu(self, imu: Imu) -> None: ...

    kinds = {
        cls.__name__: {each.kind.value for each in replay(lab_bag, cls(name="sensor_processor")).differences}
        for cls in (Twice, Late, Silent)
    }
    assert kinds == {"Twice": {"content", "extra"}, "Late": {"time", "missing"}, "Silent": {"missing"}}
    (line,) = [str(each) for each in replay(lab_bag, Late(name="sensor_processor")).differences[:1]]
    golden(line)


def test_a_node_that_fails_is_a_difference(lab_bag):
    class Failing(SensorProcessor):
        def on_imu(self, imu: Imu) -> None:
            if self.balance.published == 5:
                raise ValueError("out of balance")
            super().on_imu(imu)

    outcome = replay(lab_bag, Failing(name="sensor_processor"))
    assert [each.kind.value for each in outcome.differences[:1]] == ["failure"]
    assert "out of balance" in outcome.render()
    assert outcome.compared["/balance_state"] == 5


def test_the_humanoid_replays_whole_and_node_by_node(tmp_path):
    path = recorded(tmp_path / "humanoid.mcap", HUMANOID, seconds=1.0, seed=3)
    outcome = replay(path, HUMANOID)
    outcome.assert_same()
    assert outcome.compared["/joint_states"] == 100
    for node in ("sensor_processor", "joint_state_publisher", "motor_controller", "left/joints", "head/camera"):
        replay(path, HUMANOID, nodes=[node]).assert_same()


def test_a_real_time_recording_replays_the_same(tmp_path):
    path = tmp_path / "real.mcap"

    async def main():
        async with busflow.launch(LAB, args={"rate_hz": 200}, record=path) as graph:
            count = 0
            async for _ in graph.subscribe(Float64, "balance_state"):
                count += 1
                if count == 60:
                    break

    asyncio.run(main())
    outcome = replay(path, SensorProcessor)
    outcome.assert_same()
    assert outcome.compared["/balance_state"] >= 60
    assert not replay(path, buggy()).same


# What a node is given.


class Counter(Node):
    """Tells, at each tick, what it has heard since the last one: the order of ticks and inputs is all that matters."""

    counts = publisher(Int64, "counts")
    heard = 0

    @subscription("pulse")
    def hear(self, pulse: Int64) -> None:
        self.heard += pulse.data

    @timer(0.1)
    def tell(self) -> None:
        self.counts.publish(Int64(data=self.heard))


class Pulse(Node):
    pulse = publisher(Int64, "pulse")

    @timer(0.05)
    def beat(self) -> None:
        self.pulse.publish(Int64(data=1))


class Beat(Pulse):
    @timer(0.1)
    def beat(self) -> None:
        self.pulse.publish(Int64(data=1))


@pytest.mark.parametrize("order", [(Beat, Counter), (Counter, Beat)], ids=["input first", "tick first"])
def test_a_tick_and_simultaneous_input_keep_recorded_order(tmp_path, order):
    path = recorded(tmp_path / "run.mcap", *order)
    outcome = replay(path, Counter)
    outcome.assert_same()
    assert outcome.outputs["/counts"][0].data == (1 if order[0] is Beat else 0)


def test_a_timer_with_a_new_period_keeps_it(tmp_path, golden):
    path = recorded(tmp_path / "run.mcap", Pulse, Counter)

    class Faster(Counter):
        @timer(0.05)
        def tell(self) -> None:
            self.counts.publish(Int64(data=self.heard))

    outcome = replay(path, Faster(name="counter"))
    assert len(outcome.outputs["/counts"]) == 20
    assert not outcome.same
    golden("\n".join(outcome.notes))


class GainParameters(Parameters):
    gain: float = 1.0
    limits: dict[str, float] = Field(default={})


class Gain(Node):
    parameters: GainParameters
    out = publisher(Float64, "out")

    @subscription("pulse")
    def hear(self, pulse: Int64) -> None:
        self.out.publish(Float64(data=self.parameters.gain * pulse.data + self.parameters.limits.get("low", 0)))


def test_recorded_parameters_and_their_changes_apply_in_time(tmp_path):
    async def act(lab):
        await lab.advance(0.3)
        lab.set_parameters(Gain, gain=5.0)
        await lab.advance(0.2)
        lab.set_parameters(Gain, limits={"low": 0.5})

    path = recorded(tmp_path / "run.mcap", Pulse, Gain(gain=2.0), act=act, seconds=0.2)
    outcome = replay(path, Gain)
    outcome.assert_same()
    assert [each.data for each in outcome.outputs["/out"]] == [2.0] * 6 + [5.0] * 4 + [5.5] * 4


def test_ignored_values_of_the_launch_file_are_noted(lab_bag):
    told = replay(lab_bag, LAB, nodes=["sensor_publisher"], args={"rate_hz": 50.0})
    (note,) = told.notes
    for each in ("/sensor_publisher ", " rate_hz = 10.0,", f" 50.0 ({LAB}:29:16, "):
        assert each in note
    assert replay(lab_bag, LAB).notes == []


def test_a_refused_parameter_change_is_a_difference(tmp_path):
    async def act(lab):
        lab.set_parameters(Gain, gain=50.0)

    path = recorded(tmp_path / "run.mcap", Pulse, Gain(gain=2.0), act=act)

    class NarrowParameters(Parameters):
        gain: float = Field(default=1.0, le=10)

    class Narrow(Gain):
        parameters: NarrowParameters

        @subscription("pulse")
        def hear(self, pulse: Int64) -> None:
            self.out.publish(Float64(data=self.parameters.gain * pulse.data))

    Narrow.__name__ = "Gain"
    outcome = replay(path, Narrow)
    assert outcome.differences[0].kind.value in {"failure", "content"}
    assert any("is refused now" in str(each) for each in outcome.differences)
    assert any("a parameter limits" in note for note in outcome.notes)


class Switch(Node):
    """Answers, and asks another."""

    on = False
    states = publisher(String, "states")
    lamp = client(SetBool, "lamp/set")

    @service(Trigger, "~/toggle")
    async def on_toggle(self, _request: Trigger.Request) -> Trigger.Response:
        self.on = not self.on
        answer = await self.lamp.call(SetBool.Request(data=self.on))
        self.states.publish(String(data=answer.message))
        return Trigger.Response(success=True, message=f"now {self.on}")


class Lamp(Node):
    @service(SetBool, "~/set")
    async def on_set(self, request: SetBool.Request) -> SetBool.Response:
        await self.clock.sleep(0.25)
        return SetBool.Response(success=True, message=f"lamp {request.data} at {self.clock.seconds():g}")


@pytest.fixture
def calls(tmp_path):
    async def act(lab):
        for _ in range(3):
            await lab.advance(0.1)
            await lab.call(Trigger, "switch/toggle")

    return recorded(tmp_path / "calls.mcap", Switch, Lamp, act=act)


def test_requests_are_repeated_and_answered_from_the_recording(calls):
    outcome = replay(calls, Switch)
    outcome.assert_same()
    assert outcome.compared == {"/lamp/set (requests)": 3, "/states": 3, "/switch/toggle": 3}
    assert [each.data for each in outcome.outputs["/states"]] == [
        "lamp True at 0.35",
        "lamp False at 0.7",
        "lamp True at 1.05",
    ]
    replay(calls, Lamp).assert_same()
    replay(calls, Switch, Lamp).assert_same()


def test_another_answer_and_another_request_are_found(calls):
    class Wrong(Switch):
        async def on_toggle(self, _request: Trigger.Request) -> Trigger.Response:
            answer = await self.lamp.call(SetBool.Request(data=True))
            self.states.publish(String(data=answer.message))
            return Trigger.Response(success=True, message="now on")

    found = {(each.topic, each.number) for each in replay(calls, Wrong(name="switch")).differences}
    assert found == {("/lamp/set (requests)", 2), *(("/switch/toggle", n) for n in (1, 2, 3))}


# What cannot be replayed.


def test_an_incomplete_recording_is_refused_unless_allowed(lab_bag, tmp_path, golden):
    path = tmp_path / "cut.mcap"
    path.write_bytes(lab_bag.read_bytes()[:-3000])
    with golden.raises(IncompleteRecording):
        replay(path, SensorProcessor)
    outcome = replay(path, SensorProcessor, allow_incomplete=True)
    assert outcome.compared["/balance_state"] > 0


def test_a_node_that_no_file_has(lab_bag, golden):
    with golden.raises(BagError):
        replay(lab_bag, LAB, nodes=["sensor_procesor"])


def test_a_replay_with_nothing_to_compare_is_refused(lab_bag, golden):
    class Other(Node):
        out = publisher(Float64, "other")
        balance = subscription(Float64, "balance_state")

    with golden.raises(BagError):
        replay(lab_bag, Other)
    with golden.raises(BagError):
        replay(lab_bag)


def test_another_type_than_the_recorded_one(lab_bag, golden):
    class Whole(Node):
        balance = publisher(Int64, "balance_state")

    with golden.raises(BagError):
        replay(lab_bag, Whole)

    class Deaf(Node):
        out = publisher(Float64, "balance_state")

        @subscription("imu/data")
        def hear(self, number: Float64) -> None: ...

    with golden.raises(BagError):
        replay(lab_bag, Deaf)


@pytest.mark.usefixtures("nothing_installed")
def test_invalid_launch_file_is_reported_as_usual(lab_bag, tmp_path, golden):
    file = tmp_path / "wrong.yaml"
    file.write_text("name: wrong\nnodes:\n  a:\n    plugin: nothing\n")
    with golden.raises(LaunchError):
        replay(lab_bag, file)


def test_inputs_missing_in_the_recording_are_noted(lab_bag, golden):
    class Curious(SensorProcessor):
        @subscription("odometry")
        def hear(self, number: Float64) -> None: ...

    outcome = replay(lab_bag, Curious(name="sensor_processor"))
    outcome.assert_same()
    golden("\n".join(outcome.notes))


def test_a_topic_with_other_publishers_is_not_compared(tmp_path, golden):
    file = tmp_path / "two.yaml"
    file.write_text(
        f"name: two\nplugins: [{Path('plugins').absolute()}]\nnodes:\n"
        "  a: {plugin: sensor_processor}\n  b: {plugin: sensor_processor, remap: {stability_index: other}}\n"
        "  sensor_publisher: {plugin: sensor_publisher}\n"
    )
    path = recorded(tmp_path / "run.mcap", file)
    outcome = replay(path, file, nodes=["b"])
    outcome.assert_same()
    assert outcome.compared == {"/other": 10}
    golden("\n".join(outcome.notes))


@virtual_time
async def test_it_has_an_event_loop_of_its_own(golden):
    with golden.raises(NotRunning):
        replay("run.mcap", SensorProcessor)


def test_parameters_no_longer_valid_are_reported(tmp_path, golden):
    path = recorded(tmp_path / "run.mcap", Pulse, Gain(gain=2.0))

    class WordParameters(Parameters):
        gain: str = ""

    class Word(Gain):
        parameters: WordParameters

    Word.__name__ = "Gain"
    with golden.raises(InvalidParameter):
        replay(path, Word)


# Recordings of others.


class Parrot(Node):
    """Says what it hears in its own words."""

    said = publisher(String, "said")

    @subscription("topic")
    def hear(self, text: String) -> None:
        self.said.publish(String(data=f"{text.data} at {self.clock.now().nanoseconds}"))


def test_messages_recorded_by_ros_2_are_replayed(tmp_path):
    heard = [case for case in cases("g_cdr_recorded") if case["type"] == "std_msgs/msg/String"]
    expected = [f"{case['value']['data']} at {1000 + n * 10**9}" for n, case in enumerate(heard)]
    path = tmp_path / "talker.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "a test")
        text = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
        topic, said = writer.register_channel("/topic", "cdr", text), writer.register_channel("/said", "cdr", text)
        encode = TypeSupport(String).encode
        for number, case in enumerate(heard):
            time_ns = 1000 + number * 10**9
            writer.add_message(topic, time_ns, bytes.fromhex(case["cdr"]), time_ns)
            answer = encode(String(data=expected[number]))
            writer.add_message(said, time_ns + 30_000_000, answer, time_ns)  # a real node takes its time
        writer.finish()
    outcome = replay(path, Parrot)
    outcome.assert_same()
    assert [each.data for each in outcome.outputs["/said"]] == expected
    assert not replay(path, Parrot, time_tolerance_s=0.01).same


def test_only_real_time_stamps_may_differ(tmp_path):
    class Stamper(Node):
        out = publisher(Header, "out")

        @subscription("pulse")
        def hear(self, _pulse: Int64) -> None:
            self.out.publish(Header(stamp=self.clock.now()))

    class Late(Stamper):
        @subscription("pulse")
        def hear(self, _pulse: Int64) -> None:
            self.out.publish(Header(stamp=self.clock.now() + busflow.Duration(1)))

    path = recorded(tmp_path / "run.mcap", Pulse, Stamper)
    replay(path, Stamper).assert_same()
    outcome = replay(path, Late(name="stamper"))
    assert str(outcome.differences[0]) == (
        "/out #1 at 0.050000000 s: stamp: 1767225600.050000000 s -> 1767225600.050000001 s"
    )
    replay(path, Late(name="stamper"), time_tolerance_s=1e-6).assert_same()


def test_the_recording_s_own_replay_is_complete(lab_bag, tmp_path):
    replay(lab_bag, SensorProcessor, record=tmp_path / "out.mcap").assert_same()
    with Bag(tmp_path / "out.mcap") as bag:
        assert bag.complete
        assert {each.topic for each in bag.channels} >= {"/imu/data", "/balance_state"}


def test_what_a_node_had_lost_is_noted(tmp_path, golden):
    class Burst(Node):
        pulse = publisher(Int64, "pulse")

        @timer(0.1)
        def beat(self) -> None:
            for _ in range(3):
                self.pulse.publish(Int64(data=1))

    class Slow(Node):
        heard = publisher(Int64, "heard")

        @subscription("pulse", qos=busflow.QoS(depth=1))
        async def hear(self, pulse: Int64) -> None:
            await self.clock.sleep(0.01)
            self.heard.publish(pulse)

    path = recorded(tmp_path / "run.mcap", Burst, Slow)
    outcome = replay(path, Slow)
    assert outcome.notes[0].startswith("/pulse: /slow dropped ")
    golden(outcome.notes[0])


def test_a_stopped_node_receives_no_replayed_message(tmp_path):
    class Teller(Node):
        numbers = publisher(Int64, "numbers")
        told = 0

        @timer(0.02)
        def tell(self) -> None:
            self.told += 1
            self.numbers.publish(Int64(data=self.told))

    class Slow(Node):
        async def stop(self) -> None:
            await self.clock.sleep(0.5)

    class Echo(Node):
        echoes = publisher(Int64, "echoes")

        @subscription("numbers")
        def hear(self, number: Int64) -> None:
            self.echoes.publish(number)

    path = recorded(tmp_path / "run.mcap", Teller, Slow, Echo)  # the last one stops first
    with Bag(path) as bag:
        counts = {each.topic: each.count for each in bag.channels}
    assert counts["/numbers"] > counts["/echoes"] > 0
    outcome = replay(path, Echo)
    outcome.assert_same()
    assert outcome.compared == {"/echoes": counts["/echoes"]}
    assert outcome.notes == []


def test_what_the_recording_has_not_is_noted(tmp_path, golden):
    path = tmp_path / "run.mcap"
    recorded({"to": str(path), "topics": ["counts"]}, Pulse, Counter)
    outcome = replay(path, Counter)
    assert not outcome.same
    golden("\n".join(outcome.notes))


def test_a_ros_2_bag_is_replayed():
    outcome = replay("tests/cases/rosbag2/talker", Parrot)
    assert {each.kind.value for each in outcome.differences} == {"extra"}  # nobody said it then
    said = [each.data for each in outcome.outputs["/said"]]
    assert said[0] == "Hello, world! 0 at 1585866235112609068"
    assert len(said) == 10
