"""What a person does in the panels of the page, and what comes of it in the run of the lab."""

import json
import re
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest

from ui.tests.browser.conftest import Stage
from ui.tests.browser.test_browser import Keep, parameter
from ui.tests.page_server.conftest import Page, Shown

STAGE = '''
from busflow import Node, Parameters
from busflow.msgs.std_msgs import Float64


class StageParameters(Parameters):
    source: str
    target: str


class Stage(Node):
    """A step of a chain."""

    parameters: StageParameters

    def declare(self) -> None:
        self.out = self.create_publisher(Float64, self.parameters.target)
        self.create_subscription(Float64, self.parameters.source, self.out.publish)

    async def start(self) -> None:
        if self.parameters.target == "value_10":
            self.log.info("the last of a chain is there")
'''
FIELD = "imu/data.linear_acceleration.z"


@pytest.fixture
def peer(stage: Stage) -> Iterator[Page]:
    """Another page on the same run, which this test reads as frames."""
    with stage.shown.pages:
        found = stage.shown.page()
        found.until(lambda _: "/odd/driven" in found.channels)
        yield found


def opened_node(stage: Stage, name: str) -> Any:
    """The details of a node, chosen in the list beside the graph."""
    main = stage.view("Graph")
    back = main.locator(".details-back")
    if back.count():
        back.click()
    main.locator(".graph-list .row", has_text=name).first.click()
    main.locator(".details h2", has_text=name).wait_for()
    return main.locator(".details")


# Nodes.


def test_a_node_is_stopped_and_started(stage: Stage):
    details = opened_node(stage, "/odd")
    details.get_by_role("button", name="Stop", exact=True).click()
    details.locator(".node-state", has_text="stopped by hand").wait_for()
    details.get_by_role("button", name="Start", exact=True).click()
    details.locator(".node-state", has_text="running").wait_for()


def test_a_node_is_restarted(stage: Stage, peer: Page):
    details = opened_node(stage, "/odd")
    details.get_by_role("button", name="Restart", exact=True).click()
    details.locator(".said", has_text="It restarts.").wait_for()
    peer.follow("log")
    peer.update("log", lambda answer: sum("<img src=x" in line["text"] for line in answer["lines"]) > 1)
    details.locator(".node-state", has_text="running").wait_for()


def test_a_log_level_reaches_the_node(stage: Stage):
    details = opened_node(stage, "/odd")
    details.get_by_label("Log level").select_option("debug")
    details.locator(".said", has_text="It logs from debug on.").wait_for()


def test_a_blocked_event_loop_is_said(stage: Stage, screenshot: Keep):
    opened_node(stage, "/odd")
    parameter(stage, "odd", "set", "blocked_s", "3")
    banner = stage.page.locator(".banner", has_text="has not answered")
    banner.wait_for()
    screenshot(stage.page, "hang")
    banner.wait_for(state="detached")


def test_the_keyboard_walks_the_graph(stage: Stage):
    main, keyboard = stage.view("Graph"), stage.page.keyboard
    focused = "() => document.activeElement.dataset.vertex"
    main.get_by_label("Hidden").focus()  # what stands before the drawing
    keyboard.press("Tab")
    first = stage.page.evaluate(focused)
    assert first == "node /odd"
    for arrow in ("ArrowRight", "ArrowDown", "ArrowLeft"):
        keyboard.press(arrow)
    other = stage.page.evaluate(focused)
    assert other not in (None, first)
    keyboard.press("Enter")
    main.locator(".details h2", has_text=other.partition(" ")[2]).wait_for()
    keyboard.press("Escape")
    main.locator(".details").wait_for(state="detached")


