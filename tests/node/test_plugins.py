"""Plugins are found by text alone, loaded once per file, and a failure names the user's line."""

import asyncio
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from busflow.errors import PluginError
from busflow.node import plugins

NODE = "from busflow.node.node import Node\n\n\nclass {name}(Node):\n    '''{name} does its work.\n\n    More.'''\n"

Write = Callable[[str, str], Path]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "plugins"


@pytest.fixture
def write(folder: Path) -> Write:
    def write(name: str, text: str) -> Path:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    return write


def failure(reference: str, *folders: Path) -> PluginError:
    with pytest.raises(PluginError) as caught:
        plugins.load(reference, folders)
    assert "\x1b" not in str(caught.value)
    return caught.value


def modules_of(folder: Path) -> list[str]:
    return [
        name
        for name, module in sys.modules.items()
        if (getattr(module, "__file__", None) or "").startswith(str(folder) + os.sep)
    ]


class TestLoading:
    def test_a_name_means_the_file_s_only_node(self, write: Write, folder: Path):
        write("camera.py", NODE.format(name="Camera") + "class Helper: ...\nclass _Base(Node): ...\n")
        assert plugins.load("camera", [folder]).__name__ == "Camera"

    def test_loading_twice_gives_the_same_class(self, write: Write, folder: Path):
        write("camera.py", NODE.format(name="Camera"))
        assert plugins.load("camera", [folder]) is plugins.load("camera:Camera", [str(folder)])

    def test_an_imported_node_does_not_count(self, write: Write, folder: Path):
        write("camera.py", NODE.format(name="Camera"))
        write("night.py", "from .camera import Camera\n\nclass Night(Camera): ...\n")
        night = plugins.load("night", [folder])
        assert night.__name__ == "Night"
        assert night.__base__ is plugins.load("camera", [folder])

    def test_a_class_is_chosen_by_name_even_private(self, write: Write, folder: Path):
        write("camera.py", NODE.format(name="Camera") + "class _Left(Camera): ...\nclass Right(Camera): ...\n")
        write("eyes.py", "from .camera import Right\n")
        assert plugins.load("camera:_Left", [folder]).__name__ == "_Left"
        assert plugins.load("eyes:Right", [folder]) is plugins.load("camera:Right", [folder])

    def test_a_package_offers_its_init_s_inner_imports(self, write: Write, folder: Path):
        write("arm/__init__.py", "from .driver import Arm\n")
        write("arm/driver.py", NODE.format(name="Arm"))
        write("arm/broken.py", "this is not Python")
        assert plugins.load("arm", [folder]).__name__ == "Arm"

    def test_a_folder_without_init_offers_its_files_nodes(self, write: Write, folder: Path):
        write("arm/driver.py", NODE.format(name="Arm"))
        write("arm/script.py", "raise RuntimeError('imported without need')\n")
        assert plugins.load("arm", [folder]).__name__ == "Arm"
        assert plugins.load("arm:Arm", [folder]).__name__ == "Arm"

    def test_a_data_folder_beside_a_file_is_ignored(self, write: Write, folder: Path):
        write("arm.py", NODE.format(name="Arm"))
        write("arm/model.urdf", "<robot/>")
        assert plugins.load("arm", [folder]).__name__ == "Arm"

    def test_a_file_written_after_a_load_is_seen(self, write: Write, folder: Path):
        for index in range(2):
            write(f"n{index}.py", NODE.format(name=f"N{index}"))
            os.utime(folder, (0, 0))  # what a clock too coarse to tell the two moments apart would leave
            assert plugins.load(f"n{index}", [folder]).__name__ == f"N{index}"


