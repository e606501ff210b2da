"""`busflow node`: its output beside that of `ros2 node` in the same lab."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from busflow.cli import main

ROS2 = Path(__file__).parents[1] / "cases/ros2cli"
Captured = pytest.CaptureFixture[str]
Said = Callable[[str], str]

in_the_lab = pytest.mark.usefixtures("lab")


@in_the_lab
def test_the_list_is_that_of_ros2(capsys: Captured, ros2_said: Said):
    assert main(["node", "list"]) == 0
    assert capsys.readouterr() == (ros2_said("02_node_list"), "")
    assert main(["node", "list", "-c"]) == 0
    assert capsys.readouterr().out == "2\n"


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


@in_the_lab
def test_info_lists_parameter_services_as_ros2(capsys: Captured):
    assert main(["node", "info", "imu_publisher"]) == 0
    ours = [line for line in capsys.readouterr().out.splitlines() if "/srv/" in line]
    there = (ROS2 / "44_node_info_imu_publisher.txt").read_text().splitlines()
    assert ours == [line for line in there if "rcl_interfaces/srv/" in line]


@in_the_lab
def test_info_shows_state_plugin_process_and_parameters(capsys: Captured):
    assert main(["node", "info", "imu_publisher"]) == 0
    state, plugin, process, parameters = capsys.readouterr().out.splitlines()[-4:]
    assert (state, plugin, parameters) == ("  State: running", "  Plugin: imu_publisher", "  Parameters: 3")
    assert process.startswith("  Process: main, pid ")


@in_the_lab
def test_verbose_list_has_a_row_per_node(capsys: Captured):
    assert main(["node", "list", "-v"]) == 0
    head, *rows = (line.split() for line in capsys.readouterr().out.splitlines())
    assert head == ["NODE", "STATE", "PLUGIN", "PROCESS", "PID", "PUB", "SUB", "RESTARTS"]
    assert [row[:4] + row[5:] for row in rows] == [
        ["/imu_publisher", "running", "imu_publisher", "main", "3", "0", "0"],
        ["/processor", "running", "processor", "main", "2", "2", "0"],
    ]


@in_the_lab
def test_json_says_the_same(capsys: Captured):
    assert main(["node", "list", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["version"], answer["run"]) == (1, "imu_lab")
    assert [(node["name"], node["state"]) for node in answer["nodes"]] == [
        ("/imu_publisher", "running"),
        ("/processor", "running"),
    ]
    assert main(["node", "info", "processor", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["publishers"][0] == {"name": "/balance_state", "type": "std_msgs/msg/Float64"}
    assert [each["name"] for each in answer["subscriptions"]] == ["/imu/data", "/joint_states"]
    assert (answer["clients"], answer["parameters"]) == ([], 0)


@in_the_lab
def test_unknown_node_gets_the_nearest_name(capsys: Captured):
    assert main(["node", "info", "procesor"]) == 4
    assert capsys.readouterr() == ("", "error: there is no node /procesor; did you mean '/processor'?\n")


@pytest.mark.usefixtures("place")
def test_missing_run_is_explained(capsys: Captured):
    assert main(["node", "list"]) == 4
    assert capsys.readouterr().err == "error: nothing is running; start a graph in another terminal: busflow run FILE\n"


@pytest.mark.e2e
def test_restarting_node_is_reported(project: Path, start_run: Callable[..., Any], capsys: Captured):
    policy = "    restart: {policy: on-failure, backoff: [30s, 30s]}\n"
    (project / "talk.yaml").write_text(
        (project / "talk.yaml").read_text().replace("  listener:\n", f"{policy}  listener:\n")
    )
    start_run(project, "talk.yaml", "--set", "nodes.talker.parameters.fail_at=3").wait_for("lost count")
    assert main(["node", "list"]) == 0
    captured = capsys.readouterr()
    assert captured.out == "/listener\n/talker\n"
    assert r"warning: /talker is started anew: failed in Talker.talk (timer): ValueError: \x1b[31mlost" in captured.err


@pytest.mark.e2e
def test_nodes_are_stopped_and_started_by_hand(
    project: Path, start_run: Callable[..., Any], capsys: Captured, monkeypatch: pytest.MonkeyPatch
):
    text = (project / "talk.yaml").read_text()
    (project / "talk.yaml").write_text(text.replace("  listener:\n", "  listener:\n    depends_on: {talker: ready}\n"))
    run = start_run(project, "talk.yaml", "--report", "run.json")
    run.wait_for("heard")
    monkeypatch.chdir(project)
    for command, said, noted in (
        ("stop talker", "/talker: stopped by hand", "warning: /listener depends on /talker, and goes on"),
        ("stop talker", "/talker: is stopped by hand already", "warning: /listener depends on /talker, and goes on"),
        ("start talker", "/talker: running", ""),
        ("start /talker", "/talker: is running already", ""),
        ("restart listener talker", "/listener: running\n/talker: running", ""),
        ("stop listener", "/listener: stopped by hand", ""),
    ):
        assert main(["node", *command.split()]) == 0
        assert [text.strip() for text in capsys.readouterr()] == [said, noted]
    assert main(["node", "stop", "talkr"]) == 4
    assert "there is no node /talkr; did you mean '/talker'?" in capsys.readouterr().err
    assert main(["node", "info", "listener"]) == 0
    out, err = capsys.readouterr()
    assert "  State: stopped by hand\n" in out
    assert "  Stopped by hand: 2\n  Started by hand: 1\n" in out
    assert err == "warning: /listener is stopped by hand; busflow node start /listener starts it\n"
    assert main(["doctor"]) == 3
    assert "warning: /listener is stopped by hand\n  fix: busflow node start listener\n" in capsys.readouterr().out
    assert main(["node", "stop", "talker", "listener", "--json"]) == 0
    nodes = json.loads(capsys.readouterr().out)["nodes"]
    assert [(node["state"], node["stopped_by_hand"]) for node in nodes] == [("stopped by hand", n) for n in (3, 2)]
    run.stop()
    talker, listener = json.loads((project / "run.json").read_text())["nodes"]
    assert (talker["state"], talker["stopped_by_hand"], talker["started_by_hand"]) == ("stopped by hand", 3, 2)
    assert (listener["restarts"], listener["failures"]) == (0, 0)


@pytest.mark.e2e
def test_start_that_fails_is_an_error(project: Path, start_run: Callable[..., Any], capsys: Captured):
    text = (project / "talk.yaml").read_text()
    (project / "talk.yaml").write_text(text.replace("plugin: talker\n", "plugin: talker\n    restart: on-failure\n"))
    plugin = project / "plugins/talker.py"
    fails = "    async def stop(self) -> None:\n        raise ValueError('the cable is loose')\n"
    plugin.write_text(f"{plugin.read_text()}\n{fails}")
    start_run(project, "talk.yaml").wait_for("heard")
    assert main(["node", "stop", "talker"]) == 1
    out, err = capsys.readouterr()
    assert out == "/talker: stopped by hand\n"
    assert err.startswith("error: /talker has failed: failed in Talker.stop: ValueError: the cable is loose")
    assert main(["node", "start", "talker"]) == 0
