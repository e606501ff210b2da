"""`busflow param`: its output beside that of `ros2 param` in the same lab."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from busflow.cli import main

Captured = pytest.CaptureFixture[str]
Said = Callable[[str], str]

pytestmark = pytest.mark.usefixtures("lab")


@pytest.mark.parametrize(
    ("command", "capture"),
    [
        ("list", "46_param_list"),
        ("list /imu_publisher", "47_param_list_node"),
        ("list imu_publisher --param-type", "48_param_list_types"),
        ("get imu_publisher rate_hz", "49_param_get"),
        ("get --hide-type imu_publisher rate_hz", "50_param_get_hide"),
        ("dump imu_publisher", "216_param_dump_to_file"),
    ],
)
def test_the_output_is_that_of_ros2(capsys: Captured, ros2_said: Said, command: str, capture: str):
    assert main(["param", *command.split()]) == 0
    assert capsys.readouterr() == (ros2_said(capture), "")


def test_describe_prints_ros2_lines_and_source(capsys: Captured, ros2_said: Said):
    assert main(["param", "describe", "imu_publisher", "rate_hz", "frame_id", "joint_count"]) == 0
    ours = capsys.readouterr().out.splitlines()
    more = ("  Default: ", "  Value: ", "  Source: ")
    assert [line for line in ours if not line.startswith(more)] == ros2_said("56_param_describe").splitlines()
    assert ours[6:9] == ["  Default: 10.0", "  Value: 10.0", "  Source: imu_lab.yaml:6:27"]
    assert "  Source: default" in ours


def test_sources_shows_each_origin(capsys: Captured):
    assert main(["param", "sources"]) == 0
    publisher, *rows, processor = capsys.readouterr().out.splitlines()
    assert (publisher, processor) == ("/imu_publisher:", "/processor:")
    assert [row.split() for row in rows] == [
        ["rate_hz", "10.0", "imu_lab.yaml:6:27"],
        ["frame_id", "imu_link", "default"],
        ["joint_count", "10", "default"],
    ]


def test_a_dump_goes_to_a_file(tmp_path: Path, capsys: Captured):
    file = tmp_path / "publisher.yaml"
    assert main(["param", "dump", "imu_publisher", "--output", str(file)]) == 0
    assert capsys.readouterr() == ("", "")
    assert yaml.safe_load(file.read_text())["/imu_publisher"]["ros__parameters"]["frame_id"] == "imu_link"


def test_json_says_all_of_a_parameter(capsys: Captured):
    assert main(["param", "get", "imu_publisher", "rate_hz", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert {"version": 1, "run": "imu_lab", "node": "/imu_publisher", "value": 10.0, "ros_type": "double"}.items() <= (
        answer.items()
    )
    assert answer["bounds"]["maximum"] == 1000
    assert main(["param", "list", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [(node["name"], len(node["parameters"])) for node in answer["nodes"]] == [
        ("/imu_publisher", 3),
        ("/processor", 0),
    ]


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        ("get imu_publisher rate", "/imu_publisher has no parameter 'rate'; did you mean 'rate_hz'?"),
        ("list imu_publishr", "there is no node /imu_publishr; did you mean '/imu_publisher'?"),
        ("list --run imu", "there is no run 'imu'; did you mean 'imu_lab'?"),
    ],
)
def test_unknown_name_gets_the_nearest(capsys: Captured, command: str, expected: str):
    assert main(["param", *command.split()]) == 4
    assert capsys.readouterr() == ("", f"error: {expected}\n")


def test_names_are_completed_from_the_run(monkeypatch: pytest.MonkeyPatch, capsys: Captured):
    for words, expected in (
        ("busflow param get ", ["plain,imu_publisher", "plain,processor"]),
        ("busflow param get /imu", ["plain,/imu_publisher"]),
        ("busflow param get imu_publisher ra", ["plain,rate_hz"]),
        ("busflow param set imu_publisher ra", ["plain,rate_hz"]),
        ("busflow param list --run ", ["plain,imu_lab"]),
    ):
        monkeypatch.setenv("_BUSFLOW_COMPLETE", "bash_complete")
        monkeypatch.setenv("COMP_WORDS", words)
        monkeypatch.setenv("COMP_CWORD", str(len(words.split(" ")) - 1))
        main([])
        assert capsys.readouterr().out.splitlines() == expected
