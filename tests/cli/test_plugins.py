"""`busflow plugins` lists plugins without importing them, and describes one."""

import json
import os
from collections.abc import Iterator
from pathlib import Path
from shutil import copytree
from tempfile import TemporaryDirectory

import pytest

from busflow.cli import main

pytestmark = pytest.mark.usefixtures("project")

Captured = pytest.CaptureFixture[str]

CHOOSY = '''
from typing import Literal

from pydantic import Field

from busflow import Node, Parameters, client, publisher, service, subscription
from busflow.msgs.std_msgs import Bool, Float64
from busflow.msgs.std_srvs import Trigger


class ChoosyParameters(Parameters):
    side: Literal["left", "right"]
    gain: float = Field(default=1.0, gt=0, le=10, description="How much.")


class Choosy(Node):
    """Wants to know a side."""

    parameters: ChoosyParameters
    ready = publisher(Bool, "~/ready")

    @subscription("numbers")
    def receive(self, number: Float64) -> None: ...

    other = client(Trigger, "other")

    @service(Trigger, "~/reset")
    def on_reset(self, request: Trigger.Request) -> Trigger.Response: ...
'''


@pytest.mark.usefixtures("nothing_installed")
def test_names_and_summaries_are_listed(capsys: Captured):
    Path("plugins/broken.py").write_text("class (")
    assert main(["plugins", "list"]) == 0
    assert dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines()) == {
        "broken": "cannot be read: SyntaxError: invalid syntax",
        "listener": "Logs what it receives.",
        "talker": "Counts aloud.",
        "player": "Publishes a recording: every message on its topic, with the recorded QoS, in its order and time.",
        "robot_state_publisher": "Publishes a robot's description, and where its links are as its joints move.",
        "static_frames": "Publishes frames that never move on `/tf_static`, as `frames:` of a launch file states them.",
    }


@pytest.mark.usefixtures("nothing_installed")
def test_list_is_the_same_as_json(capsys: Captured):
    assert main(["plugins", "list", "--json", "--folder", "plugins"]) == 0
    first = json.loads(capsys.readouterr().out)["plugins"][0]
    assert first == {
        "name": "listener",
        "summary": "Logs what it receives.",
        "file": "plugins/listener.py",
        "line": 6,
        "fault": None,
    }


