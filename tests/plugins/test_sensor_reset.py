"""The lab's simulation begins anew: after a reset it is what it was from the start, line by line and byte by byte."""

from collections import Counter
from pathlib import Path

import pytest

from busflow import Time
from busflow.cli import main
from busflow.clock import NS_PER_S
from busflow.msgs.sensor_msgs import Image, Imu, JointState
from busflow.msgs.std_srvs import Trigger
from busflow.testing import harness, virtual_time
from busflow.testing.trace import Trace, content_hash
from plugins.sensor_processor import SensorProcessor
from plugins.sensor_publisher import SensorPublisher

CONFIGS = Path(__file__).parents[2] / "configs"
RESET = "sensor_publisher/reset"
SPAN_S = 5.0
"""How long each trace is."""
NOISY = {"noise": {"imu": 0.3, "joints": 0.02}, "camera_hz": 12.5, "camera_width": 8, "camera_height": 4}

each_moment = pytest.mark.parametrize("reset_s", [1.0, 0.05, 1.234567891, 3.999999999])


class Tracer:
    """The lines of a graph's trace from one moment on, its time and sequence subtracted from lines and stamps."""

    def __init__(self, lab):
        self.lab = lab
        self.lines = []
        Trace(lab.graph, self.lines.append)

    def from_now(self):
        """Forget the trace so far, and count from now."""
        self.lines.clear()
        self.began, self.began_ns = self.lab.graph.clock.now(), self.lab.graph.clock.elapsed_ns()
        self.before = Counter({topic: len(self.lab.received(topic)) for topic in self.lab.graph.bus.topics})

    def trace(self):
        topics = self.lab.graph.bus.topics
        messages = [message for topic in topics for message in self.lab.received(topic)[self.before[topic] :]]
        hashes = {content_hash(message): content_hash(self.restamped(message)) for message in messages}
        return [self.subtracted(line.split(), hashes) for line in self.lines]

    def restamped(self, message):
        if not hasattr(message, "header"):
            return message
        age = Time.from_msg(message.header.stamp) - self.began
        return message.replace(header=message.header.replace(stamp=Time(age.nanoseconds)))

    def subtracted(self, words, hashes):
        words = [nanoseconds(words[0]) - self.began_ns, *(hashes.get(word, word) for word in words[1:])]
        if words[1] == "publish":
            words[3] = int(words[3].removeprefix("#")) - self.before[words[2]]
        return words


def nanoseconds(column):
    seconds, fraction = column.split(".")
    return int(seconds) * NS_PER_S + int(fraction)


@virtual_time
async def traced(graph, *, reset_s=None):
    """What the trace says for a while: from the start on, or from a reset at a later time on."""
    lab = harness(*graph(), seed=7)
    tracer = Tracer(lab)
    async with lab:
        if reset_s is not None:
            await lab.advance(reset_s)
            assert (await lab.call(Trigger, RESET)).success
        tracer.from_now()
        await lab.advance(SPAN_S)
        return tracer.trace()


@each_moment
def test_reset_sensors_repeat_their_trace(reset_s):
    def sensors():
        return [SensorPublisher(**NOISY)]

    from_start = traced(sensors)
    assert Counter(line[1] for line in from_start) == {"timer": 50 + 62, "publish": 2 * 50 + 62}
    assert traced(sensors, reset_s=reset_s) == from_start


@each_moment
def test_reset_lab_repeats_its_trace(reset_s):
    """Its own timer goes on as it did, and what it said of the sensors it does not say again."""

    def lab():
        return [SensorPublisher(**NOISY), SensorProcessor]

    def without_memory(lines):
        return [
            line for line in lines if line[1:3] not in (["timer", "/sensor_processor"], ["log", "/sensor_processor"])
        ]

    from_start = without_memory(traced(lab))
    topics = {line[2] for line in from_start if line[1] == "publish"}
    assert topics == {"/imu/data", "/joint_states", "/camera/image_raw", "/balance_state", "/stability_index"}
    assert sum(line[1] == "deliver" for line in from_start) == 2 * 50
    assert without_memory(traced(lab, reset_s=reset_s)) == from_start