def test_an_action_is_drawn_with_its_goals(stage: Stage, screenshot: Keep):
    goal = ("action", "send_goal", "odd/count", "example_interfaces/action/Fibonacci", "{order: 3}")
    command = [sys.executable, "-P", "-m", "busflow", *goal]
    subprocess.run(command, env=stage.place.environment, check=True, capture_output=True)
    main = stage.view("Graph")
    shown = main.get_by_label("Services and actions")
    shown.check()
    main.locator('[data-vertex="action /odd/count"]').dispatch_event("click")
    main.locator(".details", has_text="Action/odd/count").wait_for()
    main.locator(".details li", has_text="1 goal, 1 succeeded").wait_for()
    screenshot(stage.page, "action")
    shown.uncheck()
    main.locator('[data-vertex="action /odd/count"]').wait_for(state="detached")


def goals_of_count(stage: Stage, page: Any = None) -> Any:
    """The panel of actions, with the one chosen that the node has."""
    page = page or stage.page
    page.locator(".rail-item", has_text="Actions").click()
    page.get_by_label("Actions", exact=True).get_by_role("button", name="/odd/count").click()
    return page.locator("main")


def test_a_goal_is_sent_and_succeeds(stage: Stage):
    main = goals_of_count(stage)
    main.get_by_label("order").fill("4")
    main.get_by_role("button", name="Send goal").click()
    goal = main.locator(".goal", has_text="succeeded").filter(has_text="sent here").first
    goal.locator(".answer", has_text="sequence: [0, 1, 2, 3]").wait_for()


def test_a_goal_has_feedback_until_it_is_canceled(stage: Stage, screenshot: Keep):
    main = goals_of_count(stage)
    main.get_by_label("order").fill("")
    main.get_by_role("button", name="Send goal").click()
    goal = main.locator(".goal", has_text="executing")
    goal.locator(".answer", has_text="sequence: [7, 8, 9]").wait_for()
    screenshot(stage.page, "actions")
    stage.view("Log")  # the goal goes on, and is there again
    with closing(stage.opened(stage.shown)) as other:
        goals_of_count(stage, other).locator(".goal", has_text="of another client").locator(".answer").first.wait_for()
        main = goals_of_count(stage)
        main.locator(".goal", has_text="executing").get_by_role("button", name="Cancel").click()
        main.locator(".goal", has_text="sent here").filter(has_text="canceled").locator("text=Result").wait_for()
        other.locator(".goal", has_text="canceled").first.wait_for()


def test_a_refused_goal_shows_its_reason(stage: Stage):
    main = goals_of_count(stage)
    main.get_by_label("order").fill("-3")
    main.get_by_role("button", name="Send goal").click()
    goal = main.locator(".goal", has_text="not accepted")
    goal.locator("text=does not count to -3").wait_for()
    assert goal.locator("img").count() == 0, "markup is text"
    main.get_by_label("order").fill("many")
    main.get_by_role("button", name="Send goal").click()
    main.locator("[role=alert]", has_text="many is no whole number").wait_for()


def test_a_goal_has_a_time_limit(stage: Stage):
    main = goals_of_count(stage)
    main.get_by_label("order").fill("0")
    main.get_by_label("time limit").fill("0.3")
    main.get_by_label("time limit").press("Tab")
    main.get_by_role("button", name="Send goal").click()
    main.locator(".goal", has_text="did not end within 0.3 s").filter(has_text="canceled").wait_for()


def test_a_page_that_looks_has_no_form(stage: Stage):
    with closing(stage.opened(stage.shown, token=stage.looking)) as page:
        main = goals_of_count(stage, page)
        main.locator("text=This page may only look: it sends no goals.").wait_for()
        assert main.get_by_role("button", name="Send goal").count() == 0


# Driving.


def driven(peer: Page, speed: float) -> None:
    """Wait until the node was sent this speed; a hundred others in a row are five seconds of driving."""
    sent = (struct.unpack_from("<d", peer.message()["payload"], 4)[0] for _ in range(100))
    assert any(abs(each - speed) < 1e-6 for each in sent), f"it was not sent {speed:g} m/s"


