"""`busflow plugins` lists plugins without importing them, and describes one."""

import os
from collections.abc import Iterator
from pathlib import Path
from shutil import copy, copytree
from tempfile import TemporaryDirectory

import pytest

from busflow.cli import main
from tests.cli.conftest import LABS, Shell

pytestmark = pytest.mark.usefixtures("project")


@pytest.mark.usefixtures("nothing_installed")
def test_names_and_summaries_are_listed(shell: Shell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    Path("plugins/broken.py").write_text("class (")
    assert shell("plugins list") == 0
    assert shell("plugins list --folder plugin") == 2
    first, listener, *_ = shell.data("plugins list --folder plugins")["plugins"]
    assert (first["name"], first["fault"] is None) == ("broken", False)
    assert listener == {
        "name": "listener",
        "summary": "Logs what it receives.",
        "file": "plugins/listener.py",
        "line": 5,
        "fault": None,
    }
    copy("plugins/talker.py", "plugins/player.py")
    assert shell("plugins list") == 0, "it replaces the built-in plugin of its name"
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    assert shell("plugins list") == 0


def test_info_shows_parameters_and_endpoints(shell: Shell):
    Path("plugins/bare.py").write_text("from busflow import Node\n\n\nclass Bare(Node): ...\n")
    copy(LABS / "plugins/choosy.py", "plugins")
    for name in ("talker", "bare", "choosy", "player"):
        assert shell(f"plugins info {name}") == 0
    assert shell("plugins info taker") == 2


@pytest.mark.parametrize(
    "code",
    [
        "    def __init__(self, *args, **kwargs):\n        raise OSError('no camera')",
        "    @abstractmethod\n    def take(self): ...",
    ],
    ids=["error", "abstract"],
)
def test_info_says_why_nothing_can_be_built(code: str, shell: Shell):
    Path("plugins/odd.py").write_text(
        f"from abc import ABC, abstractmethod\n\nfrom busflow import Node\n\n\nclass Odd(Node, ABC):\n{code}\n"
    )
    # Python's own words for an abstract class are others since 3.12.
    assert shell("plugins info odd", mask={"(abstract class Odd).*": r"\1 …"}) == 2


def test_json_holds_the_whole_info(shell: Shell):
    copy(LABS / "plugins/choosy.py", "plugins")
    answer = shell.data("plugins info choosy")
    side, gain = answer["parameters"]
    assert (side["required"], side["choices"]) == (True, ["left", "right"])
    assert (gain["default"], gain["minimum"], gain["exclusive_minimum"], gain["maximum"]) == (1.0, 0, True, 10)
    assert answer["publishes"] == [{"topic": "/choosy/ready", "type": "std_msgs/msg/Bool"}]
    assert answer["serves"] == [{"service": "/choosy/reset", "type": "std_srvs/srv/Trigger"}]
    assert answer["calls"] == [{"service": "/other", "type": "std_srvs/srv/Trigger"}]
    assert answer["complete"] is False


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


@pytest.mark.usefixtures("nothing_installed")
def test_unreadable_plugin_folder_is_reported_once(shell: Shell, unprivileged: Path):
    assert shell("check talk.yaml") == 3
    for command in ("list", "info talker", f"list --folder {unprivileged}/plugins"):
        assert shell(f"plugins {command}", mask={str(unprivileged): "FOLDER"}) == 2
    shell.text("plugins list --json", code=2)