class TestOnePackage:
    @pytest.mark.parametrize("name", ["plugins", "my plugins", "0-weird.name", "größe", "a.b"])
    @pytest.mark.parametrize("init", [True, False])
    def test_files_import_each_other_in_any_folder(self, tmp_path: Path, name: str, init: bool):
        folder = tmp_path / name
        (folder / "parts").mkdir(parents=True)
        if init:
            (folder / "__init__.py").write_text("LIMIT = 3\n")
        (folder / "shared.py").write_text("VALUE = []\n")
        (folder / "parts/motor.py").write_text("from ..shared import VALUE\nfrom .. import shared\n")
        (folder / "arm.py").write_text(
            "from .parts import motor\nfrom . import shared\n"
            + ("from . import LIMIT\n" if init else "")
            + NODE.format(name="Arm")
            + "    same = motor.VALUE is shared.VALUE and motor.shared is shared\n"
        )
        assert vars(plugins.load("arm", [folder]))["same"]

    def test_two_folders_of_one_base_name_never_meet(self, tmp_path: Path):
        for side in ("left", "right"):
            folder = tmp_path / side / "plugins"
            folder.mkdir(parents=True)
            (folder / "side.py").write_text(f"SIDE = {side!r}\n")
            (folder / f"{side}_arm.py").write_text(
                "from .side import SIDE\n" + NODE.format(name="Arm") + "    side = SIDE\n"
            )
        both = [tmp_path / "left/plugins", tmp_path / "right/plugins"]
        assert vars(plugins.load("left_arm", both))["side"] == "left"
        assert vars(plugins.load("right_arm", both))["side"] == "right"

    def test_a_linked_folder_is_the_same_package(self, write: Write, folder: Path):
        write("arm.py", NODE.format(name="Arm"))
        (folder.parent / "link").symlink_to(folder)
        assert plugins.load("arm", [folder]) is plugins.load("arm", [folder.parent / "link"])
        assert plugins.load("arm", [folder, folder.parent / "link"])

    @pytest.mark.parametrize("inner_first", [True, False])
    def test_a_folder_inside_another_shares_its_files(self, write: Write, folder: Path, inner_first: bool):
        write("inner/arm.py", NODE.format(name="Arm"))
        write("outer.py", "from .inner.arm import Arm\nclass Outer(Arm): ...\n")
        order = [("arm", folder / "inner"), ("outer", folder)]
        loaded = {name: plugins.load(name, [where]) for name, where in (order if inner_first else reversed(order))}
        assert loaded["outer"].__base__ is loaded["arm"]

    def test_a_hard_link_is_its_own_file(self, write: Write, folder: Path, tmp_path: Path):
        original = write("arm.py", NODE.format(name="Arm"))
        (tmp_path / "copy").mkdir()
        os.link(original, tmp_path / "copy/arm.py")
        assert plugins.load("arm", [folder]) is not plugins.load("arm", [tmp_path / "copy"])

    @pytest.mark.parametrize("init", [True, False])
    def test_a_normally_imported_file_is_reused(
        self, write: Write, folder: Path, init: bool, monkeypatch: pytest.MonkeyPatch
    ):
        name = f"robot_{'with' if init else 'without'}_init"
        package = folder / name
        if init:
            write(f"{name}/__init__.py", "MARK = object()\n")
        write(f"{name}/arm.py", NODE.format(name="Arm"))
        mark = "from . import MARK as mark" if init else "mark = None"
        write(f"{name}/hand.py", f"from .arm import Arm\nclass Hand(Arm):\n    {mark}\n")
        monkeypatch.syspath_prepend(folder)
        arm = __import__(f"{name}.arm").arm.Arm
        assert plugins.load("arm", [package]) is arm
        hand = plugins.load("hand", [package])
        assert hand.__base__ is arm
        assert vars(hand)["mark"] is getattr(sys.modules[name], "MARK", None)

    def test_a_module_imported_through_a_link_is_reused(
        self, write: Write, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ):
        write("linked_arm.py", NODE.format(name="Arm"))
        (tmp_path / "link").symlink_to(folder)
        monkeypatch.syspath_prepend(tmp_path / "link")
        arm = __import__("linked_arm").Arm
        assert plugins.load("linked_arm", [folder]) is arm

    def test_a_script_in_its_folder_is_imported_once(self, write: Write, folder: Path):
        script = write(
            "arm.py",
            "from busflow.node.node import Node\nfrom busflow.node.plugins import load\n"
            "class Arm(Node): ...\n"
            "if __name__ == '__main__':\n    assert load('arm', ['.']) is Arm\n",
        )
        subprocess.run([sys.executable, script], cwd=folder, check=True)


