"""The released `busflow-assistant` answers in a run of this core; `tests/test_upgrade.py` says until when."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from busflow.cli import main
from tests.cli.conftest import LiveRun, Place
from tests.released import RELEASES, wheel

PAGE = Path(__file__).parent / "pages/lab1.md"


@pytest.mark.parametrize("release", RELEASES, ids=lambda release: release.name)
def test_released_assistant_answers(
    release: Path,
    tmp_path: Path,
    place: Place,
    start_run: Callable[..., LiveRun],
    capsys: pytest.CaptureFixture[str],
):
    with wheel(release, "busflow_assistant") as archive:
        archive.extractall(tmp_path)
    place.environment |= {"PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": ""}
    run = start_run(release, "configs/textbook.yaml", f"pages:={json.dumps([str(PAGE)])}")
    run.wait_for("All sensors operational")
    assert (tmp_path / "busflow_assistant/__pycache__").is_dir()  # the run has imported this one

    def answer(*command: str) -> Any:
        assert main([*command, "--json"]) == 0
        return json.loads(capsys.readouterr().out)

    asked = json.dumps({"question": "What does the sensor processor node do?", "page": "lab1.md"})
    given = answer("service", "call", "/assistant/ask", "busflow_assistant/srv/AskText", asked)["response"]
    assert (given["answered"], given["scope"]) == (True, "page")
    assert all(each["text"] in PAGE.read_text("utf-8") for each in given["citations"])
