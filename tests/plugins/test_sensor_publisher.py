"""The lab's sensors: what they publish, when, and within which bounds."""

import tracemalloc
from math import sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow import SENSOR_DATA, BusflowError, Time
from busflow.msgs.geometry_msgs import Quaternion
from busflow.msgs.sensor_msgs import Image, Imu, JointState
from busflow.testing import harness, virtual_time
from plugins.sensor_publisher import SensorPublisher

JOINTS = [
    "left_hip_joint",
    "right_hip_joint",
    "left_knee_joint",
    "right_knee_joint",
    "left_ankle_joint",
    "right_ankle_joint",
    "left_shoulder_joint",
    "right_shoulder_joint",
    "left_elbow_joint",
    "right_elbow_joint",
]


def swing(t):
    """The ten joints, t seconds after the start."""
    hip, knee, ankle = 0.2 * sin(t), 0.1 * sin(t), 0.05 * sin(t + 0.5)
    shoulder, elbow = 0.3 * sin(t + 1.0), 0.2 * sin(t + 1.5)
    return [each for pair in (hip, knee, ankle, shoulder, elbow) for each in (pair, pair)]


@virtual_time
async def messages(message_type, topic, duration_s, *, seed=0, **parameters):
    """What the sensors publish on a topic, each with the time at which it says so: since the start, in seconds."""
    async with harness(SensorPublisher(**parameters), seed=seed) as lab:
        began = lab.graph.clock.now()
        await lab.advance(duration_s)
        received = lab.received(topic, message_type)
    return [((Time.from_msg(each.header.stamp) - began).seconds, each) for each in received]


@pytest.mark.parametrize(("topic", "message_type"), [("imu/data", Imu), ("joint_states", JointState)])
def test_readings_come_at_ten_hertz(topic, message_type):
    assert [stamp for stamp, _ in messages(message_type, topic, 2.5)] == [k / 10 for k in range(1, 26)]


@pytest.mark.parametrize(("topic", "message_type"), [("imu/data", Imu), ("joint_states", JointState)])
def test_rate_hz_sets_the_rate(topic, message_type):
    assert [stamp for stamp, _ in messages(message_type, topic, 0.07, rate_hz=50)] == [0.02, 0.04, 0.06]


@pytest.mark.parametrize(("topic", "message_type"), [("imu/data", Imu), ("joint_states", JointState)])
def test_a_rate_of_zero_is_silence(topic, message_type):
    assert messages(message_type, topic, 10, rate_hz=0) == []


@given(noise=st.floats(min_value=0, max_value=10), seed=st.integers(min_value=0, max_value=2**32))
def test_the_imu_stays_within_its_noise(noise, seed):
    for _, imu in messages(Imu, "imu/data", 2, seed=seed, noise={"imu": noise}):
        acceleration, rotation = imu.linear_acceleration, imu.angular_velocity
        assert max(abs(acceleration.x), abs(acceleration.y)) <= noise
        assert 9.8 - 2 * noise <= acceleration.z <= 9.8 + 2 * noise
        assert max(abs(rotation.x), abs(rotation.y), abs(rotation.z)) <= noise / 2


def test_the_imu_makes_use_of_all_its_noise():
    """200 uniform values reach beyond nine tenths of each bound, on both sides; the noise is 0.1 by default."""
    readings = [imu for _, imu in messages(Imu, "imu/data", 20)]
    bounds = {
        "acceleration x": (0.1, [each.linear_acceleration.x for each in readings]),
        "acceleration y": (0.1, [each.linear_acceleration.y for each in readings]),
        "acceleration z": (0.2, [each.linear_acceleration.z - 9.8 for each in readings]),
        "rotation x": (0.05, [each.angular_velocity.x for each in readings]),
        "rotation y": (0.05, [each.angular_velocity.y for each in readings]),
        "rotation z": (0.05, [each.angular_velocity.z for each in readings]),
    }
    for name, (bound, values) in bounds.items():
        assert 0.9 * bound < max(values) <= bound, name
        assert -bound <= min(values) < -0.9 * bound, name
    assert len({tuple(values) for _, values in bounds.values()}) == len(bounds), "each axis has noise of its own"


def test_the_imu_is_upright_in_its_own_frame():
    ((_, imu),) = messages(Imu, "imu/data", 0.1)
    assert imu.orientation == Quaternion(x=0.0, y=0.0, z=0.0, w=1.0)
    assert imu.header.frame_id == "imu_link"


def test_ten_joints_swing_by_their_formulas():
    for t, joints in messages(JointState, "joint_states", 10):
        assert list(joints.name) == JOINTS
        assert joints.position == pytest.approx(swing(t), abs=1e-12)


def test_joints_neither_move_nor_push():
    ((_, joints),) = messages(JointState, "joint_states", 0.1)
    assert joints.velocity.tolist() == joints.effort.tolist() == [0.0] * 10


def test_joint_noise_is_bounded_and_on_positions():
    readings = messages(JointState, "joint_states", 10, noise={"joints": 0.01})
    off = np.array([joints.position - swing(t) for t, joints in readings])
    assert 0.009 < off.max() <= 0.01
    assert -0.01 <= off.min() < -0.009
    assert not any(joints.velocity.any() or joints.effort.any() for _, joints in readings)


def test_a_seed_decides_every_reading():
    assert messages(Imu, "imu/data", 1, seed=7) == messages(Imu, "imu/data", 1, seed=7)
    assert messages(Imu, "imu/data", 1, seed=7) != messages(Imu, "imu/data", 1, seed=8)


@virtual_time
async def test_there_is_no_camera_unless_asked_for():
    async with harness(SensorPublisher()) as lab:
        report = lab.graph.report()
    assert [topic.name for topic in report.topics] == ["/imu/data", "/joint_states"]
    assert [timer.name for timer in report.timers] == ["publish_sensors"]


def test_camera_publishes_at_its_size_and_rate():
    frames = messages(Image, "camera/image_raw", 0.15, camera_hz=20, camera_width=64, camera_height=48)
    assert [stamp for stamp, _ in frames] == [0.05, 0.1, 0.15]
    for _, frame in frames:
        assert (frame.width, frame.height, frame.encoding, frame.step) == (64, 48, "rgb8", 64 * 3)
        assert isinstance(frame.data, np.ndarray)
        assert frame.data.shape == (64 * 48 * 3,)


def test_frames_are_640_by_480_and_differ():
    (_, first), (_, second) = messages(Image, "camera/image_raw", 0.067, camera_hz=30)
    assert (first.width, first.height) == (640, 480)
    assert not np.array_equal(first.data, second.data)


@virtual_time
async def test_the_camera_offers_best_effort(golden):
    async with harness(SensorPublisher(camera_hz=30)) as lab:
        lab.subscribe(Image, "camera/image_raw", qos=SENSOR_DATA)
        with golden.raises(BusflowError):
            lab.subscribe(Image, "camera/image_raw")


@virtual_time
async def test_a_frame_is_written_once_and_never_copied():
    """Publishing takes the memory of one frame, also with two subscribers, which share it."""
    async with harness(SensorPublisher(camera_hz=30)) as lab:
        ends = [lab.subscribe(Image, "camera/image_raw", qos=SENSOR_DATA) for _ in range(2)]
        lab.node(SensorPublisher).publish_image()  # the first one also makes what makes messages
        tracemalloc.start()
        lab.node(SensorPublisher).publish_image()
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        first, second = [await anext(end) for end in ends]
    assert np.shares_memory(first.data, second.data)
    assert peak < 640 * 480 * 3 * 1.1
