"""Tests of `__init__.py`: usage errors, failures, signals and closed pipes; and of what commands import."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import click
import pytest

import busflow
from busflow.cli import _APART, _COMMANDS, main
from busflow.cli.root import Root
from tests.cli.conftest import Shell
from tests.extras import FAILS_IN_ASCII

BUFFERED = os.environ | {"PYTHONUNBUFFERED": ""}
"""The environment of a command with the usual buffered output."""
BUSFLOW = [sys.executable, "-c", "import sys; from busflow.cli import main; sys.exit(main())"]

BAG = Path(__file__).parents[1] / "cases/rosbag2/talker/talker.mcap"
HEAVY = ("pydantic", "numpy", "asyncio", "rich", "anyio", "yaml")
IMPORTS = (
    "import sys, busflow.cli\n"
    "for command in sys.argv[2:]:\n"
    "    code = busflow.cli.main(command.split())\n"
    "    imported = [name for name in sys.argv[1].split(',') if name in sys.modules]\n"
    "    print('\\0', end='', flush=True)\n"
    "    print(f'busflow {command}: exit code {code}, imported {imported}', file=sys.stderr)\n"
)
"""Calls commands one after another, and says after each of them which modules there are; NUL ends what one prints."""

Captured = pytest.CaptureFixture[str]


def in_one_process(
    *commands: str, heavy: Sequence[str] = HEAVY, environment: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Call commands in a process; standard error says after each its exit code, and which heavy modules there are."""
    call = [sys.executable, "-c", IMPORTS, ",".join(heavy), *commands]
    return subprocess.run(call, capture_output=True, encoding="utf-8", env=environment)


@pytest.fixture
def broken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A plugin that does not import, so that `plugins info broken` fails."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plugins").mkdir()
    (tmp_path / "plugins/broken.py").write_text("raise ValueError('\\x1b[31mred')\n")


def test_without_a_command_the_help_is_shown(shell: Shell):
    for words in ("", "plugins"):
        assert shell.text(words) == shell.text(f"{words} --help")


def commands(group: click.Group, context: click.Context) -> Iterator[tuple[click.Command, click.Context]]:
    """Every command below a group, with its context, whose terminal is 80 characters wide."""
    for verb in group.list_commands(context):
        if verb not in _APART and (command := group.get_command(context, verb)):
            below = click.Context(command, context, verb, terminal_width=80)
            yield command, below
            yield from commands(command, below) if isinstance(command, click.Group) else ()


def test_help_has_examples_and_breaks_no_word():
    root = Root(_COMMANDS, _APART, help="")
    names = ["-h", "--help"]  # as in `main`: a command keeps its first option for help, for all later tests
    for command, context in commands(root, click.Context(root, info_name="busflow", help_option_names=names)):
        shown = command.get_help(context)
        assert re.search(r"Examples?:\n", shown), context.command_path
        texts = [each.help or "" for each in command.params if isinstance(each, click.Option) and not each.hidden]
        assert {word for text in texts for word in text.split()} - set(shown.split()) == set(), context.command_path


@pytest.mark.usefixtures("project")
@pytest.mark.parametrize("line", ["check talk.yaml", "config talk.yaml", "plugins info talker", "test talk.yaml"])
def test_json_says_of_which_version_it_is(line: str, shell: Shell):
    assert shell.data(line)["version"] == 1


def test_the_version_is_the_packages(capsys: Captured):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"busflow {busflow.__version__}\n"


WRONG = """\
rnu
plugins lst
plugins list --jsno
plugins info
topic --run x list
topic pub cmd std_msgs/msg/Float64 data: 1.0
topic echo imu --qos-reliability best_effort
run
run x.yaml --fro 5s
run x.yaml --rate-hz 5
run x.yaml --for soon
run x.yaml --seed many
run demo.launch.py
run robot.xml
check run.mcap
replay lab1.yaml run.mcap
replay run.mcap lab1.yaml --plugin imu
--traceback
bag convert a b"""


@pytest.mark.parametrize("line", WRONG.splitlines())
def test_wrong_usage_is_answered_with_a_fix(shell: Shell, line: str):
    assert shell(line) == 2
    assert (shell.out, "Usage: busflow" in shell.err) == ("", True)


