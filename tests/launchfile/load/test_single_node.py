"""A graph of one node that the command line states without a launch file."""

from typing import Any

import pytest

from busflow import Parameters
from busflow.errors import InvalidParameter
from busflow.launchfile.load.single_node import examine_single_node
from busflow.node.parameters import validate
from tests.vectors import each_case


def node(*, name="camera", **stated):
    description, problems = examine_single_node("camera", name, **stated)
    assert problems == ()
    (found,) = description.nodes
    return description, found


def test_node_has_its_parameters_and_remaps():
    description, found = node(
        parameters=["rate_hz:=5", "noise.imu:=0.5", "frames:=[a, b]", "url:=http://x//y"],
        remaps=["image:=/left/image"],
        sets=["nodes.camera.restart=always", "seed=7"],
    )
    assert found.parameters.data == {"rate_hz": 5, "noise": {"imu": 0.5}, "frames": ["a", "b"], "url": "http://x//y"}
    assert [(rule.match, rule.replacement) for rule in found.remap] == [("image", "/left/image")]
    assert found.supervision.restart.when == "always"
    assert (description.name, description.seed, description.files, description.file) == ("camera", 7, (), "")


class Stated(Parameters):
    """The parameters of the cases."""

    foo: str | dict[str, str] = ""
    fizz123: str = ""


@each_case("b_names", "param_rule/")
def test_parameter_rule_is_read_or_refused(case: dict[str, Any]):
    description, problems = examine_single_node("camera", "camera", parameters=[case["input"]])
    if case["valid"]:
        assert validate(Stated, description.nodes[0].parameters.data)
    elif not problems:
        with pytest.raises(InvalidParameter):
            validate(Stated, description.nodes[0].parameters.data)


@pytest.mark.parametrize("name", ["left/camera", "/left/camera"])
def test_name_may_have_a_namespace(name):
    description, found = node(name=name, parameters=["rate_hz:=5"], sets=["nodes.camera.parameters.size=3"])
    assert (found.full_name, description.name) == ("/left/camera", "camera")
    assert found.parameters.data == {"rate_hz": 5, "size": 3}


@pytest.mark.parametrize(
    ("stated", "column", "message"),
    [
        ({"parameters": ["rate_hz=5"]}, 1, "this is not an argument"),
        ({"parameters": ["rate_hz:=[1"]}, 10, ""),
        ({"remaps": ["image"]}, 1, "this is not an argument"),
        ({"sets": ["nodes.camera.rate_hz=5"]}, 1, "unknown key nodes.camera.rate_hz"),
    ],
)
def test_mistake_has_its_place_on_the_command_line(stated, column, message):
    _, (problem, *_) = examine_single_node("camera", "camera", **stated)
    assert problem.message.startswith(message)
    assert (str(problem.place), problem.fix is not None) == (f"command line:1:{column}", True)
