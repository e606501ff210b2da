"""Problems: collected, limited in number, in the order of the files."""

from __future__ import annotations

import pytest
from pydantic import Field

from busflow.errors import InvalidParameter, LaunchError, Place, Problem
from busflow.launchfile.model.problems import MOST, Problems, parameter_problems
from busflow.node.parameters import Parameters, validate


def test_problems_are_sorted_by_file_and_line():
    problems = Problems()
    assert not problems
    for file, line in (("b", 1), ("a", 9), ("a", 2)):
        problems.add(Problem("x", f"{file}{line}", None, Place(file, line, 1)))
    problems.add(Problem("x", "nowhere"))
    assert [each.message for each in problems.sorted(["a", "b"])] == ["nowhere", "a2", "a9", "b1"]
    assert problems


def test_too_many_problems_end_the_search(golden):
    problems = Problems()
    problems.add(*(Problem("x", str(n)) for n in range(MOST)))
    with problems.collecting():
        problems.add(Problem("x", "one more"))
        pytest.fail("adding it raises")
    found = problems.sorted([])
    assert len(found) == MOST + 1
    golden(found[-1].message)


def test_collecting_keeps_raised_problems():
    problems = Problems()
    with problems.collecting():
        raise LaunchError([Problem("x", "inside")])
    assert [each.message for each in problems.sorted([])] == ["inside"]


class Noise(Parameters):
    imu: float = Field(default=0.1, ge=0)


class TalkerParameters(Parameters):
    rate_hz: float = Field(default=10.0, gt=0, le=1000)
    noise: Noise = Noise()
    name: str


def report(folder, text: str, **how: object) -> str:
    (spec,) = folder.load(text, **how).nodes
    with pytest.raises(InvalidParameter) as caught:
        validate(TalkerParameters, spec.parameters.data)
    return "\n".join(problem.render() for problem in parameter_problems(caught.value, spec))


def test_fault_is_reported_at_its_value_or_key(folder, golden):
    found = report(
        folder,
        """
        nodes:
          talker:
            plugin: talker
            parameters:
              rate_hz: -1
              noise: {imu: loud, imuu: 1}
        """,
    )
    golden(found)


def test_parameters_of_ros2_have_another_place(folder, golden):
    text = "nodes:\n  talker: {plugin: talker, parameters: {name: x, use_sim_time: true, ros__parameters: {name: y}}}\n"
    found = report(folder, text)
    assert "unknown parameter use_sim_time\n" in found
    golden(found)


def test_missing_parameter_is_reported_at_the_node(folder, golden):
    found = report(folder, "nodes:\n  talker:\n    plugin: talker\n")
    golden(found)


def test_value_from_an_argument_names_its_origin(folder, golden):
    text = """
        args:
          rate: {type: float, default: 1}
        nodes:
          talker:
            plugin: talker
            parameters: {name: x, rate_hz: "${args.rate}"}
        """
    golden(report(folder, text, assignments=["rate:=5000"]))


def test_command_line_value_is_reported_there(folder, golden):
    text = "nodes:\n  talker: {plugin: talker, parameters: {name: x}}\n"
    golden(report(folder, text, sets=["nodes.talker.parameters.rate_hz=fast"]))


def test_fault_names_the_including_file(folder):
    folder.write("nodes:\n  talker: {plugin: talker, parameters: {name: 5}}\n", "inner.yaml")
    assert report(folder, "include: [inner.yaml]\n").splitlines()[-1] == "  included from lab1.yaml:1:11"
