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

WITNESS = '''
from busflow import Node, subscription
from busflow.msgs.rcl_interfaces import ParameterEvent
from busflow.msgs.std_msgs import Float64


class Witness(Node):
    """Says what the first balances are before and after a parameter has changed."""

    async def start(self) -> None:
        self.awaited = "from the start"

    @subscription("/parameter_events")
    def on_event(self, event: ParameterEvent) -> None:
        for parameter in event.changed_parameters:
            self.awaited = f"{parameter.name} = {parameter.value.double_value}"

    @subscription("balance_state")
    def on_balance(self, balance: Float64) -> None:
        if self.awaited:
            self.log.info("balance", after=self.awaited, steady=balance.data == 0.0)
            self.awaited = ""
'''


class Lab:
    """The lab without noise, in a process of its own, with a witness."""

    def __init__(self, folder: Path, runtime_dir: str) -> None:
        (folder / "plugins").mkdir()
        (folder / "plugins/witness.py").write_text(WITNESS)
        file = folder / "quiet.yaml"
        file.write_text(
            f"name: quiet\nplugins: [plugins]\ninclude: {CONFIGS}/lab1.yaml\nnodes:\n"
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
    with tempfile.TemporaryDirectory(prefix="busflow-") as runtime_dir:  # pytest's own is too long for a socket
        lab = Lab(tmp_path, runtime_dir)
        try:
            yield lab
        finally:
            lab.end()


def test_noise_from_another_terminal_acts_at_once(lab):
    assert "after=from the start steady=True" in lab.line_with("balance")
    done = lab.busflow("param", "set", "sensor_publisher", "noise.imu", "0.5")
    assert (done.returncode, done.stdout) == (0, "Set parameter successful\n")
    assert "after=noise.imu = 0.5 steady=False" in lab.line_with("balance")


def test_invalid_parameter_is_refused_and_value_kept(lab):
    lab.line_with("balance")
    for name, value, reason in (
        ("noise.imu", "11", "noise.imu must be at most 10, got 11"),
        ("noise.imu", "loud", "noise.imu must be a number, got text 'loud'"),
        ("noise.imo", "0.5", "unknown parameter noise.imo"),
    ):
        refused = lab.busflow("param", "set", "sensor_publisher", name, value)
        assert (refused.returncode, refused.stdout) == (1, "")
        assert reason in refused.stderr
        assert lab.busflow("param", "get", "sensor_publisher", "noise.imu").stdout == "Double value is: 0.0\n"


def test_service_call_from_another_terminal_resets_the_simulation(lab):
    lab.line_with("balance")
    done = lab.busflow("service", "call", "sensor_publisher/reset", "std_srvs/srv/Trigger")
    assert done.returncode == 0, done.stderr
    assert "std_srvs.srv.Trigger_Response(success=True, message='began anew after " in done.stdout
    assert "/sensor_publisher: the simulation begins anew after_s=" in lab.line_with("anew")