@FAILS_IN_ASCII
def test_user_input_is_escaped(capsys: Captured, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.delenv("TERM", raising=False)
    for arguments in (["\x1b[31m"], ["--\x1b[31m"], ["new", "\x1b[31m"], ["run", "\x1b[31m"], ["new", "a\x9b31m"]):
        assert main(arguments) == 2
    assert "\x1b[31m\x1b[1merror\x1b[0m:" in capsys.readouterr().err.replace("\x1b[1m\x1b[31m", "\x1b[31m\x1b[1m")


@pytest.mark.usefixtures("broken")
class TestFailure:
    def test_error_is_one_block_with_its_exit_code(self, shell: Shell):
        assert shell("plugins info broken") == 2

    def test_the_traceback_is_shown_on_request(self, capsys: Captured, monkeypatch: pytest.MonkeyPatch):
        monkeypatch.setenv("FORCE_COLOR", "1")  # else click itself takes escape sequences out
        assert main(["--traceback", "plugins", "info", "broken"]) == 2
        err = capsys.readouterr().err
        assert "Traceback (most" in err
        assert r"ValueError: \x1b[31mred" in err
        assert "\x1b[31mred" not in err

    @pytest.mark.parametrize(
        ("variables", "coloured"),
        [({"FORCE_COLOR": "1"}, True), ({}, False), ({"FORCE_COLOR": "1", "NO_COLOR": "1"}, False)],
    )
    def test_colour_follows_the_environment(
        self, capsys: Captured, monkeypatch: pytest.MonkeyPatch, variables: dict[str, str], coloured: bool
    ):
        for name in ("NO_COLOR", "FORCE_COLOR", "TERM"):
            monkeypatch.delenv(name, raising=False)
        for name, value in variables.items():
            monkeypatch.setenv(name, value)
        main(["plugins", "info", "broken"])
        assert ("\x1b[" in capsys.readouterr().err) is coloured

    def test_ctrl_c_is_130_without_a_traceback(self):
        Path("plugins/slow.py").write_text("import signal\nsignal.raise_signal(signal.SIGINT)\n")
        done = subprocess.run([*BUSFLOW, "plugins", "info", "slow"], capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (130, "")


def test_exit_closes_garbage_without_interpreter_teardown():
    code = (
        "import gc, sys; from busflow.cli import main; gc.disable()\n"
        "class Circle:\n"
        "    def __init__(self, name): self.name, self.itself = name, self\n"
        "    def __del__(self): print(self.name)\n"
        "left, kept = Circle('left'), Circle('kept')\n"
        "del left\n"
        "sys.exit(main())"
    )
    done = subprocess.run([sys.executable, "-c", code, "--version"], capture_output=True, text=True)
    assert done.stdout.splitlines()[1:] == ["left"]


UNWRITABLE = {
    "--help >&0": 0,
    "plugins list --json >&0 2>&0": 0,
    "check none.yaml >&0": 3,
    "rnu 2>&0": 2,
    "run none.yaml >&0 2>&0": 2,
    "--version >&-": 0,
    "rnu 2>&-": 2,
    "run none.yaml >&- 2>&-": 2,
    "rnu 2>/dev/full": 2,
    "--help >/dev/full 2>/dev/full": 1,
}
"""Commands with streams that cannot be written, and their exit codes; 0 is a pipe whose reader has gone."""


@pytest.mark.parametrize("command", UNWRITABLE)
def test_unwritable_streams_leave_the_exit_code(command: str):
    reader, writer = os.pipe()
    os.close(reader)
    line = f"exec {sys.executable} -m busflow {command}"
    done = subprocess.run(line, shell=True, stdin=writer, stderr=subprocess.PIPE, env=BUFFERED)  # noqa: S602  # a shell closes them
    os.close(writer)
    assert (done.returncode, done.stderr) == (UNWRITABLE[command], b"")


def test_full_disk_is_reported(shell: Shell):
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([*BUSFLOW, "--help"], stdout=full, stderr=subprocess.PIPE, text=True, env=BUFFERED)
    assert done.returncode == 1
    shell.note(done.stderr)


RUN_NOTHING = (
    "",
    "--help",
    "--version",
    "plugins list",
    "plugins list --json",
    "plugins info --help",
    "run --help",
    "check --help",
    "config --help",
    "graph --help",
    "schema --help",
    "new --help",
    "node --help",
    "node list --help",
    "param --help",
    "ps --help",
    "log --help",
    "doctor --help",
    "interface show sensor_msgs/msg/Imu",
    "completion zsh",
    "topic --help",
    "topic echo --help",
    "topic pub --help",
)
ONLY_LOOK = (
    "ps",
    "graph",
    "log --node processor",
    "interface list",
    "node list",
    "node list -v",
    "node info processor",
    "param list",
    "param get imu_publisher rate_hz",
    "topic list",
    "topic info -v imu/data",
    "topic echo --once imu/data --filter linear_acceleration.z>-99",
    "topic hz imu/data -n 1 --every 0.2",
    "topic bw imu/data -n 1 --every 0.2",
    "topic stats",
)


@pytest.mark.parametrize("commands", [RUN_NOTHING, ONLY_LOOK], ids=["run nothing", "only look"])
def test_commands_import_nothing_heavy(imu_lab: Any, commands: tuple[str, ...]):
    done = in_one_process(*commands, environment=imu_lab.environment)
    said = [line for line in done.stderr.splitlines() if line.startswith("busflow ")]
    assert said == [f"busflow {command}: exit code 0, imported []" for command in commands], done.stderr
    silent = {command for command, text in zip(commands, done.stdout.split("\0")[:-1], strict=True) if not text}
    assert all("--every" in command for command in silent)  # what comes in so short a time is no promise