@contextmanager
def held(stage: Stage, pad: Any, way: str) -> Iterator[None]:
    """Hold the pad at its top; what is held when the block fails is let go, for the tests that follow."""
    keyboard, mouse, box = stage.page.keyboard, stage.page.mouse, pad.bounding_box()
    if way == "pointer":
        mouse.move(box["x"] + box["width"] / 2, box["y"] + 2)
        mouse.down()
    else:
        pad.focus()
        keyboard.down("ArrowUp")
    try:
        yield
    finally:
        keyboard.up("ArrowUp")
        mouse.up()


def silent_after(peer: Page, zeros: int) -> None:
    """Count what the node is sent while ten other messages come: at most so many, and each of them zero."""
    others = 0
    while others < 10:
        found = peer.receive()
        if found["op"] != "data":
            continue
        if found["subscription"] == 2:
            others += 1
            continue
        zeros -= 1
        assert struct.unpack_from("<d", found["payload"], 4)[0] == 0
        assert zeros >= 0, "it goes on to publish"


@pytest.mark.parametrize("way", ["key", "pointer", "focus"])
def test_teleop_stops_when_it_is_let_go(stage: Stage, peer: Page, way: str):
    main = stage.view("Teleop")
    if main.get_by_role("button", name="Drive", exact=True).count():
        main.get_by_role("button", name="Drive", exact=True).click()
    pad = main.locator(".pad:not(.off)")
    pad.wait_for()
    peer.subscribe("/odd/driven", 1)
    peer.subscribe("/odd/burst", 2)
    with held(stage, pad, way):
        driven(peer, 0.5)
        driven(peer, 0.5)
        if way == "pointer":
            stage.page.mouse.up()
        elif way == "key":
            stage.page.keyboard.up("ArrowUp")
        else:
            stage.page.evaluate("dispatchEvent(new Event('blur'))")
        driven(peer, 0.0)
        silent_after(peer, 5)
    if way == "focus":
        main.get_by_role("button", name="Stop driving").click()


# Plots.


def test_a_number_is_dragged_into_a_plot(stage: Stage, screenshot: Keep):
    main = stage.view("Messages")
    main.locator(".topic-row", has_text="/stability_index").click()
    stage.page.get_by_label("Add a panel beside").select_option("plot")
    number = main.locator(".tree-row.number").first
    number.wait_for()
    search = main.get_by_label("Search the message")
    search.fill("no such field")
    main.get_by_text("No field matches.").wait_for()
    search.fill("data")
    number.wait_for()
    data = {"dataTransfer": stage.page.evaluate_handle("() => new DataTransfer()")}
    number.dispatch_event("dragstart", data)  # the mouse's own drag begins or not, as busy as the machine is
    for event in ("dragover", "drop"):
        main.locator(".plot-host").dispatch_event(event, data)
    main.locator(".plot", has_text="stability_index.data").wait_for()
    screenshot(stage.page, "drag")
    main.get_by_role("button", name="Close Plot").click()


def test_a_plot_is_saved_as_table_and_picture(stage: Stage, tmp_path: Path):
    main = stage.view("Plot")
    if not main.locator(".plot-host[aria-label*='linear_acceleration.z']").count():
        field = stage.page.get_by_label("Add a line", exact=False).first
        field.fill(FIELD)
        field.press("Enter")
    main.locator(".legend tr", has_text=FIELD).locator("td", has_text=re.compile(r"\d")).first.wait_for()
    for name in ("CSV", "PNG"):
        with stage.page.expect_download() as saving:
            main.get_by_role("button", name=name, exact=True).click()
        saving.value.save_as(tmp_path / name)
    head, *rows = (tmp_path / "CSV").read_text("utf-8").splitlines()
    assert head.startswith(f"stamp_ns,{FIELD}")
    assert rows
    assert all(re.fullmatch(r"\d{19},-?[\d.e-]+", row) for row in rows)
    assert (tmp_path / "PNG").read_bytes().startswith(b"\x89PNG\r\n")


