"""`busflow interface`: beside what `ros2 interface` printed, and of types that only a run knows."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from busflow.cli import main

Captured = pytest.CaptureFixture[str]
OWN = '''
from collections.abc import Sequence

from busflow import ActionType, Message, Node, action_client, publisher


class Grip(Message, package="talk_msgs"):
    """How firmly."""

    force: float = 0.0
    names: Sequence[str] = ()


class Label(Message, package="talk_msgs"):
    """What ROS has no words for."""

    text: str
    place: str | None = "shelf"


class Squeeze(ActionType, package="talk_msgs"):
    """Closes."""

    class Goal(Message):
        """How firmly."""

        grip: Grip = Grip()

    class Result(Message):
        """Whether it holds."""

        held: bool = False

    class Feedback(Message):
        """Nothing."""


class Gripper(Node):
    """Has types of its own."""

    squeeze = action_client(Squeeze, "squeeze")

    grips = publisher(Grip, "grips")
    labels = publisher(Label, "labels")

    async def start(self) -> None:
        self.log.info("ready")
'''


@pytest.mark.usefixtures("place")
class TestShippedTypes:
    def test_show_prints_the_fields_as_ros2(self, capsys: Captured, ros2_said: Callable[[str], str]):
        assert main(["interface", "show", "sensor_msgs/msg/Imu", "--no-comments"]) == 0
        there = [re.sub(r" #.*|( [\d.]+)$", "", line) for line in ros2_said("62_interface_show").splitlines()]
        ours = [re.sub(r" [\d.]+$", "", line) for line in capsys.readouterr().out.splitlines()]
        assert ours == [line for line in there if line and not line.startswith("#")]

    def test_comments_are_shown_to_the_chosen_depth(self, capsys: Captured):
        assert main(["interface", "show", "sensor_msgs/Imu"]) == 0
        out = capsys.readouterr().out
        assert out.startswith("# What an inertial measurement unit measures.\n#\n# A covariance of zeros")
        assert "\ngeometry_msgs/Quaternion orientation # Of the sensor's frame relative to the world.\n" in out
        assert "\n\t#" not in out
        assert main(["interface", "show", "sensor_msgs/Imu", "--all-comments"]) == 0
        assert "\n\t# " in capsys.readouterr().out

    def test_constants_and_services_are_shown(self, capsys: Captured):
        assert main(["interface", "show", "rcl_interfaces/msg/Log", "--no-comments"]) == 0
        assert capsys.readouterr().out.startswith("uint8 DEBUG=10\nuint8 INFO=20\n")
        assert main(["interface", "show", "std_srvs/srv/SetBool", "--no-comments"]) == 0
        assert capsys.readouterr().out == "bool data\n---\nbool success\nstring message\n"

    def test_proto_prints_the_values_as_ros2(self, capsys: Captured, ros2_file: Callable[[str], str]):
        assert main(["interface", "proto", "sensor_msgs/msg/JointState"]) == 0
        assert capsys.readouterr().out == ros2_file("63_interface_proto")
        assert main(["interface", "proto", "std_srvs/SetBool", "--no-quotes"]) == 0
        assert capsys.readouterr().out == "data: false\n"

    def test_proto_has_the_defaults_as_json(self, capsys: Captured):
        assert main(["interface", "proto", "geometry_msgs/Quaternion", "--json"]) == 0
        answer = json.loads(capsys.readouterr().out)
        assert answer["name"] == "geometry_msgs/msg/Quaternion"
        assert answer["values"] == {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}

    def test_services_and_packages_are_listed(self, capsys: Captured):
        assert main(["interface", "list", "-s"]) == 0
        assert capsys.readouterr().out.startswith("Services:\n    action_msgs/srv/CancelGoal\n    control_msgs/")
        assert main(["interface", "package", "std_srvs"]) == 0
        assert capsys.readouterr().out.split() == ["std_srvs/srv/Empty", "std_srvs/srv/SetBool", "std_srvs/srv/Trigger"]
        assert main(["interface", "packages", "--json"]) == 0
        assert "geometry_msgs" in json.loads(capsys.readouterr().out)["packages"]

    def test_json_is_the_description(self, capsys: Captured):
        assert main(["interface", "show", "std_msgs/Float64", "--json"]) == 0
        answer = json.loads(capsys.readouterr().out)
        assert (answer["version"], answer["name"]) == (1, "std_msgs/msg/Float64")
        assert answer["description"]["type_description"]["fields"][0]["name"] == "data"

    def test_package_of_idl_files_is_refused_in_words(self, capsys: Captured, tmp_path: Path):
        (tmp_path / "odd_msgs/msg").mkdir(parents=True)
        (tmp_path / "odd_msgs/msg/Odd.idl").write_text("module odd_msgs {};")
        for command in (["show", "odd_msgs/Odd"], ["package", "odd_msgs"]):
            assert main(["interface", *command, "--interfaces", str(tmp_path)]) == 4
        first, second = capsys.readouterr().err.splitlines()
        assert first.startswith("error: odd_msgs/Odd is defined in an .idl file alone")
        assert second.endswith("no .msg, .srv or .action file, but odd_msgs/msg/Odd; busflow reads no .idl files")

    @pytest.mark.parametrize(
        ("command", "expected"),
        [
            ("show sensor_msgs/msg/Imuu", "there is no type sensor_msgs/msg/Imuu; did you mean 'sensor_msgs/msg/Imu'?"),
            ("proto std_msg/String", "there is no type std_msg/String; did you mean 'std_msgs/msg/String'?"),
            ("package sensor_msg", "no package sensor_msg has types; did you mean 'sensor_msgs'?"),
        ],
    )
    def test_unknown_name_gets_the_nearest(self, capsys: Captured, command: str, expected: str):
        assert main(["interface", *command.split()]) == 4
        assert capsys.readouterr() == ("", f"error: {expected}\n")


@pytest.mark.e2e
def test_user_types_come_from_the_run(project: Path, start_run: Callable[..., Any], capsys: Captured):
    (project / "plugins/gripper.py").write_text(OWN)
    (project / "talk.yaml").write_text((project / "talk.yaml").read_text() + "  gripper:\n    plugin: gripper\n")
    start_run(project, "talk.yaml").wait_for("ready")
    assert main(["interface", "show", "talk_msgs/Grip"]) == 0
    assert capsys.readouterr().out == "float64 force\nstring[] names\n"
    for name, expected in (("Grip", "force: 0.0\nnames: []\n"), ("Label", "text: null\nplace: shelf\n")):
        assert main(["interface", "proto", f"talk_msgs/{name}", "--no-quotes"]) == 0
        assert capsys.readouterr().out == expected
    assert main(["interface", "show", "talk_msgs/Squeeze"]) == 0
    assert capsys.readouterr().out.startswith(
        "talk_msgs/Grip grip\n\tfloat64 force\n\tstring[] names\n---\nbool held\n---\n"
    )
    assert main(["interface", "package", "talk_msgs"]) == 0
    assert "talk_msgs/action/Squeeze\n" in (out := capsys.readouterr().out)
    assert "Squeeze_" not in out
    assert main(["interface", "list", "-m"]) == 0
    assert "    talk_msgs/msg/Grip\n" in capsys.readouterr().out
