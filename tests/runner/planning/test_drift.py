"""`Drift`: parameters of a running node that differ from its launch file, and saving them."""

import math

import pytest

from busflow.errors import InvalidParameter, LaunchError
from busflow.launchfile.load.load import load
from busflow.node.node import runtime_of
from busflow.runner.planning.drift import drifts, written_back
from busflow.testing import harness, virtual_time

PLUGIN = """
from busflow import Node, Parameters


class Noise(Parameters):
    imu: float = 0.1
    joints: float = 0.0


class Settings(Parameters):
    rate_hz: float = 10.0
    name: str = "left"
    noise: Noise = Noise()
    limits: tuple[float, ...] = (0.0, 1.0)


class Sensor(Node):
    parameters: Settings
"""
FILE = """\
# The sensors.
plugins: [.]
args:
  rate:
    type: float
    default: 5.0

nodes:
  left:
    plugin: sensor
    parameters:
      rate_hz: ${args.rate}  # from outside
      noise:
        imu: 0.2  # measured
  right:  # the other one
    plugin: sensor
    namespace: arm
    parameters_from: right.yaml
"""


@pytest.fixture
def file(tmp_path):
    (tmp_path / "sensor.py").write_text(PLUGIN)
    (tmp_path / "right.yaml").write_text("rate_hz: 7\n")
    path = tmp_path / "lab.yaml"
    path.write_text(FILE)
    return path


def nodes(file):
    return {spec.full_name: spec for spec in load(file).nodes}


def test_values_as_stated_are_no_drift(file):
    left = nodes(file)["/left"]
    same = {"rate_hz": 5.0, "name": "left", "noise.imu": 0.2, "noise.joints": 0.0, "limits": [0.0, 1.0]}
    assert drifts(left, same) == ()
    assert drifts(left, {}) == ()


def test_drift_names_stated_value_and_place(file):
    left = nodes(file)["/left"]
    rate, joints, limits = drifts(left, {"rate_hz": 20.0, "noise.joints": math.nan, "limits": [0.0, 2.0]})
    assert (rate.name, rate.stated, rate.value) == ("rate_hz", 5.0, 20.0)
    assert (rate.origin.place.line, rate.origin.through.place.line) == (12, 6)
    assert (joints.stated, str(joints.origin)) == (0.0, "default")
    assert (limits.stated, limits.value) == ([0.0, 1.0], [0.0, 2.0])


def test_a_name_that_is_no_parameter_is_refused(file, golden):
    with golden.raises(InvalidParameter):
        drifts(nodes(file)["/left"], {"noise.imo": 1.0})


def test_written_back_values_load_again(file):
    specs = nodes(file)
    left = {"rate_hz": 20.0, "noise.imu": 0.5, "noise.joints": 0.1, "limits": [1.0, 2.0], "name": "${x} # y"}
    right = {"rate_hz": 8.0, "noise.imu": 0.3}
    text = written_back(FILE, file, [*drifts(specs["/left"], left), *drifts(specs["/arm/right"], right)])
    file.write_text(text)
    specs = nodes(file)
    assert drifts(specs["/left"], left) == drifts(specs["/arm/right"], right) == ()
    assert text == FILE.replace("rate_hz: ${args.rate}", "rate_hz: 20.0").replace(
        "imu: 0.2  # measured\n",
        'imu: 0.5  # measured\n        joints: 0.1\n      name: "$${x} # y"\n      limits: [1.0, 2.0]\n',
    ) + ("    parameters:\n      rate_hz: 8.0\n      noise:\n        imu: 0.3\n")


def test_node_of_another_file_is_refused(file, golden):
    (file.parent / "outer.yaml").write_text("include: lab.yaml\n")
    (drift,) = drifts(nodes(file.parent / "outer.yaml")["/left"], {"rate_hz": 20.0})
    with golden.raises(LaunchError) as caught:
        written_back("include: lab.yaml\n", file.parent / "outer.yaml", [drift])
    assert [each.code for each in caught.value.problems] == ["not-editable"]


def test_same_place_in_another_file_is_refused(file, golden):
    (drift,) = drifts(nodes(file)["/left"], {"rate_hz": 20.0})
    other = FILE.replace("left:", "lift:")
    with golden.raises(LaunchError):
        written_back(other, file.parent / "other.yaml", [drift])


def test_nodes_on_one_line_are_distinguished(file):
    text = "plugins: [.]\nnodes: {left: {plugin: sensor}, right: {plugin: sensor}}\n"
    file.write_text(text)
    (drift,) = drifts(nodes(file)["/right"], {"rate_hz": 20.0})
    expected = text.replace("right: {plugin: sensor}", "right: {plugin: sensor, parameters: {rate_hz: 20.0}}")
    assert written_back(text, file, [drift]) == expected


@pytest.mark.parametrize("namespace", ["", "namespace: robot\n"])
def test_for_each_node_gets_its_own_entry(file, namespace):
    text = namespace + (
        "plugins: [.]\nnodes:\n  sensor:\n    for_each: {side: [left, right]}\n"
        "    namespace: ${each.side}\n    plugin: sensor\n    parameters: {rate_hz: 5}\n"
    )
    file.write_text(text)
    name = "/robot/left/sensor" if namespace else "/left/sensor"
    for rate_hz in (20.0, 30.0):
        found = drifts(nodes(file)[name], {"rate_hz": rate_hz})
        file.write_text(written_back(file.read_text(), file, found))
        assert drifts(nodes(file)[name], {"rate_hz": rate_hz}) == ()
    assert drifts(nodes(file)[name.replace("left", "right")], {"rate_hz": 5.0}) == ()
    assert file.read_text() == text + "  left/sensor:\n    parameters:\n      rate_hz: 30.0\n"


def test_computed_namespace_refuses_writing_back(file, golden):
    text = (
        "plugins: [.]\nargs: {name: {type: str, default: robot}}\nnamespace: ${args.name}\nnodes:\n"
        "  sensor_${each.side}:\n    for_each: {side: [left, right]}\n    plugin: sensor\n"
    )
    file.write_text(text)
    found = drifts(nodes(file)["/robot/sensor_left"], {"rate_hz": 20.0})
    with golden.raises(LaunchError):
        written_back(text, file, found)


@virtual_time
async def test_values_set_during_a_run_are_saved(file):
    async with harness(file) as lab:
        lab.set_parameters("left", {"noise.imu": 0.7})
        rows = runtime_of(lab.node("left")).parameters.describe()
        found = drifts(nodes(file)["/left"], {row.name: row.value for row in rows})
    assert [(each.name, each.stated, each.value) for each in found] == [("noise.imu", 0.2, 0.7)]
    assert written_back(FILE, file, found) == FILE.replace("imu: 0.2", "imu: 0.7")
