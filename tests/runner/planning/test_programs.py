"""What keeps a program from starting is found before the start, with its place and what to do."""

import os
from contextlib import closing
from dataclasses import replace

import pytest

from busflow.clock import SimClock, SystemClock
from busflow.errors import Severity
from busflow.launchfile.load.load import load
from busflow.launchfile.model.placement import placed
from busflow.log import Log
from busflow.processes.crossing import crossing_problems
from busflow.runner.loops.virtual import VirtualLoop
from busflow.runner.planning.preflight import Preflight


@pytest.fixture
def tools(folder, monkeypatch):
    """A folder with a program that may be executed, one that may not, and a folder; the first is on PATH."""
    for name, mode in (("camera_node", 0o755), ("notes", 0o644)):
        folder.write("#!/bin/sh\n", f"tools/{name}").chmod(mode)
    (folder.path / "tools/inner").mkdir()
    monkeypatch.setenv("PATH", str(folder.path / "tools"))
    return folder


def problems(check, text):
    return [(str(each.place).rpartition("yaml:")[2], each.message, each.fix or "") for each in check(text).errors]


@pytest.mark.parametrize(
    "command", ["[camera_node]", "[tools/camera_node]", "[./camera_node], cwd: tools", "[x], env: {PATH: bin}"]
)
def test_command_that_is_there_is_no_problem(tools, check, command):
    tools.write("#!/bin/sh\n", "bin/x").chmod(0o755)
    assert check(f"programs: {{driver: {{command: {command}}}}}").problems == []


@pytest.mark.parametrize(
    ("keys", "column", "message", "fix"),
    [
        ("command: [camera_nod]", 30, "there is no command 'camera_nod' on PATH", "did you mean 'camera_node'?"),
        ("command: [zzz]", 30, "there is no command 'zzz' on PATH", "install it, or write its path"),
        ('command: ["ros2 run x"]', 30, "there is no command 'ros2 run x' on PATH", "command: [ros2, run, x]"),
        ("command: [local]", 30, "there is no command 'local' on PATH", "write ./local for the file in "),
        ("command: [tools/camera_nod]", 30, "/tools/camera_nod does not exist", "/tools/camera_node'?"),
        ("command: [other/zzz]", 30, "/other/zzz does not exist", "correct the path; it begins at cwd"),
        ("command: [tools/notes]", 30, "/tools/notes is not executable", "chmod +x "),
        ("command: [tools/inner]", 30, "/tools/inner is a folder", "name the program in it"),
        ("command: [camera_node], cwd: nowhere", 50, "/nowhere does not exist", "create it, or correct cwd"),
        ("command: [camera_node], cwd: tools/notes", 50, "/tools/notes is not a folder", "correct cwd"),
    ],
)
def test_impossible_command_is_an_error(tools, check, keys, column, message, fix):
    tools.write("#!/bin/sh\n", "local")
    ((place, text, advice),) = problems(check, f"programs: {{driver: {{{keys}}}}}")
    assert place == f"1:{column}"
    assert text.startswith("/driver: ")
    assert message in text
    assert fix in advice


@pytest.mark.parametrize(
    ("needs", "message", "fix"),
    [
        ("{drivr: started}", "/talker depends on /drivr, which is not a node or program", "did you mean '/driver'?"),
        ("{driver: ready}", "waits until /driver is ready, and nothing says when", "ready: TEXT"),
        ("{driver: first_message}", "waits for the first message of /driver, a program", "ready or started"),
    ],
)
def test_impossible_dependency_on_program_is_an_error(check, needs, message, fix):
    text = f"plugins: [plugins]\nnodes: {{talker: {{plugin: talker, depends_on: {needs}}}}}\n"
    ((place, text, advice),) = problems(check, text + "programs: {driver: {command: [sh]}}")
    assert place == "2:47"
    assert message in text
    assert fix in advice


def test_circle_over_node_and_program_is_an_error(check, golden):
    text = "plugins: [plugins]\nnodes: {talker: {plugin: talker, depends_on: {driver: started}}}\n"
    text += "programs: {driver: {command: [sh], depends_on: {talker: ready}}}"
    ((_, text, _),) = problems(check, text)
    golden(text)


@pytest.mark.usefixtures("check")
def test_wrong_program_hides_no_other_mistake(folder):
    text = "plugins: [plugins]\nnodes: {talker: {plugin: talker, depends_on: {driver: started}}}\n"
    report = folder.report(text + "programs: {driver: {comand: [sh]}, a b: {command: [sh]}}")
    assert report.count("error:") == 2


def test_simulated_time_starts_no_program(folder):
    folder.write("programs: {driver: {command: [no-such]}, other: {command: [sh]}}")
    with closing(VirtualLoop()) as loop:
        clock = SimClock(loop=loop)
        plan = Preflight(clock, Log(clock)).plan([load("lab1.yaml")])
    (problem,) = (each for each in plan.problems if each.code == "programs-left-out")
    assert (problem.severity, problem.message.partition(": ")[2]) == (Severity.WARNING, "/driver, /other")
    assert str(problem.place).endswith("lab1.yaml:1:12")
    assert plan.errors == []


def test_system_without_process_groups_is_an_error(check, monkeypatch, golden):
    monkeypatch.delattr(os, "killpg")
    (problem,) = check("programs: {driver: {command: [sh]}, other: {command: [sh]}}").errors
    assert (problem.code, str(problem.place).endswith("yaml:1:12")) == ("no-posix", True)
    golden(problem.message)
    assert "WSL" in (problem.fix or "")


def test_program_of_other_machine_is_a_warning(folder, golden):
    folder.write(
        "machines: {arm: {connect: 'tls/192.0.2.7:7447'}}\nnetwork: {ca: ca.pem}\n"
        "programs: {driver: {command: [no-such], machine: arm}}"
    )
    description = load("lab1.yaml")
    placement = placed(description)
    assert [(process, *specs) for process, specs in placement.programs.items()] == [("arm:main", *description.programs)]
    clock = SystemClock()
    plan = Preflight(clock, Log(clock)).plan([replace(description, here="main")])
    (found,) = [each for each in plan.problems if each.code == "unknown-command"]
    assert found.severity is Severity.WARNING
    golden(found.message)


@pytest.mark.parametrize(
    ("node", "program", "place"),
    [
        ("{plugin: talker, process: left, depends_on: {driver: started}}", "{command: [sh]}", "3:9"),
        ("{plugin: talker, process: left}", "{command: [sh], depends_on: {talker: ready}}", "4:49"),
    ],
)
def test_dependency_across_processes_is_an_error(check, node, program, place):
    text = f"plugins: [plugins]\nprocesses: {{left: }}\nnodes: {{talker: {node}}}\nprograms: {{driver: {program}}}"
    plan = check(text)
    (found,) = crossing_problems(plan, placed(load("lab1.yaml")))
    assert found.code == "cannot-depend"
    assert str(found.place).endswith(f"yaml:{place}")
