"""Definition files on the command line: looked at, made into classes, made of classes, compared with them.

Tests of `source.py` and `classes.py`, of `--interfaces`, and of what `busflow check` says.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from busflow import Message
from busflow.cli import main
from busflow.launchfile.model.interface_folders import name_folders
from tests.definitions.test_library import write

FILES = {
    "src/grip_msgs/msg/Grip.msg": "# How firmly.\n\nfloat64 force 0.5  # in newtons\ngeometry_msgs/Point at\n",
    "src/grip_msgs/srv/Close.srv": "# Closes it.\n\nGrip grip\n---\nbool done\n",
    "src/grip_msgs/action/Hold.action": "float64 seconds 2\n---\nbool held\n---\nGrip now\n",
}
GRIPPER = """
from busflow import Node, action_client, publisher
from {module} import Grip, Hold


class Gripper(Node):
    grip = publisher(Grip, "grip")
    hold = action_client(Hold, "~/hold")
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with definition files, as the working directory; what a command has named is forgotten."""
    monkeypatch.chdir(write(tmp_path, FILES))
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    yield tmp_path
    name_folders([])


def said(capsys, *command: str) -> tuple[int, str]:
    code = main(list(command))
    captured = capsys.readouterr()
    return code, captured.out + captured.err


@pytest.mark.usefixtures("here")
def test_types_of_files_are_listed_and_shown(capsys):
    folder = ("--interfaces", "src")
    code, out = said(capsys, "interface", "list", *folder, "--json")
    assert code == 0
    listed = json.loads(out)
    assert "grip_msgs/msg/Grip" in listed["messages"]
    assert "grip_msgs/srv/Close" in listed["services"]
    assert "grip_msgs/action/Hold" in listed["actions"]
    assert said(capsys, "interface", "show", "grip_msgs/Grip", *folder)[1].startswith(
        "# How firmly.\n\nfloat64 force 0.5 # in newtons\ngeometry_msgs/Point at\n\tfloat64 x\n"
    )
    hold = said(capsys, "interface", "show", "grip_msgs/action/Hold", *folder, "--no-comments")[1]
    assert hold.startswith("float64 seconds 2\n---\nbool held\n---\ngrip_msgs/Grip now\n\tfloat64 force 0.5\n")
    assert said(capsys, "interface", "proto", "grip_msgs/Hold", *folder, "--no-quotes")[1] == "seconds: 2.0\n"
    assert said(capsys, "interface", "package", "grip_msgs", *folder)[1].split() == [
        "grip_msgs/action/Hold",
        "grip_msgs/msg/Grip",
        "grip_msgs/srv/Close",
    ]
    assert "grip_msgs" in said(capsys, "interface", "packages", *folder)[1].split()


def test_sourced_ros_is_found(here, capsys, monkeypatch):
    write(here, {"opt/share/sourced_msgs/msg/A.msg": "int8 a\n", "opt/share/std_msgs/msg/Own.msg": "int8 a\n"})
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(here / "opt"))
    name_folders([])
    assert said(capsys, "interface", "show", "sourced_msgs/A") == (0, "int8 a\n")
    assert said(capsys, "interface", "show", "std_msgs/Own")[0] == 4


def test_installed_package_offers_its_files(here, capsys, monkeypatch):
    offered = "[busflow.interfaces]\nhands = hands_pkg.definitions\n"
    write(
        here,
        {
            "site/hands_pkg/definitions/__init__.py": "",
            "site/hands_pkg/__init__.py": "raise RuntimeError('it was imported')",
            "site/hands_pkg/definitions/hands_msgs/msg/Hand.msg": "int8 fingers\n",
            "site/hands_pkg-1.dist-info/entry_points.txt": offered,
            "site/hands_pkg-1.dist-info/METADATA": "Metadata-Version: 2.1\nName: hands_pkg\nVersion: 1\n",
        },
    )
    monkeypatch.syspath_prepend(str(here / "site"))
    name_folders([])
    assert said(capsys, "interface", "show", "hands_msgs/Hand") == (0, "int8 fingers\n")


def test_mistake_in_a_file_has_its_place(here, capsys):
    write(here, {"src/grip_msgs/msg/Bad.msg": "int8 a\nint8 b 300\n"})
    code, out = said(capsys, "interface", "show", "grip_msgs/Bad", "--interfaces", "src")
    assert code == 2
    assert out == (
        "src/grip_msgs/msg/Bad.msg:2:8: error: 300 is out of the range of int8, -128 to 127\n"
        "  int8 b 300\n         ^^^\n"
    )
    assert said(capsys, "interface", "list", "-m", "--interfaces", "src")[0] == 0


def test_generated_module_is_checked_and_renewed(here, capsys):
    write(here, {"src/hand_msgs/msg/Hand.msg": "grip_msgs/Grip[2] grips\n"})
    command = ("interface", "generate", "grip_msgs", "hand_msgs", "--interfaces", "src", "--to", "robot/msgs")
    code, out = said(capsys, *command, "--check")
    assert (code, out.splitlines()) == (
        3,
        [
            "robot/msgs/grip_msgs.py is not there",
            "robot/msgs/hand_msgs.py is not there",
            "write them anew: busflow interface generate grip_msgs hand_msgs --interfaces src --to robot/msgs",
        ],
    )
    assert said(capsys, *command)[1] == "robot/msgs/grip_msgs.py: 3 types\nrobot/msgs/hand_msgs.py: 1 type\n"
    assert said(capsys, *command, "--check") == (0, "")
    assert "as before" in said(capsys, *command)[1]
    (here / "src/grip_msgs/msg/Grip.msg").write_text("# How firmly.\n\nfloat32 force 0.5\n")
    (here / "src/grip_msgs/msg/New.msg").write_text("")
    (here / "src/hand_msgs/msg/Hand.msg").write_text("# Both.\ngrip_msgs/Grip[2] grips\n")
    code, out = said(capsys, *command, "--check")
    assert code == 3
    changed = "action/Hold.action, msg/Grip.msg, srv/Close.srv has changed; msg/New.msg is new"
    assert f"robot/msgs/grip_msgs.py is out of date: {changed}\n" in out
    assert "robot/msgs/hand_msgs.py is out of date: msg/Hand.msg has changed\n" in out
    assert said(capsys, *command)[0] == 0
    assert said(capsys, *command, "--check") == (0, "")


@pytest.mark.long
def test_check_names_a_class_whose_file_has_changed(here, capsys):
    launch = "plugins: [plugins]\ninterfaces: [src]\nnodes:\n  gripper: {plugin: gripper}\n"
    write(here, {"run.yaml": launch, "plugins/gripper.py": GRIPPER.format(module=".msgs.grip_msgs")})
    make = ("interface", "generate", "grip_msgs", "--interfaces", "src", "--to", "plugins/msgs")
    assert said(capsys, *make)[0] == 0

    def checked():
        done = subprocess.run(
            [sys.executable, "-m", "busflow", "check", "run.yaml"], capture_output=True, text=True, cwd=here
        )
        return done.returncode, done.stdout + done.stderr

    assert checked()[0] == 0
    (here / "src/grip_msgs/msg/Grip.msg").write_text("float64 force\nint8 side\n")
    code, out = checked()
    assert code == 3
    assert "error: src/grip_msgs/msg/Grip.msg has changed since the class of grip_msgs/msg/Grip was written" in out
    assert f"  fix: {' '.join(('busflow', *make))}\n" in out
    assert said(capsys, *make)[0] == 0
    assert checked()[0] == 0
    (here / "src/grip_msgs/action/Hold.action").write_text("float64 seconds\n---\n---\nGrip now\nbool firm\n")
    code, out = checked()
    lines = (here / "plugins/msgs/grip_msgs.py").read_text().splitlines()
    line = lines.index('class Hold(ActionType, package="grip_msgs"):')
    assert f"grip_msgs.py:{line + 1}:1: error: src/grip_msgs/action/Hold.action has changed since" in out
    assert f"  fix: {' '.join(('busflow', *make))}\n" in out


def test_missing_folder_of_interfaces_is_named(here, capsys):
    write(here, {"run.yaml": "plugins: [plugins]\ninterfaces: [srcc]\nnodes:\n  a: {plugin: a}\n", "plugins/a.py": ""})
    code, out = said(capsys, "check", "run.yaml")
    assert code == 3
    assert f"run.yaml:2:14: error: there is no folder {here}/srcc" in out.replace(f"{here}/run.yaml", "run.yaml") or (
        "run.yaml:2:14: error: there is no folder srcc" in out
    )
    assert "did you mean 'src'?" in out


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    "package",
    ["action_msgs", "control_msgs", "example_interfaces", "lifecycle_msgs", "shape_msgs", "stereo_msgs", "vision_msgs"],
)
def test_exported_files_generate_the_same_module(capsys, package):
    """The way there and back loses nothing: not a comment, not a constant, not a default."""
    assert said(capsys, "interface", "export", f"busflow.msgs.{package}", "--to", f"ros/{package}")[0] == 0
    assert said(capsys, "interface", "generate", package, "--interfaces", "ros", "--to", "made")[0] == 0
    import busflow.msgs

    shipped = Path(busflow.msgs.__path__[0], f"{package}.py").read_text("utf-8")
    made = Path("made", f"{package}.py").read_text("utf-8")
    assert made.partition("\n#   ")[2] == shipped.partition("\n#   ")[2]


@pytest.mark.usefixtures("here")
def test_exported_package_has_what_ros_builds(capsys):
    code, out = said(capsys, "interface", "export", "busflow.msgs.action_msgs", "--to", "ros", "--licence", "MIT")
    assert (code, out.split()) == (
        0,
        [
            "ros/package.xml",
            "ros/CMakeLists.txt",
            "ros/msg/GoalInfo.msg",
            "ros/msg/GoalStatus.msg",
            "ros/msg/GoalStatusArray.msg",
            "ros/srv/CancelGoal.srv",
        ],
    )
    cmake, xml = Path("ros/CMakeLists.txt").read_text(), Path("ros/package.xml").read_text()
    assert 'rosidl_generate_interfaces(${PROJECT_NAME}\n  "msg/GoalInfo.msg"\n' in cmake
    assert "DEPENDENCIES builtin_interfaces unique_identifier_msgs)\n" in cmake
    assert "<depend>unique_identifier_msgs</depend>" in xml
    assert "<license>MIT</license>" in xml
    assert "<member_of_group>rosidl_interface_packages</member_of_group>" in xml


def test_plugin_folder_is_exported_with_comments(here):
    source = '''
from busflow import ActionType, Message, Node, publisher


class Hold(ActionType, package="squeeze_robot"):
    """Holds a thing."""

    class Goal(Message):
        """How long."""

        seconds: float = 2.0

    class Result(Message):
        """Nothing."""

    class Feedback(Message):
        left: float = 0.0
        """In seconds."""


class Squeeze(Message, package="squeeze_robot"):
    """How hard."""

    force: float = 1.0
    """In newtons."""


class Squeezer(Node):
    squeeze = publisher(Squeeze, "squeeze")
'''
    write(here, {"plugins/squeezer.py": source})
    done = subprocess.run(
        [sys.executable, "-m", "busflow", "interface", "export", "plugins", "--to", "ros"],
        capture_output=True,
        text=True,
        cwd=here,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert Path("ros/action/Hold.action").read_text() == (
        "# Holds a thing.\n\n# How long.\n\nfloat64 seconds 2\n---\n# Nothing.\n\n---\n# In seconds.\nfloat64 left\n"
    )
    assert "DEPENDENCIES action_msgs)" in Path("ros/CMakeLists.txt").read_text()
    assert Path("ros/msg/Squeeze.msg").read_text() == "# How hard.\n\n# In newtons.\nfloat64 force 1\n"


@pytest.mark.usefixtures("here")
def test_export_refuses_what_has_no_types(capsys):
    assert "cannot be imported" in said(capsys, "interface", "export", "no_such_module", "--to", "ros")[1]
    assert "has no message, service or action classes" in said(capsys, "interface", "export", "json", "--to", "ros")[1]
    code, out = said(capsys, "interface", "export", "busflow.msgs", "--to", "ros")
    assert code == 2
    assert "has types of several packages" in out


@pytest.mark.parametrize("module", ["__main__", "nowhere"])
@pytest.mark.usefixtures("here")
def test_classes_without_a_file_do_not_stop_export(module, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "__main__", type(sys)("__main__"))
    names = {"__name__": module, "Message": Message}
    exec("class Made(Message, package='made_here'): ...", names)  # noqa: S102  # as in a terminal
    assert said(capsys, "interface", "export", "busflow.msgs.shape_msgs", "--to", "ros")[0] == 0
    assert names["Made"]


@pytest.mark.long
@pytest.mark.e2e
def test_generated_source_satisfies_pyright_strict(here, capsys):
    pytest.importorskip("pyright", reason="running the tests alone needs no type checker")
    more = 'bool[2] pair [true, false]\nstring<=3[<=2] names ["a"]\nbyte B=1\nwstring w "x"\nuint8[] data [1]\n'
    (here / "src/grip_msgs/msg/More.msg").write_text(more)
    assert said(capsys, "interface", "generate", "grip_msgs", "--interfaces", "src", "--to", "robot")[0] == 0
    use = (
        "from robot.grip_msgs import Close, Grip\n\ngrip = Grip(force=1)\nheld: Grip = Close.Request(grip=grip).grip\n"
    )
    config = '{"typeCheckingMode": "strict"}'
    write(here, {"use.py": use, "robot/__init__.py": "", "pyrightconfig.json": config})
    done = subprocess.run(
        [sys.executable, "-m", "pyright", "--pythonpath", sys.executable], capture_output=True, text=True, cwd=here
    )
    assert done.returncode == 0, done.stdout
