"""`busflow interface`: beside what `ros2 interface` printed, and of types that only a run knows."""

import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from busflow.cli import main
from tests.cli.conftest import LABS, Shell, append

Captured = pytest.CaptureFixture[str]


@pytest.mark.usefixtures("place")
class TestShippedTypes:
    def test_show_prints_the_fields_as_ros2(self, capsys: Captured, ros2_said: Callable[[str], str]):
        assert main(["interface", "show", "sensor_msgs/msg/Imu", "--no-comments"]) == 0
        there = [re.sub(r" #.*|( [\d.]+)$", "", line) for line in ros2_said("62_interface_show").splitlines()]
        ours = [re.sub(r" [\d.]+$", "", line) for line in capsys.readouterr().out.splitlines()]
        assert ours == [line for line in there if line and not line.startswith("#")]

    @pytest.mark.parametrize(
        ("line", "code"),
        [
            ("show sensor_msgs/Imu", 0),
            ("show geometry_msgs/Pose --all-comments", 0),
            ("show rcl_interfaces/msg/Log --no-comments", 0),
            ("show std_srvs/srv/SetBool --no-comments", 0),
            ("show sensor_msgs/msg/Imuu", 4),
            ("proto std_srvs/SetBool --no-quotes", 0),
            ("proto std_msg/String", 4),
            ("list -s", 0),
            ("package std_srvs", 0),
            ("package sensor_msg", 4),
        ],
    )
    def test_output(self, shell: Shell, line: str, code: int):
        assert shell(f"interface {line}") == code

    def test_proto_prints_the_values_as_ros2(self, capsys: Captured, ros2_file: Callable[[str], str]):
        assert main(["interface", "proto", "sensor_msgs/msg/JointState"]) == 0
        assert capsys.readouterr().out == ros2_file("63_interface_proto")

    def test_json_has_defaults_packages_and_descriptions(self, shell: Shell):
        answer = shell.data("interface proto geometry_msgs/Quaternion")
        assert answer["name"] == "geometry_msgs/msg/Quaternion"
        assert answer["values"] == {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
        assert "geometry_msgs" in shell.data("interface packages")["packages"]
        answer = shell.data("interface show std_msgs/Float64")
        assert (answer["version"], answer["name"]) == (1, "std_msgs/msg/Float64")
        assert answer["description"]["type_description"]["fields"][0]["name"] == "data"

    def test_package_of_idl_files_is_refused_in_words(self, shell: Shell, tmp_path: Path):
        (tmp_path / "odd_msgs/msg").mkdir(parents=True)
        (tmp_path / "odd_msgs/msg/Odd.idl").write_text("module odd_msgs {};")
        for command in ("show odd_msgs/Odd", "package odd_msgs"):
            assert shell(f"interface {command} --interfaces {tmp_path}") == 4


@pytest.mark.e2e
def test_user_types_come_from_the_run(project: Path, start_run: Callable[..., Any], shell: Shell):
    shutil.copy(LABS / "plugins/squeezer.py", "plugins")
    append("  squeezer:\n    plugin: squeezer\n")
    start_run(project, "talk.yaml").wait_for("ready")
    for line in (
        "show talk_msgs/Grip",
        "proto talk_msgs/Grip --no-quotes",
        "proto talk_msgs/Label --no-quotes",
        "show talk_msgs/Squeeze",
        "package talk_msgs",
    ):
        assert shell(f"interface {line}") == 0
    assert "    talk_msgs/msg/Grip\n" in shell.text("interface list -m")
