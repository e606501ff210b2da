"""The real command follows its launch file: an edit is applied, a wrong one refused, and Ctrl-C ends it as ever."""

from pathlib import Path

import pytest

from busflow.cli import main
from tests.processes.conftest import project, start

__all__ = ["project", "start"]

NODES = Path(__file__).parents[1] / "nodes"
LAB = """nodes:
  source:
    plugin: source
    parameters: {rate_hz: 10}
"""


def test_edit_is_applied_and_wrong_one_refused(start, project):
    run = start(LAB, "--watch", "--no-inspect", "-v")
    run.wait_for("watches the launch file")
    file = project / "run.yaml"
    text = file.read_text()
    file.write_text(text.replace("10", "fast"))
    run.wait_for("rate_hz must be a number", "run.yaml:6:27")
    run.wait_for("the edited launch file is refused")
    file.write_text(text.replace("10", "50") + "  sink:\n    plugin: sink\n")
    run.wait_for("follows the edited launch file", '"set": "/source rate_hz"', '"started": "/sink"')
    assert run.end() == 130
    assert [node["name"] for node in run.report()["nodes"]] == ["/source", "/sink"]


@pytest.mark.parametrize("how", [["--sim"], []])
def test_a_simulated_run_cannot_be_watched(tmp_path: Path, how: list[str], capsys: pytest.CaptureFixture[str]):
    file = tmp_path / "lab.yaml"
    file.write_text(f"plugins: [{NODES}]\n{LAB}" + ("" if how else "clock: {mode: sim}\n"))
    assert main(["run", str(file), "--watch", *how]) == 2
    assert "--watch" in capsys.readouterr().err
