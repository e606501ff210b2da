"""Definition files on the command line: looked at, made into classes, made of classes, compared with them.

Tests of `source.py` and `classes.py`, of `--interfaces`, and of what `busflow check` says.
"""

import ast
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from busflow import Message
from busflow.definitions.folders import name_folders
from tests.cli.conftest import LABS
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


TYPES = """\
show grip_msgs/Grip
show grip_msgs/action/Hold --no-comments
proto grip_msgs/Hold --no-quotes
package grip_msgs"""


@pytest.mark.usefixtures("here")
def test_types_of_files_are_listed_and_shown(shell):
    listed = shell.data("interface list --interfaces src")
    assert "grip_msgs/msg/Grip" in listed["messages"]
    assert "grip_msgs/srv/Close" in listed["services"]
    assert "grip_msgs/action/Hold" in listed["actions"]
    assert "grip_msgs" in shell.text("interface packages --interfaces src").split()
    for line in TYPES.splitlines():
        assert shell(f"interface {line} --interfaces src") == 0


def test_sourced_ros_is_found(here, shell, monkeypatch):
    write(here, {"opt/share/sourced_msgs/msg/A.msg": "int8 a\n", "opt/share/std_msgs/msg/Own.msg": "int8 a\n"})
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(here / "opt"))
    name_folders([])
    assert shell("interface show sourced_msgs/A") == 0
    shell.text("interface show std_msgs/Own", code=4)


def test_installed_package_offers_its_files(here, shell, monkeypatch):
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
    assert shell("interface show hands_msgs/Hand") == 0


def test_mistake_in_a_file_has_its_place(here, shell):
    write(here, {"src/grip_msgs/msg/Bad.msg": "int8 a\nint8 b 300\n"})
    assert shell("interface show grip_msgs/Bad --interfaces src") == 2
    shell.text("interface list -m --interfaces src")


def test_generated_module_is_checked_and_renewed(here, shell):
    write(here, {"src/hand_msgs/msg/Hand.msg": "grip_msgs/Grip[2] grips\n"})
    command = "interface generate grip_msgs hand_msgs --interfaces src --to robot/msgs"
    assert shell(f"{command} --check") == 3
    assert shell(command) == 0
    assert shell(f"{command} --check") == 0
    assert shell(command) == 0
    (here / "src/grip_msgs/msg/Grip.msg").write_text("# How firmly.\n\nfloat32 force 0.5\n")
    (here / "src/grip_msgs/msg/New.msg").write_text("")
    (here / "src/hand_msgs/msg/Hand.msg").write_text("# Both.\ngrip_msgs/Grip[2] grips\n")
    assert shell(f"{command} --check") == 3
    assert shell(command) == 0
    assert shell(f"{command} --check") == 0


@pytest.mark.long
def test_check_names_a_class_whose_file_has_changed(here, shell):
    launch = "plugins: [plugins]\ninterfaces: [src]\nnodes:\n  gripper: {plugin: gripper}\n"
    write(here, {"run.yaml": launch, "plugins/gripper.py": GRIPPER.format(module=".msgs.grip_msgs")})
    make = "interface generate grip_msgs --interfaces src --to plugins/msgs"
    shell.text(make)

    def checked() -> int:
        done = subprocess.run(
            [sys.executable, "-m", "busflow", "check", "run.yaml"], capture_output=True, text=True, cwd=here
        )
        shell.note(
            f"$ busflow check run.yaml\n{done.stdout}{done.stderr}", mask={r"grip_msgs.py:\d+": "grip_msgs.py:#"}
        )
        return done.returncode

    assert checked() == 0
    (here / "src/grip_msgs/msg/Grip.msg").write_text("float64 force\nint8 side\n")
    assert checked() == 3
    shell.text(make)
    assert checked() == 0
    (here / "src/grip_msgs/action/Hold.action").write_text("float64 seconds\n---\n---\nGrip now\nbool firm\n")
    assert checked() == 3


