"""`busflow node`: its output beside that of `ros2 node` in the same lab."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from busflow.cli import main
from tests.cli.conftest import ROS2, Shell, append, edit

Captured = pytest.CaptureFixture[str]
Said = Callable[[str], str]

in_the_lab = pytest.mark.usefixtures("lab")


@in_the_lab
def test_the_list_is_that_of_ros2(capsys: Captured, ros2_said: Said):
    assert main(["node", "list"]) == 0
    assert capsys.readouterr() == (ros2_said("02_node_list"), "")


@in_the_lab
@pytest.mark.parametrize(
    ("name", "capture"), [("/imu_publisher", "44_node_info_imu_publisher"), ("processor", "45_node_info_processor")]
)
def test_info_begins_as_that_of_ros2(capsys: Captured, ros2_said: Said, name: str, capture: str):
    assert main(["node", "info", name]) == 0
    lines = capsys.readouterr().out.splitlines(keepends=True)
    ours = "".join(line for line in lines if "rcl_interfaces/" not in line)
    # Both print an empty line after a kind without endpoints; the lines removed above left none behind.
    assert ours.replace("\n\n", "\n").startswith(ros2_said(capture).replace("\n\n", "\n"))
    there = (ROS2 / f"{capture}.txt").read_text("utf-8").splitlines(keepends=True)
    served = [each for each in there if "rcl_interfaces/srv/" in each]
    # Our node without parameters has no services for them.
    assert [each for each in lines if "rcl_interfaces/srv/" in each] == (served if "publisher" in name else [])


@in_the_lab
@pytest.mark.parametrize(
    ("line", "code"), [("list -c", 0), ("list -v", 0), ("info imu_publisher", 0), ("info procesor", 4)]
)
def test_output(shell: Shell, line: str, code: int):
    assert shell(f"node {line}", mask={r"pid \d+": "pid #", r"(main +)\d+": r"\1#", "PID +": "PID  "}) == code


@in_the_lab
def test_json_says_the_same(shell: Shell):
    answer = shell.data("node list")
    assert (answer["version"], answer["run"]) == (1, "imu_lab")
    assert [(node["name"], node["state"]) for node in answer["nodes"]] == [
        ("/imu_publisher", "running"),
        ("/processor", "running"),
    ]
    answer = shell.data("node info processor")
    assert answer["publishers"][0] == {"name": "/balance_state", "type": "std_msgs/msg/Float64"}
    assert [each["name"] for each in answer["subscriptions"]] == ["/imu/data", "/joint_states"]
    assert (answer["clients"], answer["parameters"]) == ([], 0)


@pytest.mark.usefixtures("place")
def test_missing_run_is_explained(shell: Shell):
    assert shell("node list") == 4


@pytest.mark.e2e
def test_restarting_node_is_reported(project: Path, start_run: Callable[..., Any], shell: Shell):
    edit("  listener:\n", "    restart: {policy: on-failure, backoff: [30s, 30s]}\n  listener:\n")
    start_run(project, "talk.yaml", "--set", "nodes.talker.parameters.fail_at=3").wait_for("lost count")
    assert shell("node list") == 0


@pytest.mark.e2e
def test_nodes_are_stopped_and_started_by_hand(project: Path, start_run: Callable[..., Any], shell: Shell):
    edit("  listener:\n", "  listener:\n    depends_on: {talker: ready}\n")
    run = start_run(project, "talk.yaml", "--report", "run.json")
    run.wait_for("heard")
    for command in (
        "stop talker",
        "stop talker",
        "start talker",
        "start /talker",
        "restart listener talker",
        "stop listener",
    ):
        assert shell(f"node {command}") == 0
    assert shell("node stop talkr") == 4
    assert shell("node info listener", mask={r"(?s)(listener\n).*( +State:)": r"\1  …\n\2", r"pid \d+": "pid #"}) == 0
    (by_hand,) = [each for each in shell.data("doctor", code=3)["findings"] if each["code"] == "node-stopped"]
    shell.note(f"{by_hand['message']}\n  fix: {by_hand['fix']}")
    nodes = shell.data("node stop talker listener")["nodes"]
    assert [(node["state"], node["stopped_by_hand"]) for node in nodes] == [("stopped by hand", n) for n in (3, 2)]
    run.stop()
    talker, listener = json.loads((project / "run.json").read_text())["nodes"]
    assert (talker["state"], talker["stopped_by_hand"], talker["started_by_hand"]) == ("stopped by hand", 3, 2)
    assert (listener["restarts"], listener["failures"]) == (0, 0)


@pytest.mark.e2e
def test_start_that_fails_is_an_error(project: Path, start_run: Callable[..., Any], shell: Shell):
    edit("plugin: talker\n", "plugin: talker\n    restart: on-failure\n")
    append("\n    async def stop(self) -> None:\n        raise ValueError('the cable is loose')\n", "plugins/talker.py")
    start_run(project, "talk.yaml").wait_for("heard")
    assert shell("node stop talker") == 1
    assert shell("node start talker") == 0
