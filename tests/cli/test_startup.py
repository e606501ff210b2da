"""The command line starts without importing what it does not need."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

BAG = Path(__file__).parents[1] / "cases/rosbag2/talker/talker.mcap"
HEAVY = ("pydantic", "numpy", "structlog", "asyncio", "rich", "anyio", "yaml")
IMPORTS = (
    "import sys, busflow.cli\n"
    "code = busflow.cli.main(sys.argv[2:])\n"
    "print('imported:', [name for name in sys.argv[1].split(',') if name in sys.modules], file=sys.stderr)\n"
    "sys.exit(code)"
)


@pytest.mark.parametrize(
    "command",
    [
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
    ],
)
def test_a_command_that_runs_nothing_imports_nothing_heavy(command: str):
    done = subprocess.run(
        [sys.executable, "-c", IMPORTS, ",".join(HEAVY), *command.split()], capture_output=True, text=True
    )
    assert done.stderr.splitlines()[-1] == "imported: []"
    assert done.returncode == 0
    assert done.stdout


@pytest.mark.parametrize(
    "command",
    [
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
    ],
)
def test_a_command_that_only_looks_imports_nothing_heavy(imu_lab: Any, command: str):
    done = subprocess.run(
        [sys.executable, "-c", IMPORTS, ",".join(HEAVY), *command.split()],
        capture_output=True,
        text=True,
        env=imu_lab.environment,
    )
    assert done.stderr.splitlines()[-1] == "imported: []"
    assert done.returncode == 0
    assert done.stdout
