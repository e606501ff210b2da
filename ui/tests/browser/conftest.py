"""A browser that shows `busflow ui` on a run of the lab with one more node; all tests of the folder share both.

Without a browser on this machine the tests are skipped, unless CI says that there has to be one.
"""

import base64
import os
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from tests.cli.conftest import LiveRun, Place
from ui.tests.page_server.conftest import Shown, built_page

__all__ = ["built_page"]

ROOT = Path(__file__).parents[3]
AXE = ROOT / "ui/page/node_modules/axe-core/axe.min.js"
PATIENCE_MS = 60_000
MARKUP = '<img src=x onerror="document.title=1"><b>bold</b> \u202egnp.exe'
OPTIONS = [
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--no-first-run", "--disable-default-apps"),
]
JPEG = base64.b64decode(
    "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDABsSFBcUERsXFhceHBsgKEIrKCUlKFE6PTBCYFVlZF9VXVtqeJmBanGQc1tdhbWGkJ6jq62rZ4C8ybqm"
    "x5moq6T/2wBDARweHigjKE4rK06kbl1upKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKT/wAARCAAI"
    "ABADASIAAhEBAxEB/8QAFQABAQAAAAAAAAAAAAAAAAAAAAX/xAAUEAEAAAAAAAAAAAAAAAAAAAAA/8QAFQEBAQAAAAAAAAAAAAAAAAAABAb/xAAU"
    "EQEAAAAAAAAAAAAAAAAAAAAA/9oADAMBAAIRAxEAPwCcAIon/9k="
)
"""A red picture of 16 × 8 pixels."""
ODD = f'''
"""A node that loses messages, and writes what a page must not take for its own."""

import time

from busflow import Node, Parameters, QoS, RunningGoal, action, publisher, subscription, timer
from busflow.msgs.example_interfaces import Fibonacci
from busflow.msgs.geometry_msgs import Twist
from busflow.msgs.sensor_msgs import CompressedImage, Image
from busflow.msgs.std_msgs import Float64, String


class OddParameters(Parameters):
    burst: int = 1
    note: str = {MARKUP!r}
    blocked_s: float = 0.0


class Odd(Node):
    """Publishes bursts into a queue of one message, and pictures, and how it is driven."""

    parameters: OddParameters
    out = publisher(String, "odd/burst")
    jpeg = publisher(CompressedImage, "odd/jpeg")
    raw = publisher(Image, "odd/raw")
    driven = publisher(Float64, "odd/driven")
    blocked_s = 0.0

    async def start(self) -> None:
        self.log.warning({MARKUP!r})

    @timer(0.1)
    def publish(self) -> None:
        for number in range(self.parameters.burst):
            self.out.publish(String(data=f"{{self.parameters.note}} {{number}}"))

    @timer(0.5)
    def show(self) -> None:
        self.jpeg.publish(CompressedImage(format="jpeg", data={JPEG!r}))
        self.raw.publish(Image(height=2, width=3, encoding="rgb8", step=9, data=bytes([0, 0, 255] * 6)))

    @timer(0.1)
    def block(self) -> None:
        """Block the event loop, once for each value."""
        if self.parameters.blocked_s != self.blocked_s:
            self.blocked_s = self.parameters.blocked_s
            time.sleep(self.blocked_s)

    @subscription("odd/burst", qos=QoS(depth=1))
    def on_burst(self, message: String) -> None:
        """Do nothing."""

    @action(Fibonacci, "~/count")
    async def count(self, goal: RunningGoal[Fibonacci]) -> Fibonacci.Result:
        """Count at once; to 0 it counts until it is canceled."""
        while not goal.request.order:
            goal.feedback(Fibonacci.Feedback(sequence=[7, 8, 9]))
            await self.clock.sleep(0.05)
        return Fibonacci.Result(sequence=list(range(goal.request.order)))

    @count.accepts
    def possible(self, request: Fibonacci.Goal) -> bool | str:
        return True if request.order >= 0 else f"{{self.parameters.note}} does not count to {{request.order}}"

    @subscription("cmd_vel")
    def drive(self, twist: Twist) -> None:
        self.driven.publish(Float64(data=twist.linear.x))
'''


def patient(page: Any) -> Any:
    """Let a page, and a test that waits for it, wait however busy the machine is."""
    page.set_default_timeout(PATIENCE_MS)
    page.add_init_script("globalThis.busflowLimits = {answer: 1e9, overview: 1e9, assistant: 1e9, copied: 1e9}")
    return page