@pytest.mark.usefixtures("nothing_installed")
class TestFinding:
    @pytest.mark.parametrize("name", ["assistant", "page_index"])
    def test_plugin_of_another_distribution_names_its_installation(self, name: str, folder: Path, golden):
        golden(failure(name, folder).problem.fix)

    def test_names_and_summaries_are_listed_without_importing(self, write: Write, folder: Path):
        write("camera.py", NODE.format(name="Camera") + "raise SystemExit\n")
        write("arms.py", "'Both.'\nimport busflow as b\nclass Left(b.Node): ...\nclass Right(Left): ...\n")
        write("leg/knee.py", NODE.format(name="Knee"))
        write("none.py", "from .camera import Camera\n")
        write("_private.py", NODE.format(name="Private"))
        found = plugins.find([folder])
        assert modules_of(folder) == []
        assert {each.name: each.summary for each in found} == {
            "camera": "Camera does its work.",
            "arms:Left": "Both.",
            "arms:Right": "Both.",
            "leg": "Knee does its work.",
        }
        assert [(each.file, each.line) for each in found if each.name == "camera"] == [(f"{folder}/camera.py", 4)]

    def test_every_name_found_can_be_loaded(self, write: Write, folder: Path):
        write("arms.py", NODE.format(name="Left") + "class Right(Left): ...\n")
        write("leg/knee.py", NODE.format(name="Knee"))
        names = [each.name for each in plugins.find([folder])]
        assert [plugins.load(name, [folder]).__name__ for name in names] == ["Left", "Right", "Knee"]

    def test_names_are_found_in_the_working_directory(self, write: Write, folder: Path, monkeypatch):
        write("leg/knee.py", NODE.format(name="Knee"))
        monkeypatch.chdir(folder.parent)
        assert folder.name == "plugins"
        assert {"leg"} == {*plugins.names()} - {each.name for each in plugins.find([])}

    @pytest.mark.parametrize("text", [b"class (", b"x = '\x00'", b"\xff\xfe", b"(" * 100_000])
    def test_a_broken_file_is_listed_with_its_fault(self, write: Write, folder: Path, text: bytes):
        write("bad.py", "").write_bytes(text)
        write("good.py", NODE.format(name="Good"))
        bad, good = plugins.find([folder])
        assert (bad.name, good.name) == ("bad", "good")
        assert bad.fault is not None
        assert failure("bad", folder).problem.place is not None

    def test_folders_that_are_missing_or_files_offer_nothing(self, write: Write, folder: Path):
        path = write("camera.py", NODE.format(name="Camera"))
        assert plugins.find([folder / "missing", path]) == plugins.find([])


class TestNotFound:
    def test_error_has_the_nearest_name_and_places(self, write: Write, folder: Path, golden):
        write("camera.py", NODE.format(name="Camera"))
        error = failure("camra", folder, folder / "other")
        assert "no plugin 'camra'" in str(error)
        assert "did you mean 'camera'?" in str(error)
        golden(str(error))
        assert error.problem.code == "unknown-plugin"
        assert error.exit_code == 2

    @pytest.mark.parametrize("reference", ["", ":", "os:system", "../camera", "/", "a\x1b[31m", "ａ" * 5000, ".."])
    def test_an_invalid_name_is_not_read_as_path(self, write: Write, folder: Path, reference: str):
        write("camera.py", NODE.format(name="Camera"))
        (folder / "inside").mkdir()
        assert failure(reference, folder / "inside").problem.code == "unknown-plugin"

    def test_node_itself_is_no_plugin(self, write: Write, folder: Path):
        write("camera.py", "from busflow.node.node import Node as Camera\n")
        assert "'Camera' in" in str(failure("camera:Camera", folder))

    def test_a_path_as_name_gets_the_right_form(self, folder: Path):
        assert "write 'camera'" in str(failure("../plugins/camera.py", folder))

    def test_two_of_one_name_are_both_named(self, write: Write, folder: Path):
        write("a/camera.py", NODE.format(name="Camera"))
        write("b/camera.py", NODE.format(name="Camera"))
        error = failure("camera", folder / "a", folder / "b")
        assert str(folder / "a/camera.py") in str(error)
        assert str(folder / "b/camera.py") in str(error)

    def test_a_file_without_a_node_says_so(self, write: Write, folder: Path, golden):
        write("camera.py", "from busflow.node.node import Node\n")
        golden(str(failure("camera", folder)))

    def test_several_nodes_are_offered_by_name(self, write: Write, folder: Path, golden):
        write("arms.py", NODE.format(name="Left") + "class Right(Left): ...\n")
        error = failure("arms", folder)
        golden(str(error))

    def test_an_unknown_class_is_answered_with_the_nearest(self, write: Write, folder: Path, golden):
        write("arms.py", NODE.format(name="Left") + "LIMIT = 3\n")
        golden(str(failure("arms:Lef", folder)))
        assert "'LIMIT' in" in str(failure("arms:LIMIT", folder))

    @pytest.mark.parametrize("name", ["x" * 1_000_000, "\x1b[31m" * 100_000])
    @pytest.mark.parametrize("way", ["{}", "arms:{}", "folder/{}.py"])
    def test_a_name_of_a_megabyte_is_cut(self, write: Write, folder: Path, name: str, way: str):
        write("arms.py", NODE.format(name="Left"))
        assert len(str(failure(way.format(name), folder))) < 2_000


