"""`busflow param`: its output beside that of `ros2 param` in the same lab."""

from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from busflow.cli import main
from tests.cli.conftest import Shell

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


def test_a_dump_goes_to_a_file(tmp_path: Path, capsys: Captured):
    file = tmp_path / "publisher.yaml"
    assert main(["param", "dump", "imu_publisher", "--output", str(file)]) == 0
    assert capsys.readouterr() == ("", "")
    assert yaml.safe_load(file.read_text())["/imu_publisher"]["ros__parameters"]["frame_id"] == "imu_link"


def test_json_says_all_of_a_parameter(shell: Shell):
    answer = shell.data("param get imu_publisher rate_hz")
    assert {"version": 1, "run": "imu_lab", "node": "/imu_publisher", "value": 10.0, "ros_type": "double"}.items() <= (
        answer.items()
    )
    assert answer["bounds"]["maximum"] == 1000
    assert [(node["name"], len(node["parameters"])) for node in shell.data("param list")["nodes"]] == [
        ("/imu_publisher", 3),
        ("/processor", 0),
    ]


@pytest.mark.parametrize(
    ("line", "code"),
    [("sources", 0), ("get imu_publisher rate", 4), ("list imu_publishr", 4), ("list --run imu", 4)],
)
def test_output(shell: Shell, line: str, code: int):
    assert shell(f"param {line}") == code


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("param get ", ["imu_publisher", "processor"]),
        ("param get /imu", ["/imu_publisher"]),
        ("param get imu_publisher ra", ["rate_hz"]),
        ("param set imu_publisher ra", ["rate_hz"]),
        ("param list --run ", ["imu_lab"]),
        ("topic echo im", ["imu/data"]),
        ("topic hz imu/data /j", ["/joint_states"]),
        ("topic find sensor", ["sensor_msgs/msg/Imu", "sensor_msgs/msg/JointState"]),
    ],
)
def test_names_are_completed_from_the_run(words: str, expected: list[str], completed: Callable[[str], list[str]]):
    assert completed(words) == expected
