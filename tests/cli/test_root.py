"""Commands of other distributions: discovery by entry points, import on use, and errors."""

import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from busflow.cli import main

Captured = pytest.CaptureFixture[str]
Install = Callable[..., Path]

LIDAR = '''
"""Commands of a lidar."""

import sys

import click

from busflow.errors import NoSuchTarget


@click.command()
@click.option("--speed", type=int, default=1)
def spin(speed: int) -> int:
    """Spin the lidar.

    As fast as it goes.
    """
    click.echo(f"spins at {speed}")
    return 3 if speed > 9 else 0


@click.command()
def stop() -> None:
    raise NoSuchTarget("there is no lidar")


@click.command()
def fail() -> None:
    raise KeyError("a mistake")


number = 5
'''

ANEW = "reinstall it, or remove it: pip uninstall mine"


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """Return a function that installs a distribution of one module with commands."""
    monkeypatch.syspath_prepend(tmp_path)

    def install(distribution: str, *entry_points: str, source: str = LIDAR) -> Path:
        module = distribution.replace("-", "_")
        monkeypatch.delitem(sys.modules, module, raising=False)
        (tmp_path / f"{module}.py").write_text(source)
        metadata = tmp_path / f"{module}-1.0.dist-info"
        metadata.mkdir()
        (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 1.0\n")
        (metadata / "entry_points.txt").write_text("\n".join(["[busflow.commands]", *entry_points, ""]))
        return tmp_path

    return install


def test_command_is_imported_only_when_used(install: Install, capsys: Captured):
    install("mine", "spin = mine:spin", "number = mine:number")
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    assert re.search(
        r"new +Make a small project .*\n  number +A command of mine 1\.0\.\n  spin +Spin the lidar\.\n", out
    )
    assert "mine" not in sys.modules
    assert main(["spin", "--speed", "10"]) == 3
    assert capsys.readouterr().out == "spins at 10\n"
    assert "mine" in sys.modules


@pytest.mark.usefixtures("lab")
def test_the_command_of_the_page_on_commands_works(install: Install, capsys: Captured):
    page = (Path(__file__).parents[2] / "docs/commands.md").read_text("utf-8")
    source = re.findall(r"^```python.*?\n(.*?)^```", page, re.MULTILINE | re.DOTALL)[0]
    install("my-commands", "census = my_commands:census", source=source)
    assert main(["--help"]) == 0
    assert re.search(r"^  census +Count the nodes of a running graph\.$", capsys.readouterr().out, re.MULTILINE)
    assert main(["census"]) == 0
    assert main(["census", "--json"]) == 0
    plain, *as_json = capsys.readouterr().out.splitlines()
    assert (plain, json.loads("\n".join(as_json))) == ("2 nodes", {"version": 1, "nodes": 2})


def test_a_command_of_its_own_imports_no_metadata(install: Install):
    site = install("mine", "spin = mine:spin")
    code = (
        "import sys; from busflow.cli import main; main(['plugins', 'info', '--help'])\n"
        "print([name for name in ('importlib.metadata', 'mine') if name in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=site)
    assert done.stderr == "[]\n"


def test_misspelt_verb_is_compared_with_installed_commands(install: Install, capsys: Captured):
    install("mine", "spin = mine:spin")
    assert main(["spinn"]) == 2
    assert "there is no command 'spinn': did you mean 'spin'?" in capsys.readouterr().err


def test_busflow_error_of_a_command_is_printed(install: Install, capsys: Captured):
    install("mine", "stop = mine:stop")
    assert main(["stop"]) == 4
    assert capsys.readouterr().err == "error: there is no lidar\n"


def test_bug_names_the_distribution_of_the_command(install: Install, capsys: Captured):
    install("mine", "fail = mine:fail")
    assert main(["fail"]) == 1
    assert capsys.readouterr().err.splitlines()[-2:] == [
        "KeyError: 'a mistake'",
        "error: this is a bug in mine 1.0; please report it with the lines above",
    ]


@pytest.mark.parametrize(
    ("source", "expected", "fix"),
    [
        (
            "raise ValueError('no device')",
            "ValueError: no device",
            ANEW,
        ),
        ("import sys; sys.exit(5)", "SystemExit: 5", ANEW),
        ("def f(:", "SyntaxError: invalid syntax", ANEW),
        (
            "import no_such_module",
            "ModuleNotFoundError: No module named 'no_such_module'",
            f"install what provides 'no_such_module' into the environment {sys.prefix}",
        ),
    ],
)
def test_unimportable_command_is_one_error(install: Install, capsys: Captured, source: str, expected: str, fix: str):
    site = install("mine", "spin = mine:spin", source=source)
    assert main(["spin", "--help"]) == 2
    first, *_, last = capsys.readouterr().err.splitlines()
    place, _, message = first.partition(" error: ")
    assert re.fullmatch(rf"{re.escape(str(site))}/mine\.py:1:\d+:", place)
    where = "mine 1.0 (entry point busflow.commands: spin = mine:spin)"
    assert message == f"busflow spin cannot be imported from {where}: {expected}"
    assert last == f"  fix: {fix}"


def test_traceback_shows_the_failing_import(install: Install, capsys: Captured):
    install("mine", "spin = mine:spin", source="raise ValueError('no device')")
    assert main(["--traceback", "spin"]) == 2
    err = capsys.readouterr().err
    assert "Traceback (most recent call last)" in err
    assert "\nValueError: no device\n" in err


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (
            "mine:none",
            "busflow spin cannot be imported from mine 1.0 (entry point busflow.commands: spin = mine:none): ",
        ),
        ("mine:number", "mine 1.0 (entry point busflow.commands: spin = mine:number) is not a click command"),
    ],
)
def test_non_command_is_refused(install: Install, capsys: Captured, value: str, expected: str):
    install("mine", f"spin = {value}")
    assert main(["spin"]) == 2
    assert expected in capsys.readouterr().err


