"""The lab's processor: its metrics, what it warns of, and the four things it says about the sensors."""

from math import cos, pi, sin, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow import SENSOR_DATA
from busflow.msgs.geometry_msgs import Quaternion, Vector3
from busflow.msgs.sensor_msgs import Imu, JointState
from busflow.testing import harness, virtual_time
from plugins.sensor_processor import SensorProcessor

ALL = "All sensors operational"
ONLY_IMU = "IMU operational, joint sensors offline"
ONLY_JOINTS = "Joint sensors operational, IMU offline"
NOTHING = "No sensor data received"

components = st.floats(min_value=-2, max_value=2)
vectors = st.builds(Vector3, x=components, y=components, z=components)


def imu_of(acceleration=None, rotation=None):
    return Imu(linear_acceleration=acceleration or Vector3(), angular_velocity=rotation or Vector3())


def processor_log(lab):
    """Its log lines: (level, text, values)."""
    return [(each.level, each.event, each.values) for each in lab.log if each.node == "/sensor_processor"]


@virtual_time
async def metrics(*imus):
    """What the processor makes of each reading: (balance, stability)."""
    async with harness(SensorProcessor()) as lab:
        for imu in imus:
            lab.publish("imu/data", imu)
            await lab.settle()
        received = zip(lab.received("balance_state"), lab.received("stability_index"), strict=True)
    return [(balance.data, stability.data) for balance, stability in received]


@virtual_time
async def lines_about(joints, **parameters):
    """What the processor logs of one reading of the joints."""
    async with harness(SensorProcessor(**parameters)) as lab:
        lab.publish("joint_states", joints)
        await lab.settle()
    return processor_log(lab)


@given(acceleration=vectors, rotation=vectors)
def test_balance_follows_its_formula(acceleration, rotation):
    expected = (abs(acceleration.y) + sqrt(rotation.x**2 + rotation.y**2 + rotation.z**2)) / 2
    ((balance, stability),) = metrics(imu_of(acceleration, rotation))
    assert balance == pytest.approx(min(1.0, expected), abs=1e-9)
    assert stability == 1.0 - balance


def test_balance_at_rest_and_in_a_fall():
    at_rest, leaning, falling = metrics(
        imu_of(Vector3(z=9.8)),
        imu_of(Vector3(x=5.0, y=-0.5, z=9.8), Vector3(x=0.2, y=0.4, z=0.4)),
        imu_of(Vector3(y=9.8)),
    )
    assert at_rest == (0.0, 1.0)
    assert leaning == pytest.approx(((0.5 + 0.6) / 2, 1 - (0.5 + 0.6) / 2))
    assert falling == (1.0, 0.0)


@given(pitch=st.floats(-pi / 2, pi / 2), heading=st.floats(-pi, pi))
def test_pitch_is_signed_whatever_the_heading(pitch, heading):
    @virtual_time
    async def published():
        half, turn = pitch / 2, heading / 2
        orientation = Quaternion(
            w=cos(turn) * cos(half), x=-sin(turn) * sin(half), y=cos(turn) * sin(half), z=sin(turn) * cos(half)
        )
        async with harness(SensorProcessor(publish_pitch=True)) as lab:
            lab.publish("imu/data", Imu(orientation=orientation))
            await lab.settle()
            (answer,) = lab.received("pitch")
            return answer.data

    assert published() == pytest.approx(pitch, abs=1e-6)


@virtual_time
async def test_pitch_is_published_on_request_alone():
    async with harness(SensorProcessor()) as lab:
        assert [topic.name for topic in lab.graph.report().topics] == [
            "/balance_state",
            "/imu/data",
            "/joint_states",
            "/stability_index",
        ]


def test_each_joint_beyond_the_limit_is_a_warning():
    joints = JointState(name=["knee", "hip", "elbow", "ankle"], position=[3.0, 3.1, -3.2, -2.9])
    assert lines_about(joints) == [
        ("warning", "joint beyond its limit", {"joint": "hip", "angle": 3.1, "limit": 3.0}),
        ("warning", "joint beyond its limit", {"joint": "elbow", "angle": -3.2, "limit": 3.0}),
    ]


def test_max_joint_angle_is_the_limit():
    joints = JointState(name=["knee", "hip"], position=[0.4, 0.6])
    assert lines_about(joints, max_joint_angle=0.5) == [
        ("warning", "joint beyond its limit", {"joint": "hip", "angle": 0.6, "limit": 0.5}),
    ]


@pytest.mark.parametrize(
    ("velocity", "mean"),
    [([1.0, -1.0], None), ([], None), ([1.5, -0.6], 1.05), ([0.0, 0.0, -4.0], 1.333)],
)
def test_mean_speed_above_one_is_logged(velocity, mean):
    expected = [] if mean is None else [("info", "the joints move fast", {"mean_speed": mean})]
    assert lines_about(JointState(velocity=velocity)) == expected


@pytest.mark.parametrize(
    ("imu", "joints", "status"),
    [(True, True, ALL), (True, False, ONLY_IMU), (False, True, ONLY_JOINTS), (False, False, NOTHING)],
)
@virtual_time
async def test_status_names_the_sensors_that_send(imu, joints, status):
    async with harness(SensorProcessor()) as lab:
        if imu:
            lab.publish("imu/data", imu_of())
        if joints:
            lab.publish("joint_states", JointState())
        await lab.settle()
        assert lab.node(SensorProcessor).status == status


@pytest.mark.parametrize("timeout_s", [1.0, 2.5])
@virtual_time
async def test_sensor_is_operational_within_its_timeout(timeout_s):
    parameters = {} if timeout_s == 1.0 else {"timeout_s": timeout_s}
    async with harness(SensorProcessor(**parameters)) as lab:
        processor = lab.node(SensorProcessor)
        await lab.advance(0.5)
        lab.publish("imu/data", imu_of())
        await lab.advance(0.25)
        lab.publish("joint_states", JointState())
        await lab.advance(timeout_s - 0.375)
        assert processor.status == ALL
        await lab.advance(0.125)
        assert processor.status == ONLY_JOINTS, "the IMU is as old as the timeout"
        await lab.advance(0.25)
        assert processor.status == NOTHING


@virtual_time
async def test_a_change_of_status_is_logged_once():
    async with harness(SensorProcessor()) as lab:
        await lab.advance(3)
        for _ in range(30):
            lab.publish("imu/data", imu_of())
            lab.publish("joint_states", JointState())
            await lab.advance(0.1)
        await lab.advance(3)
    assert processor_log(lab) == [("info", NOTHING, {}), ("info", ALL, {}), ("info", NOTHING, {})]


@virtual_time
async def test_a_best_effort_imu_is_good_enough():
    """Sensors are often published without the promise to arrive; the processor asks for no more."""
    async with harness(SensorProcessor()) as lab:
        lab.advertise(Imu, "imu/data", qos=SENSOR_DATA).publish(imu_of())
        await lab.settle()
        assert lab.node(SensorProcessor).status == ONLY_IMU