class EmptyPage(BaseHTTPRequestHandler):
    """Serves an empty page at every address, and logs nothing."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


class Stage:
    """A run of the lab, `busflow ui` beside it, and the browser that shows it."""

    def __init__(self, folder: Path, browser: Any, lasting: set[int]) -> None:
        self._lasting = lasting
        runs, self.folder, self.browser = folder / "runs", folder / "lab", browser
        runs.mkdir(mode=0o700)
        folder = self.folder
        (folder / "more").mkdir(parents=True)
        (folder / "more/odd.py").write_text(ODD, "utf-8")
        text = (ROOT / "configs/lab1.yaml").read_text("utf-8").partition("# What `busflow test`")[0]
        text = text.replace("[../plugins]", f"[{ROOT / 'plugins'}, more]").replace(
            "  sensor_processor:\n", "  odd:\n    plugin: odd\n\n  sensor_processor:\n"
        )
        (folder / "lab1.yaml").write_text(text, "utf-8")
        self.place = Place(runs)
        self.run: LiveRun | None = None
        self.start()
        self._site = ThreadingHTTPServer(("127.0.0.1", 0), EmptyPage)
        Thread(target=self._site.serve_forever, daemon=True).start()
        self.origin = f"http://localhost:{self._site.server_port}"
        """Another site, whose pages may look."""
        self.shown = Shown("--allow-origin", self.origin, environment=self.place.environment, folder=folder)
        assert self.shown.process.stdout
        self.looking = re.findall(r"with the token (\S+)", self.shown.process.stdout.readline())[0]
        """The token of pages that may only look."""
        self.complaints: list[str] = []
        """What the browser's console said, and requests to others."""
        self.page = self.opened(self.shown)

    def start(self) -> None:
        """Run the lab, also after it was killed."""
        if self.run is not None:
            self.run.stop()
        self.run = self.place.run(self.folder, "lab1.yaml")
        self._lasting.add(self.run.process.pid)
        self.run.wait_for("All sensors operational")

    def opened(self, shown: Shown, token: str | None = None) -> Any:
        """Open a page on what is shown."""
        page = patient(self.browser.new_page(viewport={"width": 1280, "height": 800}))
        page.on("console", lambda said: self.complaints.append(said.text) if said.type == "error" else None)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        own = (shown.url, shown.url.replace("http", "ws", 1), "blob:")
        page.on("request", lambda request: request.url.startswith(own) or self.complaints.append(request.url))
        page.goto(f"{shown.url}/#token={shown.token if token is None else token}")
        return page

    def view(self, name: str) -> Any:
        """Go to a view by the rail, and return its panel."""
        self.page.locator(".rail-item", has_text=name).click()
        return self.page.locator("main")

    def close(self) -> None:
        self.page.close()
        self.shown.end()
        self._site.shutdown()
        self._site.server_close()
        if self.run is not None:
            self.run.stop()


@pytest.fixture(scope="package")  # while it is there, its event loop runs in this thread, and no other test's can
def browser() -> Iterator[Any]:
    """Chromium, as Debian and others install it."""
    sync_api: Any = pytest.importorskip("playwright.sync_api")
    path = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if path is None:
        assert not os.environ.get("CI"), "there is no Chromium, and CI has to have one"
        pytest.skip("there is no Chromium on this machine: apt-get install chromium")
    with sync_api.sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=path, args=OPTIONS)
        yield found
        found.close()


@pytest.fixture(scope="package")
def stage(browser: Any, built_page: Path, lasting: set[int]) -> Iterator[Stage]:
    assert built_page.is_dir()
    with tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as path:
        found = Stage(Path(path), browser, lasting)
        yield found
        found.close()


@pytest.fixture(scope="session")
def screenshot(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Any, str], None]:
    """A function that keeps a picture of a page, in the folder of BUSFLOW_SCREENSHOTS."""
    stated = os.environ.get("BUSFLOW_SCREENSHOTS")
    folder = Path(stated) if stated else tmp_path_factory.mktemp("screenshots")
    folder.mkdir(parents=True, exist_ok=True)

    def keep(page: Any, name: str) -> None:
        page.screenshot(path=folder / f"{name}.png")

    return keep
