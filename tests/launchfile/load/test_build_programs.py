"""Programs of a launch file: what it states of them, and mistakes with their places."""

import json
import re

import pytest
import yaml

from busflow.launchfile.load.build_programs import texts, variables
from busflow.launchfile.model.description import GRACE_S
from busflow.launchfile.model.supervision import Condition, OnExit, Restart
from busflow.launchfile.yaml.value import Origin, StatedBy, Value
from tests.vectors import each_case


def test_stated_keys_are_described(folder):
    description = folder.load("""
        programs:
          driver:
            command: [camera, --rate, 30, --crop, true, --gain, 0.5]
            cwd: tools
            env: {LEVEL: 1, ROBOT: h1}
            ready: is ready
            grace: 5s
            restart: on-failure
            on_exit: shutdown
            depends_on: {left/viewer: ready}
    """)
    (program,) = description.programs
    assert (program.name, program.machine) == ("/driver", None)
    assert program.command == ("camera", "--rate", "30", "--crop", "true", "--gain", "0.5")
    assert program.cwd == folder.path / "tools"
    assert program.env == {"LEVEL": "1", "ROBOT": "h1"}
    assert (program.ready, program.grace_s) == ("is ready", 5.0)
    assert program.supervision.restart.when is Restart.ON_FAILURE
    assert program.supervision.on_exit is OnExit.SHUTDOWN
    assert program.supervision.depends_on == {"/left/viewer": Condition.READY}


@each_case("i_launch", "command_line/")
def test_values_of_expressions_are_not_split(folder, case):
    """In the cases `$(test X)` gives X. Here an argument X gives it, and then a text with a blank."""
    names = re.findall(r"\$\(test (\w+)\)", case["input"])
    words = re.sub(r"\$\(test (\w+)\)", r"${args.\1}", case["input"]).split()
    for more in ("", " b"):
        arguments = {name: {"type": "str", "default": name + more} for name in names}
        stated = {"args": arguments, "programs": {"driver": {"command": words}}}
        (program,) = folder.load(json.dumps(stated)).programs
        expected = [re.sub(r"\$\{args.(\w+)\}", rf"\g<1>{more}", word) for word in words]
        assert [*program.command] == expected == (expected if more else case["expect"])


@each_case("i_launch", "yaml/executable")
def test_executable_of_ros_is_a_program(folder, case):
    (stated,) = [each["executable"] for each in yaml.safe_load(case["yaml"])["launch"]]
    keys = {"command": stated["cmd"].split(), "cwd": stated["cwd"], "grace": f"{stated['sigterm_timeout']}s"}
    keys["env"] = {each["name"]: each["value"] for each in stated["env"]}
    (program,) = folder.load(json.dumps({"programs": {stated["name"]: keys}})).programs
    assert program.name == f"/{case['expect']['name']}"
    assert [*program.command] == case["expect"]["cmd"]
    assert (str(program.cwd), program.env) == (case["expect"]["cwd"], case["expect"]["env"])
    assert program.grace_s == float(case["expect"]["sigterm_timeout"])


def test_unstated_keys_have_defaults(folder):
    (program,) = folder.load("programs: {driver: {command: [camera]}}").programs
    assert (program.cwd, program.grace_s, program.ready) == (folder.path, GRACE_S, None)
    assert program.supervision.restart.when is Restart.NEVER


def test_included_program_runs_in_its_own_folder(folder):
    folder.write("programs: {driver: {command: [camera]}, other: {command: [a], cwd: b}}", "cams/cam.yaml")
    programs = folder.load("""
        include: [{file: cams/cam.yaml, namespace: left}]
        programs: {left/driver: {restart: always}}
    """).programs
    found = {each.name: (each.cwd, each.supervision.restart.when) for each in programs}
    assert found == {
        "/left/driver": (folder.path / "cams", Restart.ALWAYS),
        "/left/other": (folder.path / "cams/b", Restart.NEVER),
    }


def test_names_follow_namespaces_of_groups(folder):
    description = folder.load("""
        groups:
          sides:
            for_each: {side: [left, right]}
            namespace: ${each.side}
            programs:
              driver: {command: [camera, "${each.side}"]}
              viewer: {command: [viewer], depends_on: {driver: started}, when: "${each.side == 'left'}"}
    """)
    found = {each.name: (each.command, each.supervision.depends_on) for each in description.programs}
    assert found == {
        "/left/driver": (("camera", "left"), {}),
        "/left/viewer": (("viewer",), {"/left/driver": Condition.STARTED}),
        "/right/driver": (("camera", "right"), {}),
    }


def test_programs_are_repeated_by_for_each(folder):
    programs = folder.load("programs: {'cam_${each.n}': {for_each: {n: [1, 2]}, command: [cam, '${each.n}']}}").programs
    assert {each.name: each.command for each in programs} == {"/cam_1": ("cam", "1"), "/cam_2": ("cam", "2")}


def test_value_can_be_set_on_command_line(folder):
    (program,) = folder.load("programs: {driver: {command: [a]}}", sets=["programs.driver.command=[b, c]"]).programs
    assert program.command == ("b", "c")


@pytest.mark.parametrize(
    ("text", "place", "message", "fix"),
    [
        (
            "programs: {driver: {restart: always}}",
            "1:12",
            "the program driver has no command",
            "add its words: command:",
        ),
        ("programs: {driver: {command: []}}", "1:30", "command must have at least 1", ""),
        ("programs: {driver: {command: ros2 run}}", "1:30", "command must be a list", "write command: [ros2, run]"),
        ("programs: {driver: {command: [a], comand: b}}", "1:35", "unknown key programs.driver.comand", "did you mean"),
        ("programs: {driver: {command: [a], grace: 0}}", "1:42", "grace", ""),
        ("programs: {driver: {command: [a], restart: maybe}}", "1:44", "restart must be one of", ""),
        ("programs: {driver: {command: [a], machine: arm}}", "1:44", "there is no machine arm", "or add it: machines:"),
        ("programs: {a b: {command: [a]}}", "1:12", "program name 'a b'", ""),
        ("programs: {main: {command: [a]}}", "1:12", "main is the name of a process too", "rename one of them"),
        ("processes: {eyes: {}}\nprograms: {eyes: {command: [a]}}", "2:12", "eyes is the name of a process too", ""),
        (
            "nodes: {arm: {plugin: p}}\nprograms: {arm: {command: [a]}}",
            "2:12",
            "arm is the name of a node too",
            "rename",
        ),
    ],
)
def test_mistake_is_reported_with_place_and_fix(folder, text, place, message, fix):
    report = folder.report(text)
    assert f"lab1.yaml:{place}: error: " in report
    assert message in report
    assert fix in report
    assert report.count("error:") == 1


def test_variables_are_texts_as_yaml_spells_them():
    env = Value.of({"A": "x", "B": 1, "C": 0.5, "D": True}, Origin(StatedBy.CALLER))
    assert variables(env) == {"A": "x", "B": "1", "C": "0.5", "D": "true"}


def test_words_keep_their_order():
    assert texts(["a", 2, "b", 1e6]) == ("a", "2", "b", "1000000.0")
