"""Commands of other distributions: discovery by entry points, import on use, and errors."""

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from busflow.cli import main
from tests.cli.conftest import LABS, Shell

Captured = pytest.CaptureFixture[str]
Install = Callable[..., Path]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """Return a function that installs a distribution of one module with commands."""
    monkeypatch.syspath_prepend(tmp_path)

    def install(distribution: str, *entry_points: str, source: str = "") -> Path:
        module = distribution.replace("-", "_")
        monkeypatch.delitem(sys.modules, module, raising=False)
        (tmp_path / f"{module}.py").write_text(source or (LABS / "lidar.py").read_text("utf-8"))
        metadata = tmp_path / f"{module}-1.0.dist-info"
        metadata.mkdir()
        (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 1.0\n")
        (metadata / "entry_points.txt").write_text("\n".join(["[busflow.commands]", *entry_points, ""]))
        return tmp_path

    return install


def test_command_is_imported_only_when_used(install: Install, shell: Shell):
    install("mine", "spin = mine:spin", "number = mine:number")
    lines = shell.text("--help").splitlines()
    place = next(number for number, line in enumerate(lines) if line.startswith("  new "))
    shell.note("\n".join(lines[place : place + 3]))
    assert "mine" not in sys.modules
    assert shell("spin --speed 10") == 3
    assert "mine" in sys.modules
    assert shell("spinn") == 2


@pytest.mark.usefixtures("lab")
def test_the_command_of_the_page_on_commands_works(install: Install, shell: Shell):
    page = (Path(__file__).parents[2] / "docs/commands.md").read_text("utf-8")
    source = re.findall(r"^```python.*?\n(.*?)^```", page, re.MULTILINE | re.DOTALL)[0]
    install("my-commands", "census = my_commands:census", source=source)
    assert "  census" in shell.text("--help")
    assert shell("census") == 0
    assert shell.data("census") == {"version": 1, "nodes": 2}


def test_a_command_of_its_own_imports_no_metadata(install: Install):
    site = install("mine", "spin = mine:spin")
    code = (
        "import sys; from busflow.cli import main; main(['plugins', 'info', '--help'])\n"
        "print([name for name in ('importlib.metadata', 'mine') if name in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=site)
    assert done.stderr == "[]\n"


def test_errors_of_a_command_are_those_of_busflow_or_bugs(install: Install, shell: Shell):
    install("mine", "stop = mine:stop", "fail = mine:fail")
    assert shell("stop") == 4
    assert shell("fail", mask={r"(?s)Traceback.*\n(?=KeyError)": "(traceback)\n"}) == 1


@pytest.mark.parametrize(
    "source",
    ["raise ValueError('no device')", "import sys; sys.exit(5)", "def f(:", "import no_such_module"],
    ids=["raises", "exits", "does not parse", "lacks a module"],
)
def test_unimportable_command_is_one_error(install: Install, shell: Shell, source: str):
    install("mine", "spin = mine:spin", source=source)
    assert shell("spin --help", mask={r"TMP_PATH/mine.py:1:\d+": "TMP_PATH/mine.py:1", r"(?m)^ +\^+$": "  ^^^"}) == 2
    assert shell.data("spin", code=2)["error"]["code"] == "command-import"


def test_traceback_shows_the_failing_import(install: Install, capsys: Captured):
    install("mine", "spin = mine:spin", source="raise ValueError('no device')")
    assert main(["--traceback", "spin"]) == 2
    err = capsys.readouterr().err
    assert "Traceback (most" in err
    assert "\nValueError: no device\n" in err


@pytest.mark.parametrize(("value", "code"), [("mine:none", "command-import"), ("mine:number", "no-command")])
def test_non_command_is_refused(install: Install, shell: Shell, value: str, code: str):
    install("mine", f"spin = {value}")
    assert shell("spin") == 2
    assert shell.data("spin", code=2)["error"]["code"] == code


def warnings(shell: Shell) -> str:
    """The end of the help: the warnings about commands of distributions, on one line each."""
    _, found, rest = shell.text("--help").partition("warning:")
    return " ".join((found + rest).split())


def test_a_verb_that_two_distributions_offer_is_refused(install: Install, shell: Shell):
    for name in ("yours", "mine"):
        install(name, f"spin = {name}:spin")
    assert shell("spin") == 2
    refusal = " ".join(shell.err.split()).replace(" fix:", "; fix:")
    assert refusal in " ".join(shell.text("--help").split())
    assert shell.data("spin", code=2)["error"]["code"] == "command-ambiguous"
    assert not {"mine", "yours"} & sys.modules.keys()


@pytest.mark.usefixtures("place")
def test_no_distribution_replaces_a_command_of_busflow(install: Install, shell: Shell):
    install("mine", "plugins = mine:spin", "spin = mine:spin")
    assert "plugins" in shell.data("plugins list")
    assert "mine" not in sys.modules
    shell.note(warnings(shell))
    assert [each["code"] for each in shell.data("doctor", code=3)["findings"]] == ["command-shadowed"]


def test_verbs_and_options_are_completed(install: Install, completed: Callable[[str], list[str]]):
    install("mine", "spin = mine:spin")
    assert completed("s") == ["service", "schema", "spin"]
    assert "mine" not in sys.modules, "a verb is completed without importing any"
    assert completed("spin --s") == ["--speed"]


def test_unimportable_command_completes_to_nothing(install: Install, completed: Callable[[str], list[str]]):
    install("mine", "spin = mine:spin", source="raise ValueError('no device')")
    assert "spin" in completed("s")
    assert "--speed" not in completed("spin --s")


def test_missing_distribution_is_named_with_its_installation(shell: Shell, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("busflow.cli.root.entry_points", lambda _group: ())  # busflow-ui may be installed here
    assert shell("foxglove --port 0") == 2
    assert shell.data("foxglove", code=2)["error"]["code"] == "command-missing"