def test_a_verb_that_two_distributions_offer_is_refused(install: Install, capsys: Captured):
    for name in ("yours", "mine"):
        install(name, f"spin = {name}:spin")
    assert main(["spin"]) == 2
    refusal = [
        "error: busflow spin is offered more than once, by mine 1.0 (mine:spin) and yours 1.0 (yours:spin)",
        "  fix: keep one: pip uninstall yours",
    ]
    assert capsys.readouterr().err.splitlines() == refusal
    assert main(["--help"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert " ".join(" ".join(refusal).split()).replace(" fix:", "; fix:") in shown
    assert not {"mine", "yours"} & sys.modules.keys()


def test_no_distribution_replaces_a_command_of_busflow(install: Install, capsys: Captured):
    install("mine", "plugins = mine:spin")
    assert main(["plugins", "list", "--json"]) == 0
    assert '"plugins"' in capsys.readouterr().out
    assert "mine" not in sys.modules
    assert main(["--help"]) == 0
    message = (
        "warning: the command plugins of mine 1.0 is not used: busflow has one of this name; fix: pip uninstall mine"
    )
    assert message in " ".join(capsys.readouterr().out.split())


@pytest.mark.usefixtures("place")
def test_the_doctor_finds_commands_that_cannot_be_used(install: Install, capsys: Captured):
    install("mine", "plugins = mine:spin", "spin = mine:spin")
    assert main(["doctor"]) == 3
    assert "warning: the command plugins of mine 1.0 is not used" in capsys.readouterr().out


class TestCompletion:
    @staticmethod
    def completed(capsys: Captured, monkeypatch: pytest.MonkeyPatch, words: str) -> list[str]:
        monkeypatch.setenv("_BUSFLOW_COMPLETE", "bash_complete")
        monkeypatch.setenv("COMP_WORDS", f"busflow {words}")
        monkeypatch.setenv("COMP_CWORD", str(len(words.split(" "))))
        main([])
        captured = capsys.readouterr()
        assert captured.err == ""
        return [line.partition(",")[2] for line in captured.out.splitlines()]

    def test_a_verb_is_completed_without_importing_any(
        self, install: Install, capsys: Captured, monkeypatch: pytest.MonkeyPatch
    ):
        install("mine", "spin = mine:spin")
        assert self.completed(capsys, monkeypatch, "s") == ["service", "schema", "spin"]
        assert "mine" not in sys.modules

    def test_an_option_of_an_installed_command_is_completed(
        self, install: Install, capsys: Captured, monkeypatch: pytest.MonkeyPatch
    ):
        install("mine", "spin = mine:spin")
        assert self.completed(capsys, monkeypatch, "spin --s") == ["--speed"]

    def test_unimportable_command_completes_to_nothing(
        self, install: Install, capsys: Captured, monkeypatch: pytest.MonkeyPatch
    ):
        install("mine", "spin = mine:spin", source="raise ValueError('no device')")
        assert "spin" in self.completed(capsys, monkeypatch, "s")
        assert "--speed" not in self.completed(capsys, monkeypatch, "spin --s")


def test_missing_distribution_is_named_with_its_installation(capsys: Captured, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("busflow.cli.root.entry_points", lambda _group: ())  # busflow-ui may be installed here
    assert main(["foxglove", "--port", "0"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.splitlines() == [
        "error: busflow foxglove is a command of busflow-ui, which is not installed here",
        "  fix: in a clone of busflow: pip install . ./ui",
    ]