# Images.


@pytest.mark.parametrize(
    ("topic", "text", "colour"), [("/odd/jpeg", "16 × 8 JPEG", [220, 255]), ("/odd/raw", "3 × 2", [0, 0])]
)
def test_an_image_is_shown(stage: Stage, topic: str, text: str, colour: list[int], screenshot: Keep):
    main = stage.view("Images")
    main.get_by_label("Topic").select_option(topic)
    main.locator(".picture-text", has_text=text).wait_for()
    pixel = "each => [...each.getContext('2d').getImageData(1, 1, 1, 1).data]"
    red, _, blue, opacity = main.locator(".picture canvas").evaluate(pixel)
    assert colour[0] <= red <= colour[1]
    assert (blue > 200) == (topic == "/odd/raw")
    assert opacity == 255
    screenshot(stage.page, f"image{topic.replace('/', '-')}")


# The launch file.


def test_parameters_are_saved_after_their_edit(stage: Stage, screenshot: Keep):
    file = stage.folder / "lab1.yaml"
    parameter(stage, "sensor_publisher", "set", "noise.imu", "0.625")
    before = file.read_text("utf-8")
    main = stage.view("Parameters")
    main.get_by_role("button", name="Save into the launch file…").first.click()
    dialog = stage.page.get_by_role("dialog")
    dialog.locator(".added", has_text="0.625").wait_for()
    screenshot(stage.page, "save")
    assert file.read_text("utf-8") == before, "shown, and not written"
    dialog.get_by_role("button", name="Save", exact=True).click()
    dialog.get_by_role("heading", name="Saved").wait_for()
    dialog.get_by_role("button", name="Close").click()
    assert "imu: 0.625" in file.read_text("utf-8")


def test_a_layout_is_saved_and_begins_the_page(stage: Stage):
    file = stage.folder / "lab1.yaml"
    stage.view("Log")
    stage.page.get_by_role("button", name="Save layout…").click()
    dialog = stage.page.get_by_role("dialog")
    dialog.locator(".added", has_text="x-ui:").wait_for()
    assert "x-ui:" not in file.read_text("utf-8")
    dialog.get_by_role("button", name="Save", exact=True).click()
    dialog.get_by_role("heading", name="Saved").wait_for()
    dialog.get_by_role("button", name="Close").click()
    assert "view: log" in file.read_text("utf-8")
    with closing(stage.opened(stage.shown)) as page:
        page.locator(".rail-item[aria-current=page]", has_text="Log").wait_for()


# Elsewhere.


def test_a_page_elsewhere_embeds_parameters(stage: Stage):
    with closing(stage.browser.new_page()) as page:
        page.goto(stage.origin)
        page.evaluate(
            """([script, token]) => {
                const element = document.createElement("busflow-parameters");
                element.setAttribute("node", "/sensor_publisher");
                element.setAttribute("token", token);
                document.body.append(element);
                const tag = Object.assign(document.createElement("script"), {type: "module", src: script});
                document.head.append(tag);
            }""",
            [f"{stage.shown.url}/components.js", stage.looking],
        )
        page.locator("busflow-parameters .parameter", has_text="imu").first.wait_for()
        assert page.locator("busflow-parameters .parameter").count() > 2


