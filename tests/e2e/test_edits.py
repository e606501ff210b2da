"""The real command follows its launch file: an edit is applied, a wrong one refused, and Ctrl-C ends it as ever."""

import json
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from busflow.cli import main

PLUGINS = Path(__file__).parents[2] / "plugins"
PATIENCE_S = 60.0
LAB = f"""plugins: [{PLUGINS}]
nodes:
  sensor_publisher:
    plugin: sensor_publisher
    parameters: {{rate_hz: 10}}
"""


def test_edit_is_applied_and_wrong_one_refused(tmp_path: Path):
    file, report = tmp_path / "lab.yaml", tmp_path / "report.json"
    file.write_text(LAB)
    options = ["--watch", "--no-inspect", "--log-format", "json", "-v", "--report", str(report)]
    command = [sys.executable, "-m", "busflow", "run", str(file), *options]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        patience = threading.Timer(PATIENCE_S, process.kill)
        patience.start()
        try:
            assert process.stderr is not None
            lines = (json.loads(line) for line in process.stderr if line.startswith("{"))

            def until(event: str) -> dict[str, str]:
                return next(line for line in lines if event in line["event"])

            until("watches the launch file")
            file.write_text(LAB.replace("10", "fast"))
            assert until("rate_hz must be a number")["at"] == f"{file}:5:27"
            until("the edited launch file is refused")
            file.write_text(LAB.replace("10", "50") + "  sensor_processor:\n    plugin: sensor_processor\n")
            followed = until("follows the edited launch file")
            assert (followed["set"], followed["started"]) == ("/sensor_publisher rate_hz", "/sensor_processor")
            process.send_signal(signal.SIGINT)
            assert process.wait() == 130
        finally:
            patience.cancel()
            process.kill()
    found = json.loads(report.read_text())
    assert [node["name"] for node in found["nodes"]] == ["/sensor_publisher", "/sensor_processor"]


@pytest.mark.parametrize("how", [["--sim"], []])
def test_a_simulated_run_cannot_be_watched(tmp_path: Path, how: list[str], capsys: pytest.CaptureFixture[str]):
    file = tmp_path / "lab.yaml"
    file.write_text(LAB if how else LAB + "clock: {mode: sim}\n")
    assert main(["run", str(file), "--watch", *how]) == 2
    assert "--watch" in capsys.readouterr().err
