"""The lab steered by the real commands while it runs: its noise is turned, and its simulation begins anew."""

import os
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import pytest

pytestmark = pytest.mark.e2e

CONFIGS = Path(__file__).parents[2] / "configs"
PATIENCE_S = 60.0
"""How long to wait for what must come, on however slow a machine; no measure of busflow."""

NODES = Path(__file__).parents[1] / "nodes"


class Lab:
    """The lab without noise, in a process of its own, with a witness."""

    def __init__(self, folder: Path, runtime_dir: str) -> None:
        file = folder / "quiet.yaml"
        file.write_text(
            f"name: quiet\nplugins: [{NODES}]\ninclude: {CONFIGS}/lab1.yaml\nnodes:\n"
            "  sensor_publisher: {parameters: {noise: {imu: 0.0}}}\n  witness: {plugin: witness}\n"
        )
        self.environment = {**os.environ, "BUSFLOW_RUNTIME_DIR": runtime_dir}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "busflow", "run", str(file)],
            env=self.environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.patience = threading.Timer(PATIENCE_S, self.process.kill)
        self.patience.start()

    def line_with(self, text: str) -> str:
        """The next line of the log that has this text."""
        return next((line for line in self.process.stderr if text in line), f"the run ended without {text!r}")

    def busflow(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "busflow", *arguments]
        return subprocess.run(command, env=self.environment, capture_output=True, text=True, timeout=PATIENCE_S)

    def end(self) -> None:
        self.process.terminate()
        self.process.communicate()
        self.patience.cancel()


@pytest.fixture
def lab(tmp_path):
    with tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as runtime_dir:  # pytest's own is too long for a socket
        lab = Lab(tmp_path, runtime_dir)
        try:
            yield lab
        finally:
            lab.end()


def test_commands_of_another_terminal_act_at_once(lab):
    assert "after=start steady=True" in lab.line_with("balance")
    done = lab.busflow("param", "set", "sensor_publisher", "noise.imu", "0.5")
    assert (done.returncode, done.stdout) == (0, "Set parameter successful\n")
    assert "after=noise.imu = 0.5 steady=False" in lab.line_with("balance")
    assert lab.busflow("param", "set", "sensor_publisher", "noise.imu", "11").returncode == 1
    assert lab.busflow("param", "get", "sensor_publisher", "noise.imu").stdout == "Double value is: 0.5\n"
    done = lab.busflow("service", "call", "sensor_publisher/reset", "std_srvs/srv/Trigger")
    assert done.returncode == 0, done.stderr
    assert "success=True" in done.stdout
    assert "/sensor_publisher: " in lab.line_with("after_s=")