def test_missing_folder_of_interfaces_is_named(here, shell):
    write(here, {"run.yaml": "plugins: [plugins]\ninterfaces: [srcc]\nnodes:\n  a: {plugin: a}\n", "plugins/a.py": ""})
    assert shell("check run.yaml", mask={"TMP_PATH/": ""}) == 3


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    "package",
    ["action_msgs", "control_msgs", "example_interfaces", "lifecycle_msgs", "shape_msgs", "stereo_msgs", "vision_msgs"],
)
def test_exported_files_generate_the_same_module(shell, package):
    """The way there and back loses nothing: not a comment, not a constant, not a default."""
    shell.text(f"interface export busflow.msgs.{package} --to ros/{package}")
    shell.text(f"interface generate {package} --interfaces ros --to made")
    import busflow.msgs

    shipped = Path(busflow.msgs.__path__[0], f"{package}.py").read_text("utf-8")
    made = Path("made", f"{package}.py").read_text("utf-8")
    names = re.search(r"\n__all__ = (\[[^]]*\])\n", made)
    assert sorted(ast.literal_eval(names[1])) == sorted(import_module(f"busflow.msgs.{package}").__all__)
    # A module that is shipped may find its names by itself.
    own = re.sub(
        r"from busflow.msgs import export_types\n|(?<=import )export_types, |\n\nexport_types.*\n", "", shipped
    )
    texts = [re.sub(r"\n__all__ = \[[^]]*\]\n", "", each.partition("\n#   ")[2]) for each in (made, own)]
    assert texts[0] == texts[1]


@pytest.mark.usefixtures("here")
def test_exported_package_has_what_ros_builds(shell):
    assert shell("interface export busflow.msgs.action_msgs --to ros --licence MIT") == 0
    for name in ("package.xml", "CMakeLists.txt"):
        shell.note(Path("ros", name).read_text("utf-8"), mask={"<version>.*<": "<version>#<"})


def test_plugin_folder_is_exported_with_comments(here, shell):
    write(here, {"plugins/exported.py": (LABS / "plugins/exported.py").read_text()})
    done = subprocess.run(
        [sys.executable, "-m", "busflow", "interface", "export", "plugins", "--to", "ros"],
        capture_output=True,
        text=True,
        cwd=here,
    )
    assert (done.returncode, done.stderr) == (0, "")
    for name in ("action/Hold.action", "msg/Squeeze.msg", "CMakeLists.txt"):
        shell.note(Path("ros", name).read_text("utf-8"))


@pytest.mark.usefixtures("here")
def test_export_refuses_modules_without_types(shell):
    for module in ("no_such_module", "json", "busflow.msgs"):
        assert shell(f"interface export {module} --to ros", mask={r"packages, .*": "packages, …"}) == 2


@pytest.mark.parametrize("module", ["__main__", "nowhere"])
@pytest.mark.usefixtures("here")
def test_classes_without_a_file_do_not_stop_export(module, shell, monkeypatch):
    monkeypatch.setitem(sys.modules, "__main__", type(sys)("__main__"))
    names = {"__name__": module, "Message": Message}
    exec("class Made(Message, package='made_here'): ...", names)  # noqa: S102  # as in a terminal
    shell.text("interface export busflow.msgs.shape_msgs --to ros")
    assert names["Made"]


@pytest.mark.long
@pytest.mark.e2e
def test_generated_source_satisfies_pyright_strict(here, shell):
    pytest.importorskip("pyright", reason="running the tests alone needs no type checker")
    more = 'bool[2] pair [true, false]\nstring<=3[<=2] names ["a"]\nbyte B=1\nwstring w "x"\nuint8[] data [1]\n'
    (here / "src/grip_msgs/msg/More.msg").write_text(more)
    shell.text("interface generate grip_msgs --interfaces src --to robot")
    use = (
        "from robot.grip_msgs import Close, Grip\n\ngrip = Grip(force=1)\nheld: Grip = Close.Request(grip=grip).grip\n"
    )
    config = '{"typeCheckingMode": "strict"}'
    write(here, {"use.py": use, "robot/__init__.py": "", "pyrightconfig.json": config})
    done = subprocess.run(
        [sys.executable, "-m", "pyright", "--pythonpath", sys.executable], capture_output=True, text=True, cwd=here
    )
    assert done.returncode == 0, done.stdout
