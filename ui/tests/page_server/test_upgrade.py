"""The released `busflow-ui` shows runs and recordings of this core; `tests/test_upgrade.py` says until when."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from busflow.errors import ExitCode
from tests.released import RELEASES, wheel
from ui.tests.page_server.test_page_server import get

RECORDINGS = Path(__file__).parents[3] / "tests/cases/recordings"
Show = Callable[..., Any]


@pytest.fixture(scope="module", params=RELEASES, ids=lambda release: release.name)
def released(request: pytest.FixtureRequest, show: Show, tmp_path_factory: pytest.TempPathFactory) -> tuple[Show, Path]:
    """A function that starts the released `busflow ui`, and the folder where that is installed."""
    folder = tmp_path_factory.mktemp("released")
    with wheel(request.param, "busflow_ui") as archive:
        archive.extractall(folder)
    own = {"PYTHONPATH": str(folder)}
    return lambda *arguments, environment: show(*arguments, environment=environment | own), folder


def test_released_page_shows_a_run(released: tuple[Show, Path], lab1: Any):
    start, folder = released
    shown = start(environment=lab1[0].environment)
    static = folder / "busflow_ui/page_server/static"
    for path, file in (("/", "index.html"), ("/app.js", "app.js")):
        status, _, body = get(f"{shown.url}{path}")
        assert (status, body) == (200, (static / file).read_bytes())
    page = shown.page()
    page.subscribe("/imu/data")
    assert page.message()["payload"]
    graph = page.answer("graph")
    assert {"/sensor_publisher", "/sensor_processor"} <= {each["name"] for each in graph["nodes"]}
    assert any("All sensors operational" in line["text"] for line in page.answer("log")["lines"])
    changed = page.answer("set_parameters", node="/sensor_publisher", values={"noise.imu": 0.25})["changed"]
    assert [each["new"] for each in changed] == [0.25]
    assert "+        imu: 0.25" in page.answer("save_parameters", dry_run=True)["edit"]
    for order in ("stop", "start"):
        page.answer("order", node="/sensor_publisher", order=order)
    assert "findings" in page.answer("health")
    code, _, errors = shown.end()
    assert code == ExitCode.INTERRUPTED
    assert "error" not in errors
    assert "Traceback" not in errors


def test_released_page_shows_a_recording(released: tuple[Show, Path], lab1: Any):
    start, _ = released
    file = RECORDINGS / "0.1.0/run.mcap"
    page = start(str(file), environment=lab1[0].environment).page()
    topics = {each["name"]: each for each in page.answer("graph")["topics"]}
    assert [each["node"] for each in topics["/total"]["publishers"]]