class TestFailingImport:
    def test_a_plugin_error_shows_no_busflow_frames(self, write: Write, folder: Path):
        write("helper.py", "def check(x):\n    return [].pop(x)\n")
        path = write("camera.py", "from .helper import check\n\nvalue =  check(3)\n" + NODE.format(name="Camera"))
        error = failure("camera", folder)
        fault = "plugin 'camera' cannot be imported: IndexError: pop from empty list"
        assert str(error).splitlines() == [
            f"{folder}/helper.py:2:12: error: {fault}",
            "      return [].pop(x)",
            "             ^^^^^^^^^",
            f"  used by {path}:3:10",
        ]

    def test_a_library_error_names_the_plugins_line(self, write: Write, folder: Path, golden):
        write("camera.py", "import json\njson.loads('{')\n")
        golden(str(failure("camera", folder)))

    def test_a_syntax_error_has_its_column_and_line(self, write: Write, folder: Path, golden):
        write("helper.py", "x = 1\nclass Camera(:\n")
        write("camera.py", "from . import helper\n")
        golden(str(failure("camera", folder)))

    def test_a_syntax_error_without_init_is_located(self, write: Write, folder: Path):
        path = write("arm/driver.py", "class Arm(\n")
        assert str(failure("arm", folder)).startswith(f"{path}:1:")

    def test_declaration_mistake_names_the_line_of_the_class(self, write: Write, folder: Path, golden):
        write("camera.py", "from busflow import Node\n\nclass Camera(Node):\n    def clock(self): ...\n")
        golden(str(failure("camera", folder)))

    def test_an_absolute_neighbour_import_suggests_the_relative_one(self, write: Write, folder: Path):
        write("helper.py", "")
        write("camera.py", "import helper\n")
        assert "write `from .helper import …`" in str(failure("camera", folder))
        write("lidar.py", f"import {folder.name}.helper\n")
        assert "write `from .helper import …`" in str(failure("lidar", folder))

    def test_a_mistyped_neighbour_is_answered_with_the_nearest(self, write: Write, folder: Path):
        write("helper.py", "")
        write("camera.py", "from .helpr import x\n")
        text = str(failure("camera", folder))
        assert "No module named '.helpr'" in text
        assert "did you mean 'helper'?" in text

    def test_a_missing_library_is_to_be_installed(self, write: Write, folder: Path, golden):
        write("camera.py", "import no_such_library\n")
        golden(str(failure("camera", folder)), mask={re.escape(sys.prefix): "ENVIRONMENT"})

    def test_a_ros_import_suggests_busflows_own(self, write: Write, folder: Path, golden):
        write("camera.py", "import rclpy\n")
        golden(str(failure("camera", folder)))
        write("imu.py", "from sensor_msgs.msg import Imu\n")
        golden(str(failure("imu", folder)))
        write("joints.py", "from busflow.msgs.sensor_msgs.msg import JointState\n")
        golden(str(failure("joints", folder)))

    def test_a_forgotten_import_is_written_out(self, write: Write, folder: Path, golden):
        write("camera.py", "last = Imu()\n")
        golden(str(failure("camera", folder)))
        write("lidar.py", "@timer(1)\ndef tick(self): ...\n")
        golden(str(failure("lidar", folder)))
        write("radar.py", "nothing_of_ours\n")
        assert "fix" not in str(failure("radar", folder))

    def test_a_wrong_hook_is_marked_at_its_line(self, write: Write, folder: Path, golden):
        write("camera.py", "from busflow import Node\n\nclass Camera(Node):\n    def start(self): ...\n")
        golden(str(failure("camera", folder)))

    @pytest.mark.parametrize("statement", ["raise SystemExit(3)", "import sys; sys.exit()", "exit()"])
    def test_a_plugin_that_exits_is_an_error(self, write: Write, folder: Path, statement: str):
        write("camera.py", f"{statement}\n")
        assert 'under `if __name__ == "__main__":`' in str(failure("camera", folder))

    def test_a_plugins_keyboard_interrupt_differs_from_ctrl_c(self, write: Write, folder: Path):
        write("raises.py", "raise KeyboardInterrupt\n")
        assert "KeyboardInterrupt" in str(failure("raises", folder))
        write("slow.py", "import signal\nsignal.raise_signal(signal.SIGINT)\n")
        handler = signal.signal(signal.SIGINT, signal.default_int_handler)
        try:
            with pytest.raises(KeyboardInterrupt):
                plugins.load("slow", [folder])
        finally:
            signal.signal(signal.SIGINT, handler)
        assert modules_of(folder) == []

    def test_cancellation_is_no_fault_of_the_plugin(self, write: Write, folder: Path):
        write("camera.py", "import asyncio\nraise asyncio.CancelledError\n")
        with pytest.raises(asyncio.CancelledError):
            plugins.load("camera", [folder])
        assert modules_of(folder) == []

    def test_control_characters_are_shown_as_escapes(self, write: Write, folder: Path):
        write("camera.py", "raise ValueError('\\x1b[31mred\\nsecond line')\n")
        text = str(failure("camera", folder))
        assert r"\x1b[31mred second line" in text

    def test_an_error_with_a_broken_str_is_shown(self, write: Write, folder: Path, golden):
        write("camera.py", "class E(Exception):\n    def __str__(self):\n        raise RuntimeError\nraise E\n")
        golden(str(failure("camera", folder)))

    def test_endless_recursion_is_one_line(self, write: Write, folder: Path):
        write("camera.py", "def f():\n    f()\nf()\n")
        assert len(str(failure("camera", folder)).splitlines()) == 4

    def test_a_failed_import_leaves_no_module_behind(self, write: Write, folder: Path):
        write("__init__.py", "")
        write("helper.py", "STEP = 1\n")
        write(
            "camera.py",
            f"from . import helper\n{NODE.format(name='Camera')}\nraise ValueError(helper.STEP)\n",
        )
        failure("camera", folder)
        assert modules_of(folder) == []
        write("helper.py", "STEP = 'a second one'\n")
        write("camera.py", f"from . import helper\n{NODE.format(name='Camera')}    step = helper.STEP\n")
        assert vars(plugins.load("camera", [folder]))["step"] == "a second one"

    def test_the_folder_s_message_type_survives_another_attempt(self, write: Write, folder: Path):
        write(
            "messages.py",
            "from busflow import Message\nclass Grip(Message, package='my_robot'):\n    force: float = 0.0\n",
        )
        write("hand.py", f"from .messages import Grip\n{NODE.format(name='Hand')}\nraise ValueError\n")
        failure("hand", folder)
        write("hand.py", f"from .messages import Grip\n{NODE.format(name='Hand')}")
        assert plugins.load("hand", [folder]).__name__ == "Hand"

    def test_a_neighbour_of_a_failed_import_is_reread(self, write: Write, folder: Path):
        write("other.py", NODE.format(name="Other"))
        plugins.load("other", [folder])
        write("helper.py", "STEP = 1\n")
        write("camera.py", "from . import helper\nraise ValueError\n")
        failure("camera", folder)
        write("helper.py", "STEP = 'two'\n")
        write("camera.py", f"from . import helper\n{NODE.format(name='Camera')}    step = helper.STEP\n")
        assert vars(plugins.load("camera", [folder]))["step"] == "two"

    def test_a_neighbour_imported_by_its_own_name_is_reread(
        self, write: Write, folder: Path, monkeypatch: pytest.MonkeyPatch
    ):
        write("own_neighbour.py", "STEP = 1\n")
        write("camera.py", "import own_neighbour\nraise ValueError\n")
        monkeypatch.syspath_prepend(folder)
        failure("camera", folder)
        assert "own_neighbour" not in sys.modules

    def test_a_failure_leaves_what_was_loaded_before(self, write: Write, folder: Path):
        write("helper.py", NODE.format(name="Helper"))
        write("camera.py", "from . import helper\nraise ValueError\n")
        helper = plugins.load("helper", [folder])
        failure("camera", folder)
        assert plugins.load("helper", [folder]) is helper

    def test_a_package_whose_init_fails_is_forgotten(self, write: Write, folder: Path):
        write("__init__.py", "raise ValueError('in init')\n")
        write("camera.py", NODE.format(name="Camera"))
        assert "in init" in str(failure("camera", folder))
        write("__init__.py", "")
        assert plugins.load("camera", [folder]).__name__ == "Camera"


