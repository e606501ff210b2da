"""The page of `busflow ui` in a browser, while the project's lab runs with a node that loses messages."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from ui.tests.browser.conftest import AXE, MARKUP, PATIENCE_MS, Stage
from ui.tests.page_server.conftest import Shown

Keep = Callable[[Any, str], None]


def text_of(stage: Stage, selector: str) -> str:
    return stage.page.locator(selector).first.inner_text()


def parameter(stage: Stage, node: str, *arguments: str) -> str:
    """What the command says of a parameter of the run."""
    command = [sys.executable, "-P", "-m", "busflow", "param", *arguments[:1], node, *arguments[1:]]
    done = subprocess.run(command, env=stage.place.environment, capture_output=True, text=True, check=True)
    return done.stdout


def test_the_graph_appears(stage: Stage, screenshot: Keep, capsys: pytest.CaptureFixture[str]):
    page = stage.page
    page.wait_for_selector('[data-vertex="node /sensor_publisher"]')
    begun = time.perf_counter()  # a new page has a cache of its own, which is empty
    with closing(stage.opened(stage.shown)) as again:
        again.wait_for_selector('[data-vertex="node /sensor_publisher"]')
        took_s = time.perf_counter() - begun
    with capsys.disabled():
        sys.stdout.write(f"\nthe graph appears after {took_s * 1000:.0f} ms (aim: 500 ms on a quiet machine)\n")
    for vertex in ("node /sensor_processor", "topic /imu/data", "topic /joint_states", "topic /stability_index"):
        assert page.locator(f'[data-vertex="{vertex}"]').count() == 1
    assert "token" not in page.url
    page.wait_for_selector('[data-edge="deliver /sensor_processor /imu/data"].flowing')
    screenshot(page, "graph")


def test_a_planted_drop_turns_an_edge_red(stage: Stage, screenshot: Keep):
    edge = '[data-edge="deliver /odd /odd/burst"]'
    stage.page.wait_for_selector(f"{edge}.flowing")
    parameter(stage, "odd", "set", "burst", "20")
    stage.page.wait_for_selector(f"{edge}.dropping")
    line = stage.page.locator(f"{edge}.dropping .line")
    assert line.evaluate("each => getComputedStyle(each).strokeDasharray") != "none", "not by colour alone"
    stage.page.locator(edge).dispatch_event("click")
    stage.page.wait_for_selector("text=overflow")
    stage.page.locator(".details .tree-row").first.wait_for()  # the last message, for the picture
    screenshot(stage.page, "drops")
    stage.page.keyboard.press("Escape")
    parameter(stage, "odd", "set", "burst", "1")


def test_a_parameter_set_here_arrives_there(stage: Stage, screenshot: Keep):
    stage.view("Parameters")
    card = stage.page.get_by_label("Parameters of /sensor_publisher")
    field = card.locator(".parameter", has_text="imu").locator("input.field").first
    field.fill("0.5")
    field.press("Enter")
    stage.page.wait_for_selector(".parameter.differs")
    assert "0.5" in parameter(stage, "sensor_publisher", "get", "noise.imu")
    screenshot(stage.page, "parameters")


def test_a_refused_parameter_shows_its_reason(stage: Stage):
    stage.view("Parameters")
    card = stage.page.get_by_label("Parameters of /sensor_publisher")
    field = card.locator(".parameter", has_text="imu").locator("input.field").first
    field.fill("-3")
    field.press("Enter")
    stage.page.wait_for_selector(".parameter-reason")
    assert "at least 0" in text_of(stage, ".parameter-reason")
    assert "0.5" in parameter(stage, "sensor_publisher", "get", "noise.imu")
    field.press("Escape")


def test_the_reset_service_is_called(stage: Stage, screenshot: Keep):
    stage.view("Services")
    stage.page.locator(".chooser-list button", has_text="/sensor_publisher/reset").click()
    stage.page.get_by_role("button", name="Call", exact=True).click()
    stage.page.wait_for_selector(".answer")
    assert "began anew after" in text_of(stage, ".answer")
    screenshot(stage.page, "services")


def test_the_log_has_markup_as_text(stage: Stage, screenshot: Keep):
    stage.view("Log")
    line = stage.page.locator(".log-text", has_text="<img src=x")
    line.first.wait_for()
    assert MARKUP.partition("\u202e")[0].strip() in line.first.inner_text()
    assert stage.page.locator("main img").count() == 0
    assert stage.page.locator("main b").count() == 0
    screenshot(stage.page, "log")
    stage.view("Parameters")
    stage.page.get_by_label("Parameters of /odd").wait_for()
    assert stage.page.locator("main img").count() == 0
    assert stage.page.title() != "1"


def test_findings_come_with_their_fixes(stage: Stage, screenshot: Keep):
    stage.view("Health")
    stage.page.wait_for_selector(".finding:has-text('/odd dropped')")
    assert "Fix: " in text_of(stage, ".findings")
    screenshot(stage.page, "health")


@pytest.mark.parametrize(
    ("theme", "rules"),
    [("light", "{}"), ("dark", "{runOnly: ['color-contrast']}")],  # nothing but the colours differs
)
def test_every_view_is_accessible(stage: Stage, theme: str, rules: str):
    if not AXE.is_file():
        assert not os.environ.get("CI"), "run npm ci in ui/page first"
        pytest.skip("axe-core is not there: npm ci in ui/page")
    stage.page.emulate_media(color_scheme=theme, reduced_motion="reduce")  # a colour on its way has no contrast yet
    serious: list[str] = []
    for name in stage.page.locator(".rail-item span").all_inner_texts():
        stage.view(name)
        stage.page.evaluate(AXE.read_text("utf-8"))
        found = stage.page.evaluate(f"axe.run(document, {{resultTypes: ['violations'], ...{rules}}})")
        serious += [
            f"{name}: {each['id']}: {node['html'][:160]}"
            for each in found["violations"]
            if each["impact"] in {"serious", "critical"}
            for node in each["nodes"]
        ]
    stage.page.emulate_media(color_scheme="light", reduced_motion="no-preference")
    assert not serious, "\n".join(serious)


DRAWS_PAST = """share => {
    const canvas = document.querySelector('.plot-host canvas');
    const {width, height} = canvas;
    const colour = getComputedStyle(canvas).getPropertyValue('--series-1').match(/\\w\\w/g);
    const line = colour.map(each => parseInt(each, 16));
    const {data} = canvas.getContext('2d').getImageData(0, 0, width, height);
    const columns = new Set();
    for (let at = 0; at < data.length; at += 4) {
        if (line.every((each, place) => Math.abs(data[at + place] - each) < 10)) columns.add(at / 4 % width);
    }
    return columns.size > share * (width - 80) - 40;
}"""
"""Whether the first line is drawn over this share of the plot."""


def test_a_plot_moves(stage: Stage, screenshot: Keep):
    stage.view("Plot")
    field = stage.page.get_by_label("Add a line", exact=False).first
    field.fill("imu/data.linear_acceleration.z")
    field.press("Enter")
    canvas = stage.page.locator(".plot-host canvas").first
    canvas.wait_for()
    picture = "each => each.toDataURL()"
    before = canvas.evaluate(picture)
    stage.page.wait_for_function(
        "before => document.querySelector('.plot-host canvas').toDataURL() !== before", arg=before
    )
    stage.page.wait_for_function(DRAWS_PAST, arg=0.1)  # for the picture
    screenshot(stage.page, "plot")


def test_a_second_user_is_refused_in_words(stage: Stage):
    with closing(stage.opened(stage.shown, token="wrong")) as page:  # noqa: S106  # a wrong one
        page.wait_for_selector(".banner.bad")
        assert "busflow ui" in page.locator(".banner.bad").first.inner_text()
        assert page.locator("[data-vertex]").count() == 0


def test_a_killed_run_gives_way_to_the_next(stage: Stage, screenshot: Keep):
    stage.view("Graph")
    stage.page.wait_for_selector('[data-vertex="node /odd"]')
    assert stage.run is not None
    stage.run.process.send_signal(signal.SIGKILL)
    stage.page.wait_for_selector(".banner:has-text('has ended')")
    screenshot(stage.page, "ended")
    stage.start()
    stage.page.wait_for_selector(".banner:has-text('has ended')", state="detached")
    stage.page.wait_for_selector('[data-edge="deliver /sensor_processor /imu/data"].flowing')


def test_a_recording_is_scrubbed_to_a_known_value(stage: Stage, screenshot: Keep):
    """The value of the message at the end of virtual time is the one that `busflow bag echo` shows."""
    options = ("--sim", "--for", "10s", "--record", "lab.mcap")
    command = [sys.executable, "-P", "-m", "busflow"]
    quiet: Any = {"cwd": stage.folder, "check": True, "capture_output": True, "text": True}
    subprocess.run([*command, "run", "lab1.yaml", *options], **quiet)
    echoed = subprocess.run([*command, "bag", "echo", "lab.mcap", "stability_index", "--json"], **quiet).stdout
    known = json.loads(echoed.splitlines()[-1])
    shown = Shown("lab.mcap", environment=stage.place.environment, folder=stage.folder)
    try:
        with closing(stage.opened(shown)) as page:
            page.wait_for_selector(".edge.flowing", state="attached")
            assert page.locator(".edge.silent").count() == 0, "the rates are those of the recording"
            page.locator(".rail-item", has_text="Messages").click()
            page.locator(".topic-row", has_text="stability_index").click()
            page.wait_for_selector(".message:has-text('stability_index')")
            scrubber = page.get_by_label("Moment of the recording")
            scrubber.focus()
            scrubber.press("End")
            value = str(known["message"]["data"])[:8]
            page.wait_for_selector(f".message:has-text('{value}')", timeout=PATIENCE_MS)
            views = page.locator(".rail-item span").all_inner_texts()
            assert views == ["Graph", "Plot", "Messages", "Images", "Frames", "Log", "Actions"], (
                "those that a recording fills"
            )
            screenshot(page, "recording")
            page.locator(".rail-item", has_text="Plot").click()
            field = page.get_by_label("Add a line", exact=False).first
            field.fill("stability_index.data")
            field.press("Enter")
            page.get_by_label("Last", exact=False).select_option("whole")
            page.wait_for_function(DRAWS_PAST, arg=0.9)
            screenshot(page, "whole-recording")
    finally:
        shown.end()


def test_the_browser_complains_of_nothing(stage: Stage):
    """Last: no error in its console, and no request to another server, in all that was shown."""
    lost = ("WebSocket connection to", "ERR_CONNECTION_REFUSED")  # while the run was away
    assert [each for each in stage.complaints if not any(word in each for word in lost)] == []


def test_the_pictures_are_kept(screenshot: Keep):
    """The folder is the one that was asked for."""
    folder = os.environ.get("BUSFLOW_SCREENSHOTS")
    if folder:
        assert (Path(folder) / "graph.png").is_file()
    assert callable(screenshot)
