"""Parameters of the lab's sensors, changed while they run: the processor's output shows the change."""

import pytest

from busflow.errors import InvalidParameter
from busflow.msgs.std_msgs import Float64
from busflow.testing import harness, virtual_time
from plugins.sensor_processor import SensorProcessor
from plugins.sensor_publisher import SensorPublisher

PERIOD_S = 0.1


def quiet_lab(**options):
    return harness(SensorPublisher(noise={"imu": 0.0}), SensorProcessor, **options)


@virtual_time
async def test_changed_noise_shows_within_one_period():
    async with quiet_lab(seed=1) as lab:
        await lab.advance(1)
        assert {each.data for each in lab.received("balance_state", Float64)} == {0.0}
        assert lab.set_parameters(SensorPublisher, {"noise.imu": 0.5}) == ("noise.imu",)
        await lab.advance(PERIOD_S)
        *before, first = lab.received("balance_state", Float64)
        assert len(before) == 10
        assert 0.0 < first.data <= 1.0
        lab.set_parameters(SensorPublisher, noise={"imu": 0.0})
        await lab.advance(PERIOD_S)
        assert lab.received("balance_state", Float64)[-1].data == 0.0
        assert lab.ledger.dropped == 0


@virtual_time
@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"noise.imu": 10.5}, r"noise\.imu must be at most 10, got 10\.5 \(allowed: at least 0, at most 10\)"),
        ({"noise.imu": -0.1}, r"noise\.imu must be at least 0, got -0\.1"),
        ({"noise.imu": 0.5, "noise.joints": 2}, r"noise\.joints must be at most 1, got 2"),
        ({"noise.imo": 0.5}, r"unknown parameter noise\.imo \(did you mean 'imu'\?\)"),
        ({"camera_hz": 5}, r"camera_hz is read-only: it stays 0\.0 while the node runs"),
    ],
)
async def test_invalid_parameters_are_refused_with_a_reason(changes, reason):
    async with quiet_lab() as lab:
        with pytest.raises(InvalidParameter, match=reason):
            lab.set_parameters(SensorPublisher, changes)
        await lab.advance(PERIOD_S)
        assert lab.node(SensorPublisher).parameters.noise.imu == 0.0
        assert lab.received("balance_state", Float64)[-1].data == 0.0


@virtual_time
async def test_the_rate_follows_at_once():
    async with quiet_lab() as lab:
        await lab.advance(0.25)
        lab.set_parameters(SensorPublisher, rate_hz=100)
        await lab.advance(0.1)
        assert len(lab.received("imu/data")) == 2 + 10
        lab.set_parameters(SensorPublisher, rate_hz=0)
        await lab.advance(10)
        assert len(lab.received("imu/data")) == 12
        assert lab.node(SensorProcessor).status == "No sensor data received"


@virtual_time
async def test_changed_limit_counts_from_the_next_message():
    async with quiet_lab() as lab:
        await lab.advance(0.3)
        assert not [line for line in lab.log if "limit" in line.values]
        lab.set_parameters(SensorProcessor, max_joint_angle=0.01)
        await lab.advance(PERIOD_S)
        assert {line.values["limit"] for line in lab.log if "limit" in line.values} == {0.01}


@virtual_time
async def test_the_report_counts_how_often_parameters_were_changed():
    async with quiet_lab() as lab:
        for imu in (0.5, 0.5, 0.6):
            lab.set_parameters(SensorPublisher, {"noise.imu": imu})
        counts = {node["name"]: node["parameters_set"] for node in lab.graph.report().as_json()["nodes"]}
    assert counts == {"/sensor_publisher": 2, "/sensor_processor": 0}
