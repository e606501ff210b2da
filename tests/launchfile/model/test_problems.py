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


def test_too_many_problems_end_the_search():
    problems = Problems()
    problems.add(*(Problem("x", str(n)) for n in range(MOST)))
    with problems.collecting():
        problems.add(Problem("x", "one more"))
        pytest.fail("adding it raises")
    found = problems.sorted([])
    assert len(found) == MOST + 1
    assert found[-1].message == f"there are more than {MOST} problems"


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


def test_fault_is_reported_at_its_value_or_key(folder):
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
    assert found == (
        "lab1.yaml:6:16: error: /talker: rate_hz must be greater than 0, got -1\n"
        "        rate_hz: -1\n"
        "                 ^^\n"
        "  fix: allowed: greater than 0, at most 1000\n"
        "lab1.yaml:7:20: error: /talker: noise.imu must be a number, got text 'loud'\n"
        "        noise: {imu: loud, imuu: 1}\n"
        "                     ^^^^\n"
        "lab1.yaml:7:26: error: /talker: unknown parameter noise.imuu\n"
        "        noise: {imu: loud, imuu: 1}\n"
        "                           ^^^^\n"
        "  fix: did you mean 'imu'?\n"
        "lab1.yaml:5:5: error: /talker: parameter name is required\n"
        "      parameters:\n"
        "      ^^^^^^^^^^\n"
        "  fix: add `name:` with a value (str)"
    )


def test_parameters_of_ros2_have_another_place(folder):
    text = "nodes:\n  talker: {plugin: talker, parameters: {name: x, use_sim_time: true, ros__parameters: {name: y}}}\n"
    found = report(folder, text)
    assert "unknown parameter use_sim_time\n" in found
    assert "fix: leave it out: all nodes have the run's clock; clock: {mode: follow} follows /clock" in found
    assert "fix: write what is below it directly below parameters:" in found


def test_missing_parameter_is_reported_at_the_node(folder):
    found = report(folder, "nodes:\n  talker:\n    plugin: talker\n")
    assert found.startswith("lab1.yaml:2:3: error: /talker: parameter name is required\n    talker:\n    ^^^^^^\n")


def test_value_from_an_argument_names_its_origin(folder):
    text = """
        args:
          rate: {type: float, default: 1}
        nodes:
          talker:
            plugin: talker
            parameters: {name: x, rate_hz: "${args.rate}"}
        """
    assert report(folder, text, assignments=["rate:=5000"]) == (
        "lab1.yaml:7:36: error: /talker: rate_hz must be at most 1000, got 5000.0, from command line\n"
        '      parameters: {name: x, rate_hz: "${args.rate}"}\n'
        "                                     ^^^^^^^^^^^^^^\n"
        "  fix: allowed: greater than 0, at most 1000"
    )


def test_command_line_value_is_reported_there(folder):
    text = "nodes:\n  talker: {plugin: talker, parameters: {name: x}}\n"
    assert report(folder, text, sets=["nodes.talker.parameters.rate_hz=fast"]) == (
        "command line:1:33: error: /talker: rate_hz must be a number, got text 'fast'\n"
        "  nodes.talker.parameters.rate_hz=fast\n"
        "                                  ^^^^"
    )


def test_fault_names_the_including_file(folder):
    folder.write("nodes:\n  talker: {plugin: talker, parameters: {name: 5}}\n", "inner.yaml")
    assert report(folder, "include: [inner.yaml]\n").splitlines()[-1] == "  included from lab1.yaml:1:11"