OPERATOR = """
from busflow import Node, client
from busflow.msgs.std_srvs import Trigger


class Operator(Node):
    reset = client(Trigger, "sensor_publisher/reset")

    async def run(self) -> None:
        await self.clock.sleep(5.05)
        answer = await self.reset.call()
        self.log.info(answer.message)
"""


def test_simulated_run_repeats_after_a_reset(tmp_path, capsys):
    """By the real command, whose trace has the hashes of stamped messages: of the others each one is the same."""
    (tmp_path / "plugins").mkdir()
    (tmp_path / "plugins/operator.py").write_text(OPERATOR)
    file, trace = tmp_path / "again.yaml", tmp_path / "trace.txt"
    file.write_text(f"plugins: [plugins]\ninclude: {CONFIGS}/lab1.yaml\nnodes: {{operator: {{plugin: operator}}}}\n")
    assert main(["run", str(file), "--sim", "--for", "10.1s", "--seed", "7", "--trace", str(trace)]) == 0
    assert "began anew after 5.05 s" in capsys.readouterr().err
    lines = [line.split() for line in trace.read_text("utf-8").splitlines()]
    published = [(nanoseconds(time), *words) for time, kind, *words in lines if kind == "publish"]
    reset_ns = nanoseconds("5.050000000")
    first = [line for line in published if line[0] < reset_ns]
    again = [(ns - reset_ns, topic, number, content) for ns, topic, number, content in published if ns > reset_ns]
    assert len(first) == len(again) == 4 * 50
    for before, after in zip(first, again, strict=True):
        assert after[:2] == before[:2]
        assert int(after[2].removeprefix("#")) == int(before[2].removeprefix("#")) + 50
        assert after[1] in {"/imu/data", "/joint_states"} or after[3] == before[3]


@virtual_time
async def test_reset_reports_the_elapsed_time():
    async with harness(SensorPublisher) as lab:
        for seconds in (2.5, 0.25):
            await lab.advance(seconds)
            answer = await lab.call(Trigger, RESET)
            assert (answer.success, answer.message) == (True, f"began anew after {seconds:g} s")
        assert [line.values for line in lab.log] == [{"after_s": 2.5}, {"after_s": 0.25}]


@virtual_time
async def test_reset_after_a_day_is_exact():
    async with harness(SensorPublisher(**NOISY)) as lab:
        await lab.advance(1)
        first = lab.received("joint_states", JointState), lab.received("imu/data", Imu)
        lab.set_parameters(SensorPublisher, rate_hz=0)
        lab.node(SensorPublisher).camera.cancel()
        await lab.advance(86390.123456789)
        await lab.call(Trigger, RESET)
        lab.set_parameters(SensorPublisher, rate_hz=10)
        await lab.advance(1)
        joints, imus = lab.received("joint_states", JointState)[10:], lab.received("imu/data", Imu)[10:]
    assert [each.position.tolist() for each in joints] == [each.position.tolist() for each in first[0]]
    assert [each.linear_acceleration for each in imus] == [each.linear_acceleration for each in first[1]]


@virtual_time
async def test_a_reset_keeps_disabled_sensors_and_parameters():
    async with harness(SensorPublisher(rate_hz=0, noise={"imu": 0.7})) as lab:
        await lab.advance(1)
        await lab.call(Trigger, RESET)
        await lab.advance(10)
        assert lab.received("imu/data") == []
        assert lab.node(SensorPublisher).parameters.noise.imu == 0.7


@virtual_time
async def test_the_camera_s_picture_begins_anew_too():
    async with harness(SensorPublisher(camera_hz=10, camera_width=20, camera_height=1)) as lab:
        await lab.advance(0.75)
        await lab.call(Trigger, RESET)
        await lab.advance(0.35)
        frames = [frame.data.tolist() for frame in lab.received("camera/image_raw", Image)]
    assert len(frames) == 7 + 3
    assert frames[7:] == frames[:3]
    assert frames[0] != frames[1]
