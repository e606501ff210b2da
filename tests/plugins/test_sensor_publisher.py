"""The lab's sensors: what they publish, when, and within which bounds."""

import tracemalloc
from math import sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from busflow import SENSOR_DATA, BusflowError, Graph, Reliability
from busflow.clock import SIM_EPOCH_NS, SimClock
from busflow.msgs.geometry_msgs import Quaternion
from busflow.msgs.sensor_msgs import Image, Imu, JointState
from busflow.testing import virtual_time
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


def stamp_s(message):
    """The stamp, in seconds since simulated time began."""
    stamp = message.header.stamp
    return (stamp.sec * 10**9 + stamp.nanosec - SIM_EPOCH_NS) / 10**9


@virtual_time
async def messages(message_type, topic, count, *, seed=0, qos=None, **parameters):
    """The first messages that the sensors publish on a topic."""
    async with Graph([SensorPublisher(**parameters)], clock=SimClock(), seed=seed) as graph:
        subscription = graph.subscribe(message_type, topic, qos=qos)
        return [await anext(subscription) for _ in range(count)]


@pytest.mark.parametrize(("topic", "message_type"), [("imu/data", Imu), ("joint_states", JointState)])
def test_readings_come_ten_times_a_second_from_the_first_tenth_on(topic, message_type):
    assert [stamp_s(each) for each in messages(message_type, topic, 25)] == [k / 10 for k in range(1, 26)]


@pytest.mark.parametrize(("topic", "message_type"), [("imu/data", Imu), ("joint_states", JointState)])
def test_rate_hz_sets_the_rate(topic, message_type):
    assert [stamp_s(each) for each in messages(message_type, topic, 3, rate_hz=50)] == [0.02, 0.04, 0.06]


@virtual_time
async def test_a_rate_of_zero_is_silence():
    async with Graph([SensorPublisher(rate_hz=0)], clock=SimClock()) as graph:
        await graph.clock.sleep(10)
    assert {topic.name: topic.published for topic in graph.report().topics} == {"/imu/data": 0, "/joint_states": 0}


@given(noise=st.floats(min_value=0, max_value=10), seed=st.integers(min_value=0, max_value=2**32))
@settings(max_examples=20, deadline=None)
def test_the_imu_stays_within_its_noise(noise, seed):
    for imu in messages(Imu, "imu/data", 20, seed=seed, noise={"imu": noise}):
        acceleration, rotation = imu.linear_acceleration, imu.angular_velocity
        assert max(abs(acceleration.x), abs(acceleration.y)) <= noise
        assert 9.8 - 2 * noise <= acceleration.z <= 9.8 + 2 * noise
        assert max(abs(rotation.x), abs(rotation.y), abs(rotation.z)) <= noise / 2


def test_the_imu_makes_use_of_all_its_noise():
    """200 uniform values reach beyond nine tenths of each bound, on both sides; the noise is 0.1 unless told."""
    readings = messages(Imu, "imu/data", 200)
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
    (imu,) = messages(Imu, "imu/data", 1)
    assert imu.orientation == Quaternion(x=0.0, y=0.0, z=0.0, w=1.0)
    assert imu.header.frame_id == "imu_link"


def test_ten_joints_swing_by_their_formulas():
    for joints in messages(JointState, "joint_states", 100):
        assert list(joints.name) == JOINTS
        assert joints.position == pytest.approx(swing(stamp_s(joints)), abs=1e-12)


def test_joints_neither_move_nor_push():
    (joints,) = messages(JointState, "joint_states", 1)
    assert joints.velocity.tolist() == joints.effort.tolist() == [0.0] * 10


def test_joint_noise_is_on_positions_alone_and_within_its_bound():
    readings = messages(JointState, "joint_states", 100, noise={"joints": 0.01})
    off = np.array([each.position - swing(stamp_s(each)) for each in readings])
    assert 0.009 < off.max() <= 0.01
    assert -0.01 <= off.min() < -0.009
    assert not any(each.velocity.any() or each.effort.any() for each in readings)


@virtual_time
async def test_reset_lets_the_joints_begin_anew():
    async with Graph([SensorPublisher()], clock=SimClock()) as graph:
        subscription = graph.subscribe(JointState, "joint_states")
        await graph.clock.sleep(2.05)
        graph.node(SensorPublisher).reset()
        await graph.clock.sleep(0.1)
        joints = subscription.latest
    assert stamp_s(joints) == 2.1
    assert joints.position == pytest.approx(swing(0.05), abs=1e-12)


def test_a_seed_decides_every_reading():
    assert messages(Imu, "imu/data", 5, seed=7) == messages(Imu, "imu/data", 5, seed=7)
    assert messages(Imu, "imu/data", 5, seed=7) != messages(Imu, "imu/data", 5, seed=8)


@virtual_time
async def test_there_is_no_camera_unless_asked_for():
    async with Graph([SensorPublisher()], clock=SimClock()) as graph:
        await graph.clock.sleep(1)
        report = graph.report()
    assert [topic.name for topic in report.topics] == ["/imu/data", "/joint_states"]
    assert [timer.name for timer in report.timers] == ["publish_sensors"]


def test_the_camera_publishes_frames_of_its_size_at_its_rate():
    frames = messages(Image, "camera/image_raw", 3, qos=SENSOR_DATA, camera_hz=20, camera_width=64, camera_height=48)
    for frame in frames:
        assert (frame.width, frame.height, frame.encoding, frame.step) == (64, 48, "rgb8", 64 * 3)
        assert isinstance(frame.data, np.ndarray)
        assert frame.data.shape == (64 * 48 * 3,)
    assert [stamp_s(each) for each in frames] == [0.05, 0.1, 0.15]
    assert frames[0].data.tolist() != frames[1].data.tolist(), "a viewer sees that it is live"


@virtual_time
async def test_the_camera_offers_best_effort():
    async with Graph([SensorPublisher(camera_hz=30)], clock=SimClock()) as graph:
        with pytest.raises(BusflowError, match="best_effort is offered, reliable is requested"):
            graph.subscribe(Image, "camera/image_raw")
        received = graph.subscribe(Image, "camera/image_raw", qos=SENSOR_DATA)
        assert received.endpoint.qos.reliability is Reliability.BEST_EFFORT
        assert (await anext(received)).width == 640


@virtual_time
async def test_a_frame_is_written_once_and_never_copied():
    """Publishing takes the memory of one frame, also with two subscribers, who share it."""
    async with Graph([SensorPublisher(camera_hz=30)], clock=SimClock()) as graph:
        first = graph.subscribe(Image, "camera/image_raw", qos=SENSOR_DATA)
        second = graph.subscribe(Image, "camera/image_raw", qos=SENSOR_DATA)
        tracemalloc.start()
        graph.node(SensorPublisher).publish_image()
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert np.shares_memory((await anext(first)).data, (await anext(second)).data)
    assert peak < 640 * 480 * 3 * 1.1
