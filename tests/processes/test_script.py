"""`busflow.run()` of a launch file with several processes is `busflow run`; what it cannot do it refuses."""

import asyncio
import json
import os
import re
import signal

import pytest

import busflow
from busflow import LaunchError
from busflow.cli import main
from busflow.launchfile.load.load import load
from tests.processes.conftest import NODES

FILE = """
args:
  rate_hz: {type: float, default: 0.0}
env: {ROBOT: left-handed}
processes:
  far: {restart: on-failure}
nodes:
  source: {plugin: source, process: far, parameters: {rate_hz: "${args.rate_hz}"}}
  where: {plugin: "places:Place", process: far}
  where_here: {plugin: "places:Place"}
"""
ROBOT = str(NODES / "robot.py")


def pids_of(run):
    run.wait_for("place", "left-handed", times=2)
    return dict(re.findall(r"/(where\w*): place pid=(\d+)", "".join(run.lines)))


@pytest.mark.parametrize("options", [{}, pytest.param({"one_process": True}, marks=pytest.mark.long)])
def test_script_starts_the_processes_of_its_file(start, options, have_ended):
    run = start(FILE, json.dumps({"args": {"rate_hz": 200.0}} | options), script=ROBOT)
    run.wait_for("beside received 20")
    here, far = (int(pids_of(run)[name]) for name in ("where_here", "where"))
    assert here == run.process.pid
    assert (far == here) is bool(options)
    assert run.end() == 130
    assert have_ended([far], 0)


@pytest.mark.long
def test_final_process_failure_in_script_is_printed(start):
    run = start(FILE.replace("on-failure", "never"), "{}", script=ROBOT)
    os.kill(int(pids_of(run)["where"]), signal.SIGKILL)
    assert run.end(None) == 1
    assert any(line.startswith("error: ") and " far " in line and "SIGKILL" in line for line in run.lines)


@pytest.fixture
def robot(tmp_path):
    file = tmp_path / "robot.yaml"
    file.write_text(f"plugins: [{NODES}]\nprocesses: {{far: }}\nnodes: {{sink: {{plugin: sink, process: far}}}}\n")
    return file


@pytest.mark.parametrize(
    ("what", "options", "told"),
    [
        (lambda file: [file, file], {}, "there are others beside it"),
        (lambda file: [load(file)], {}, "it was read before"),
        (lambda file: [file], {"inspect": False}, "inspect=False is not possible"),
    ],
    ids=["two files", "a description", "not inspected"],
)
def test_node_instance_for_another_process_is_refused(robot, what, options, told):
    with pytest.raises(LaunchError, match=told) as refused:
        busflow.run(*what(robot), **options)
    assert "one_process=True" in str(refused.value)


def test_launch_runs_all_nodes_in_the_program(robot, capsys):
    async def main():
        async with busflow.launch(robot) as graph:
            return [node.state for node in graph.report().nodes]

    assert asyncio.run(main()) == ["running"]
    (line,) = [line for line in capsys.readouterr().err.splitlines() if "all nodes run in this process" in line]
    assert "processes=far" in line


FOLLOWS = """
clock: {mode: follow}
nodes:
  ticker: {plugin: "places:Ticker"}
"""


def test_a_script_follows_the_clock_of_another_program(start, monkeypatch, capsys):
    run = start(FOLLOWS, "{}", script=ROBOT)
    run.wait_for("ready")
    monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", str(run.runtime))
    told = ["topic", "pub", "--once", "clock", "rosgraph_msgs/msg/Clock"]  # which waits for whoever receives it
    for second in (1000, 1001):
        assert main([*told, f"{{clock: {{sec: {second}}}}}"]) == 0
    run.wait_for("tick second=1001")
    assert main(["ps"]) == 0
    assert "1970-01-01" not in capsys.readouterr().out
