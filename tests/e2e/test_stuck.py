"""A handler that never returns, on virtual time: it is named, and Ctrl-C ends the test or the trial with its line."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from busflow.errors import ExitCode
from busflow.timeouts import VARIABLE

pytestmark = pytest.mark.e2e

NODES = Path(__file__).parents[1] / "nodes"
LAUNCH = f"name: stuck\nplugins: [{NODES}]\nnodes: {{stuck: {{plugin: stuck}}}}\n"
TEST = """
from busflow.testing import harness, virtual_time


def test_that_fails() -> None:
    raise AssertionError("shown all the same")


@virtual_time
async def test_that_never_ends() -> None:
    async with harness("stuck.yaml") as lab:
        await lab.advance(1)
"""
COMMANDS = {
    "pytest": "import pytest, sys; sys.exit(pytest.main(['-q', '-p', 'no:cacheprovider', 'test_stuck.py']))",
    "busflow test": "import sys; from busflow.cli import main; sys.exit(main(['test', 'stuck.yaml']))",
    "busflow run": (
        "import sys; from busflow.cli import main; sys.exit(main(['run', '--sim', 'stuck.yaml', '--report', 'r.json']))"
    ),
}


@pytest.mark.timeout(120)
@pytest.mark.long
@pytest.mark.parametrize("command", COMMANDS)
def test_handler_without_end_is_named_and_ended(command, tmp_path):
    (tmp_path / "stuck.yaml").write_text(LAUNCH)
    (tmp_path / "test_stuck.py").write_text(TEST)
    environment = {**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTEST_PLUGINS": "busflow.testing.plugin"}
    environment[VARIABLE] = "stuck_warning=0.1"
    environment.pop("PYTEST_ADDOPTS", None)
    with subprocess.Popen(
        [sys.executable, "-c", COMMANDS[command]],
        cwd=tmp_path,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stderr is not None
        named = next((line for line in process.stderr if "has not come back" in line), "")
        process.send_signal(signal.SIGINT)
        printed, log = process.communicate(timeout=100)
    assert named.startswith("busflow: /stuck: timer work ")
    assert " 0.1 s " in named
    assert "nodes/stuck.py:" in named
    assert "did not end" in log
    assert f"{NODES}/stuck.py:" in log
    if command == "pytest":
        assert process.returncode == pytest.ExitCode.INTERRUPTED
        assert "AssertionError: shown" in printed  # the failure of another test
        assert ": KeyboardInterrupt\n" in printed
    else:
        assert process.returncode == ExitCode.INTERRUPTED
    if command == "busflow run":
        assert json.loads((tmp_path / "r.json").read_text())["exit_code"] == ExitCode.INTERRUPTED
