"""A node's parameters while it runs: what each is, where its value came from, and how it is set."""

import pytest
from pydantic import Field

from busflow import Node, Parameters
from busflow.errors import InvalidParameter
from busflow.node import runtime_of
from busflow.parameters import ReadOnly
from busflow.testing import harness, virtual_time


class Noise(Parameters):
    imu: float = Field(default=0.1, ge=0, le=10, description="Half width.")
    joints: float = 0.0


class SensorParameters(Parameters):
    rate_hz: float = Field(default=10.0, ge=0, le=1000, description="How often.")
    noise: Noise = Noise()
    frame: ReadOnly[str] = "imu_link"
    spare: Noise | None = None


class Sensor(Node):
    parameters: SensorParameters


def store_of(node):
    return runtime_of(node).parameters


def test_every_parameter_is_described_with_its_value():
    rows = store_of(Sensor(noise={"imu": 0.5})).describe()
    assert [(row.name, row.value) for row in rows] == [
        ("rate_hz", 10.0),
        ("noise.imu", 0.5),
        ("noise.joints", 0.0),
        ("frame", "imu_link"),
        ("spare.imu", None),
        ("spare.joints", None),
    ]
    imu = rows[1].info
    assert (imu.type, imu.default, str(imu.bounds), imu.description) == (
        "float",
        0.1,
        "at least 0, at most 10",
        "Half width.",
    )
    assert rows[3].info.read_only


def test_a_value_comes_from_code_or_is_the_default():
    rows = store_of(Sensor(SensorParameters(noise=Noise(imu=0.5)))).describe()
    assert [str(row.source) for row in rows] == ["default", "code", *["default"] * 4]


def test_an_unknown_parameter_is_refused_with_the_nearest_name():
    with pytest.raises(InvalidParameter, match=r"unknown parameter noise\.imo \(did you mean 'noise\.imu'\?\)"):
        store_of(Sensor()).get("noise.imo")


@virtual_time
async def test_a_value_from_a_launch_file_says_where_it_is_stated(tmp_path):
    (tmp_path / "sensor.py").write_text(
        "from busflow import Node, Parameters\n"
        "class Noise(Parameters):\n    imu: float = 0.1\n    joints: float = 0.0\n"
        "class SensorParameters(Parameters):\n    rate_hz: float = 1.0\n    gain: float = 1.0\n    noise: Noise = Noise()\n"
        "class Sensor(Node):\n    parameters: SensorParameters\n"
    )
    file = tmp_path / "lab.yaml"
    file.write_text(
        "args:\n  rate:\n    type: float\n    default: 5.0\nplugins: [.]\nnodes:\n  sensor:\n    plugin: sensor\n"
        "    parameters:\n      rate_hz: ${args.rate}\n      noise:\n        imu: 0.5\n"
    )
    async with harness(file) as lab:
        rows = {row.name: row for row in store_of(lab.node("sensor")).describe()}
    assert rows["noise.imu"].source.place.line == 12
    assert str(rows["noise.imu"].source).endswith("lab.yaml:12:14")
    assert str(rows["rate_hz"].source).endswith("lab.yaml:4:14")
    assert [str(rows[name].source) for name in ("gain", "noise.joints")] == ["default", "default"]
