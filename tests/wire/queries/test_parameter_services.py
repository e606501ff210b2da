"""ROS 2's services for parameters: what each answers of a node's own, and over the wire."""

import pytest
from pydantic import BaseModel, Field

from busflow import Node, Parameters
from busflow.msgs.rcl_interfaces import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    Parameter,
    ParameterValue,
    SetParameters,
    SetParametersAtomically,
)
from busflow.node.node import runtime_of
from busflow.testing import harness, virtual_time
from busflow.wire.queries.parameter_services import ParameterServices


class Noise(BaseModel, frozen=True, extra="forbid"):
    imu: float = Field(default=0.1, ge=0, le=10, description="How much.")
    joints: float = 0.0


class SensorParameters(Parameters):
    rate_hz: float = 10.0
    frames: list[str] = Field(default=["imu"])
    noise: Noise = Noise()


class Sensor(Node):
    parameters: SensorParameters


class Silent(Node):
    """Has no parameters."""


def number(name, value):
    return Parameter(name=name, value=ParameterValue(type=3, double_value=value))


def answers(lab):
    return ParameterServices(runtime_of(lab.node(Sensor)).parameters)


@virtual_time
async def test_parameters_are_listed_by_prefix_and_depth():
    async with harness(Sensor) as lab:
        ask = answers(lab).list
        everything = ask(ListParameters.Request()).result
        assert everything.names == ("rate_hz", "frames", "noise.imu", "noise.joints")
        assert everything.prefixes == ("noise",)
        assert ask(ListParameters.Request(depth=1)).result.names == ("rate_hz", "frames")
        assert ask(ListParameters.Request(prefixes=["noise"])).result.names == ("noise.imu", "noise.joints")
        assert ask(ListParameters.Request(prefixes=["rate_hz", "no"])).result.names == ("rate_hz",)


@virtual_time
async def test_values_and_types_follow_ros_2():
    async with harness(Sensor) as lab:
        names = ["noise.imu", "frames"]
        values = answers(lab).get(GetParameters.Request(names=names)).values
        assert [each.type for each in values] == [3, 9]
        assert values[0].double_value == 0.1
        assert values[1].string_array_value == ("imu",)
        assert answers(lab).types(GetParameterTypes.Request(names=names)).types.tolist() == [3, 9]


@virtual_time
async def test_a_description_has_the_range():
    async with harness(Sensor) as lab:
        (known,) = answers(lab).describe(DescribeParameters.Request(names=["noise.imu"])).descriptors
        assert (known.name, known.type, known.description) == ("noise.imu", 3, "How much.")
        assert (known.floating_point_range[0].from_value, known.floating_point_range[0].to_value) == (0.0, 10.0)


@virtual_time
async def test_one_unknown_name_empties_the_answer():
    """`parameter_service.py` of ros2/rclpy 8.0, also in humble to jazzy: what `ros2 param get` takes for `not set`."""
    async with harness(Sensor) as lab:
        names = ["noise.imu", "nothing"]
        assert answers(lab).get(GetParameters.Request(names=names)).values == ()
        assert answers(lab).types(GetParameterTypes.Request(names=names)).types.tolist() == []
        assert answers(lab).describe(DescribeParameters.Request(names=names)).descriptors == ()


@virtual_time
async def test_each_parameter_is_set_or_refused_by_itself():
    async with harness(Sensor) as lab:
        request = SetParameters.Request(parameters=[number("noise.imu", 99.0), number("rate_hz", 20.0)])
        refused, done = answers(lab).set(request).results
        assert not refused.successful
        assert "noise.imu must be" in refused.reason
        assert done.successful
        assert (lab.node(Sensor).parameters.noise.imu, lab.node(Sensor).parameters.rate_hz) == (0.1, 20.0)


@virtual_time
async def test_at_one_stroke_sets_all_or_none():
    async with harness(Sensor) as lab:
        request = SetParametersAtomically.Request(parameters=[number("rate_hz", 20.0), number("noise.imu", 99.0)])
        assert not answers(lab).set_atomically(request).result.successful
        assert lab.node(Sensor).parameters.rate_hz == 10.0
        request = SetParametersAtomically.Request(parameters=[number("rate_hz", 20.0), number("noise.imu", 2.0)])
        assert answers(lab).set_atomically(request).result.successful
        assert (lab.node(Sensor).parameters.noise.imu, lab.node(Sensor).parameters.rate_hz) == (2.0, 20.0)


@virtual_time
async def test_only_nodes_with_parameters_have_the_services():
    async with harness(Sensor, Silent) as lab:
        names = [name for name, _, _ in answers(lab).all()]
        assert len(names) == 6
        assert all(name.startswith("/sensor/") for name in names)
        silent = runtime_of(lab.node(Silent)).parameters
        assert list(ParameterServices(silent).all()) == []
        assert len(list(ParameterServices(silent, is_for_ros2=True).all())) == 6, "as each node of ROS 2 has"


@pytest.mark.parametrize("value", [ParameterValue(), ParameterValue(type=200)])
@virtual_time
async def test_a_value_that_is_none_is_refused(value):
    async with harness(Sensor) as lab:
        parameters = [Parameter(name="rate_hz", value=value)]
        (result,) = answers(lab).set(SetParameters.Request(parameters=parameters)).results
        assert not result.successful
        assert "rate_hz" in result.reason