@pytest.mark.usefixtures("nothing_installed")
def test_empty_list_names_the_searched_folders(capsys: Captured, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    assert main(["plugins", "list"]) == 0
    output = capsys.readouterr()
    assert output.err == "no plugins in plugins, and none installed but these\n"
    assert output.out.split()[0] == "player"


def test_plugin_replaces_built_in_of_its_name(capsys: Captured):
    assert main(["plugins", "info", "player"]) == 0
    assert "file" in capsys.readouterr().out
    Path("plugins/player.py").write_text(Path("plugins/talker.py").read_text())
    assert main(["plugins", "list"]) == 0
    assert "Publishes a recording" not in capsys.readouterr().out


def test_missing_folder_is_an_error(capsys: Captured):
    assert main(["plugins", "list", "--folder", "plugin"]) == 2
    assert "'plugin' does not exist" in capsys.readouterr().err


def test_info_shows_parameters_and_topics(capsys: Captured):
    assert main(["plugins", "info", "talker"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "talker: Counts aloud.",
        "  plugins/talker.py",
        "",
        "Parameters:",
        "  rate_hz  float  = 100.0",
        "  fail_at  int    = 0",
        "",
        "Publishes:",
        "  /numbers  std_msgs/msg/Float64",
        "",
        "Receives: nothing",
    ]


def test_info_without_docstring_has_the_name_alone(capsys: Captured):
    Path("plugins/bare.py").write_text("from busflow import Node\n\n\nclass Bare(Node): ...\n")
    assert main(["plugins", "info", "bare"]) == 0
    assert capsys.readouterr().out.splitlines()[0] == "bare"


def test_info_needs_no_values_for_required_parameters(capsys: Captured):
    Path("plugins/choosy.py").write_text(CHOOSY)
    assert main(["plugins", "info", "choosy"]) == 0
    out = capsys.readouterr().out
    assert "  side  " in out
    assert "required  left | right" in out
    assert "= 1.0     greater than 0, at most 10  How much." in out
    assert "/choosy/ready  std_msgs/msg/Bool" in out
    assert "/numbers  std_msgs/msg/Float64" in out
    assert "Serves:\n  /choosy/reset  std_srvs/srv/Trigger" in out
    assert "Calls:\n  /other  std_srvs/srv/Trigger" in out
    assert "may add topics" in out


@pytest.mark.parametrize(
    ("code", "reason"),
    [
        ("    def __init__(self, *args, **kwargs):\n        raise OSError('no camera')", "OSError: no camera"),
        ("    @abstractmethod\n    def take(self): ...", "TypeError: Can't instantiate abstract class Odd"),
    ],
)
def test_info_says_why_nothing_can_be_built(code: str, reason: str, capsys: Captured):
    Path("plugins/odd.py").write_text(
        f"from abc import ABC, abstractmethod\n\nfrom busflow import Node\n\n\nclass Odd(Node, ABC):\n{code}\n"
    )
    assert main(["plugins", "info", "odd"]) == 2
    printed = capsys.readouterr().err
    assert f"odd cannot be built: {reason}" in printed
    assert "bug" not in printed


def test_json_holds_the_whole_info(capsys: Captured):
    Path("plugins/choosy.py").write_text(CHOOSY)
    assert main(["plugins", "info", "choosy", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    side, gain = answer["parameters"]
    assert (side["required"], side["choices"]) == (True, ["left", "right"])
    assert (gain["default"], gain["minimum"], gain["exclusive_minimum"], gain["maximum"]) == (1.0, 0, True, 10)
    assert answer["publishes"] == [{"topic": "/choosy/ready", "type": "std_msgs/msg/Bool"}]
    assert answer["serves"] == [{"service": "/choosy/reset", "type": "std_srvs/srv/Trigger"}]
    assert answer["calls"] == [{"service": "/other", "type": "std_srvs/srv/Trigger"}]
    assert answer["complete"] is False


def test_info_of_unknown_plugin_names_the_nearest(capsys: Captured):
    assert main(["plugins", "info", "taker"]) == 2
    assert "did you mean 'talker'?" in capsys.readouterr().err


@pytest.fixture
def unprivileged(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder of plugins beside talk.yaml that this user may not read, root included."""
    main(["check", "talk.yaml"])  # which imports what it takes, while it can be read
    with TemporaryDirectory() as folder:
        place = Path(folder)
        copytree(Path.cwd(), place, dirs_exist_ok=True)
        monkeypatch.chdir(place)
        place.chmod(0o755)
        (place / "plugins").chmod(0)
        if os.geteuid() == 0:
            os.seteuid(65534)
        try:
            yield place
        finally:
            os.seteuid(os.getuid())
            (place / "plugins").chmod(0o755)
            monkeypatch.undo()


def test_unreadable_plugin_folder_is_reported_once(unprivileged: Path, capsys: Captured):
    capsys.readouterr()
    assert main(["check", "talk.yaml"]) == 3
    assert capsys.readouterr().out == (
        "talk.yaml:2:11: error: cannot read the folder plugins: Permission denied\n"
        "  plugins: [plugins]\n            ^^^^^^^\n  fix: let it be read: chmod u+rx plugins\n1 error\n"
    )
    for command in (
        ["list"],
        ["list", "--json"],
        ["info", "talker"],
        ["list", "--folder", str(unprivileged / "plugins")],
    ):
        assert main(["plugins", *command]) == 2
        assert "Permission denied" in capsys.readouterr().err