def test_a_foreign_bridge_has_a_graph(stage: Stage, screenshot: Keep):
    """Foxglove's own server, which speaks the protocol as ROS 2's foxglove_bridge does, and has parameters."""
    foxglove: Any = pytest.importorskip("foxglove")
    websocket: Any = pytest.importorskip("foxglove.websocket")
    gain = {"/camera.gain": 5.0}

    class Gain(websocket.ServerListener):  # type: ignore[misc]  # of an optional package
        def on_get_parameters(self, *_: object) -> list[object]:
            return [websocket.Parameter(name, value=value) for name, value in gain.items()]

        def on_set_parameters(self, _: object, parameters: list[Any], *__: object) -> list[object]:
            gain.update({each.name: min(9.0, each.get_value()) for each in parameters})
            return self.on_get_parameters()

    offered = [getattr(websocket.Capability, each) for each in ("ConnectionGraph", "Parameters", "ClientPublish")]
    server = foxglove.start_server(port=0, capabilities=offered, server_listener=Gain())
    graph = websocket.ConnectionGraph()
    graph.set_published_topic("/scan", ["/lidar"])
    graph.set_subscribed_topic("/scan", ["/mapper"])
    graph.set_advertised_service("/save", ["/mapper"])
    server.publish_connection_graph(graph)
    shown = Shown("--bridge", f"ws://127.0.0.1:{server.port}", environment=stage.place.environment)
    try:
        with closing(stage.opened(shown)) as page:
            for vertex in ("node /lidar", "node /mapper", "topic /scan"):
                page.wait_for_selector(f'[data-vertex="{vertex}"]')
            page.wait_for_selector('[data-edge="deliver /mapper /scan"]', state="attached")
            graph.set_subscribed_topic("/scan", ["/mapper", "/planner"])
            server.publish_connection_graph(graph)
            page.wait_for_selector('[data-vertex="node /planner"]')
            screenshot(page, "bridge")
            page.locator(".rail-item", has_text="Parameters").click()
            field = page.get_by_role("textbox", name="gain")
            field.fill("7")
            field.press("Enter")
            page.wait_for_function("() => document.querySelector('.parameter input').value === '7.0'")
            assert gain == {"/camera.gain": 7.0}
            field.fill("100")
            field.press("Enter")
            page.get_by_text("The server keeps 9.").wait_for()
            page.wait_for_function("() => document.querySelector('.parameter input').value === '9.0'")
            screenshot(page, "bridge-parameters")
    finally:
        shown.end()
        server.stop()


def test_a_hundred_nodes_are_readable(stage: Stage, screenshot: Keep):
    """Every name that is drawn is 10 pixels high at least, folded by namespace and with one namespace opened."""
    folder = stage.folder / "hundred"
    (folder / "plugins").mkdir(parents=True)
    (folder / "plugins/stage.py").write_text(STAGE, "utf-8")
    nodes = [
        f"  stage_{robot}_{at}:\n    plugin: stage\n    namespace: robot_{robot}\n"
        f"    parameters: {{source: value_{at}, target: value_{at + 1}}}\n"
        for robot in range(10)
        for at in range(10)
    ]
    (folder / "hundred.yaml").write_text(f"name: hundred\nplugins: [plugins]\nnodes:\n{''.join(nodes)}", "utf-8")
    run = stage.place.run(folder, "hundred.yaml")
    try:
        run.wait_for("the last of a chain is there")
        shown = Shown("--run", "hundred", environment=stage.place.environment)
        try:
            with closing(stage.opened(shown)) as page:
                page.wait_for_selector('[data-vertex="group /robot_7"]')
                heights = "all => all.map(each => each.getBoundingClientRect().height)"
                assert min(page.locator(".vertex .name").evaluate_all(heights)) >= 10
                screenshot(page, "hundred")
                page.locator('[data-vertex="group /robot_7"]').click()
                page.wait_for_selector('[data-vertex="node /robot_7/stage_7_0"]', state="attached")
                assert min(page.locator(".vertex .name").evaluate_all(heights)) >= 10
                page.locator('[data-group="/robot_7"]').dispatch_event("click")
                page.wait_for_selector('[data-vertex="group /robot_7"]', state="attached")
        finally:
            shown.end()
    finally:
        run.stop()


def test_the_browser_still_complains_of_nothing(stage: Stage):
    """Last, as in the other module."""
    lost = ("WebSocket connection to", "ERR_CONNECTION_REFUSED")  # while the run was away
    assert json.dumps([each for each in stage.complaints if not any(word in each for word in lost)]) == "[]"