class TestInstalled:
    @pytest.fixture(autouse=True)
    def site(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
        """A folder on the path with an installed distribution that offers nodes."""
        site = tmp_path / "site"
        package = site / "lab_nodes"
        package.mkdir(parents=True)
        (package / "__init__.py").write_text("")
        (package / "lidar.py").write_text(NODE.format(name="Lidar"))
        (package / "broken.py").write_text("raise ValueError('no device')\n")
        metadata = site / "lab_nodes-1.0.dist-info"
        metadata.mkdir()
        (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: lab-nodes\nVersion: 1.0\n")
        (metadata / "entry_points.txt").write_text(
            "[busflow.nodes]\nlidar = lab_nodes.lidar:Lidar\nwhole = lab_nodes.lidar\n"
            "broken = lab_nodes.broken:Node\ngone = lab_nodes.gone:Node\n"
        )
        monkeypatch.syspath_prepend(site)
        for name in [name for name in sys.modules if name.startswith("lab_nodes")]:
            monkeypatch.delitem(sys.modules, name)
        return site

    @pytest.mark.parametrize("reference", ["lidar", "whole", "whole:Lidar"])
    def test_an_entry_point_names_class_or_module(self, reference: str):
        assert plugins.load(reference, []).__name__ == "Lidar"

    def test_installed_plugins_are_listed_without_importing_them(self):
        found = {each.name: each for each in plugins.find([])}
        assert found["lidar"].summary == found["whole"].summary == "Lidar does its work."
        assert found["gone"].summary == ""
        assert not [name for name in sys.modules if name.startswith("lab_nodes")]

    def test_a_folder_comes_before_what_is_installed(self, write: Write, folder: Path):
        write("lidar.py", NODE.format(name="Mine"))
        assert plugins.load("lidar", [folder]).__name__ == "Mine"
        assert [each.line for each in plugins.find([folder]) if each.name == "lidar"] == [4]

    def test_failing_import_is_reported_with_its_line(self, site: Path):
        assert str(failure("broken")).startswith(f"{site}/lab_nodes/broken.py:1:1: error: plugin 'broken'")
        assert "No module named 'lab_nodes.gone'" in str(failure("gone"))

    def test_distributions_are_scanned_only_without_a_folder(
        self, write: Write, folder: Path, monkeypatch: pytest.MonkeyPatch
    ):
        class Scan:
            happened = False

            @classmethod
            def find_spec(cls, *_: object) -> None: ...

            @classmethod
            def find_distributions(cls, _: object) -> list[object]:
                cls.happened = True
                return []

        monkeypatch.setattr(sys, "meta_path", [*sys.meta_path, Scan])
        write("camera.py", NODE.format(name="Camera"))
        plugins.load("camera", [folder])
        assert not Scan.happened
        failure("radar", folder)
        assert Scan.happened


class TestBuiltIn:
    def test_player_is_listed_and_loaded(self):
        player, robot, frames = plugins.built_in()
        assert (robot.name, frames.name) == ("robot_state_publisher", "static_frames")
        assert (player.name, player.fault) == ("player", None)
        assert player.summary.startswith(plugins.load("player", []).__doc__.partition("\n")[0])

    def test_a_folder_comes_before_them(self, write: Write, folder: Path):
        write("player.py", NODE.format(name="Mine"))
        assert plugins.load("player", [folder]).__name__ == "Mine"
