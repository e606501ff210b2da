"""A book in a browser, while the lab and the assistant run: its text, its live parts, and questions about it."""

import os
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import closing
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from busflow.cli import main
from tests.cli.conftest import LiveRun, Place
from ui.tests.browser.conftest import AXE, patient
from ui.tests.page_server.conftest import Shown

if not os.environ.get("CI"):  # where it has to be there
    pytest.importorskip("busflow_assistant", reason="the assistant is not installed: pip install ./assistant")

ROOT = Path(__file__).parents[3]
MARKUP = '<img src=x onerror="document.title=1"><b>bold</b>'
ODD = f"""# Odd

The odd node publishes {MARKUP} at 7 Hz.

<!-- busflow-parameter node=/sensor_publisher name=noise.imu run=configs/textbook.yaml -->

<!-- busflow-plot topic=/balance_state field=data run=configs/textbook.yaml -->

[Back to lab 1](lab1.md)
"""
QUESTIONS = {
    "What does the sensor processor node do?": "sensor_processor makes sense of them",
    "How often does the sensor publisher publish data?": "0.1 s",
    "What topics does this lab use for communication?": "/imu/data",
}
SELECTED = dict(zip(QUESTIONS, ("Two nodes ran", "/sensor_publisher", "/joint_states"), strict=True))
SITE_PAGE = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Docs</title>
<link rel="icon" href="data:,"></head><body><main><h1>Pumps</h1>
<p>It has a pump.</p><p>The pump node publishes the pressure 25 times a second.</p>
</main><script type="module" src="SERVER/assistant.js" data-busflow-token="TOKEN"></script></body></html>"""


class BookStage:
    """The lab and the assistant, `busflow ui --book` beside them, and a browser."""

    def __init__(self, folder: Path, browser: Any) -> None:
        runs, self.folder, self.browser = folder / "runs", folder / "book", browser
        runs.mkdir(mode=0o700)
        pages = self.folder / "pages"
        pages.mkdir(parents=True)
        for page in ("lab1.md", "live_noise.md"):
            shutil.copy(ROOT / "docs/tutorial" / page, pages)
        (pages / "odd.md").write_text(ODD, "utf-8")
        lab = (ROOT / "configs/lab1.yaml").read_text("utf-8").partition("# What `busflow test`")[0]
        (self.folder / "lab1.yaml").write_text(lab.replace("../plugins", str(ROOT / "plugins")), "utf-8")
        book = (ROOT / "configs/textbook.yaml").read_text("utf-8").replace("docs/tutorial", str(pages))
        (self.folder / "textbook.yaml").write_text(book, "utf-8")
        self.place = Place(runs)
        self.run: LiveRun | None = None
        # The site's address has to be known before the server lets it ask.
        self.site_folder = folder / "site"
        self.site_folder.mkdir()
        handler = partial(QuietHandler, directory=str(self.site_folder))
        self.site = ThreadingHTTPServer(("127.0.0.1", 0), handler)
        Thread(target=self.site.serve_forever, daemon=True).start()
        self.origin = f"http://127.0.0.1:{self.site.server_port}"
        self.shown = Shown(
            *("--book", str(pages), "--allow-origin", self.origin),
            environment=self.place.environment,
            folder=self.folder,
        )
        assert self.shown.process.stdout
        lines = [self.shown.process.stdout.readline() for _ in range(2)]
        self.asking = re.findall(r"with the token (\S+)", lines[1])[0]
        self.complaints: list[str] = []
        self.page: Any = None

    def start(self, *options: str) -> None:
        if self.run is not None:
            self.run.stop()
        self.run = self.place.run(self.folder, "textbook.yaml", *options)
        self.run.wait_for("All sensors operational")

    def opened(self, address: str) -> Any:
        page = patient(self.browser.new_page(viewport={"width": 1280, "height": 800}))
        page.on("console", lambda said: self.complaints.append(said.text) if said.type == "error" else None)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        own = (self.shown.url.removesuffix("/book"), "ws://127.0.0.1", "blob:", "file://", self.origin)
        page.on("request", lambda request: request.url.startswith(own) or self.complaints.append(request.url))
        page.goto(address)
        return page

    def go(self, chapter: str) -> Any:
        """Show a chapter; the tab keeps its token."""
        if self.page is None:
            self.page = self.opened(f"{self.shown.url}/{chapter}#token={self.shown.token}")
        else:
            self.page.goto(f"{self.shown.url}/{chapter}")
        self.page.wait_for_selector(".assistant-button")
        return self.page

    def close(self) -> None:
        if self.page is not None:
            self.page.close()
        self.shown.end()
        if self.run is not None:
            self.run.stop()
        self.site.shutdown()
        self.site.server_close()


class QuietHandler(SimpleHTTPRequestHandler):
    """Serves a folder, and logs nothing."""

    def log_message(self, *_: Any) -> None:
        pass


@pytest.fixture(scope="module")
def stage(browser: Any, built_page: Path) -> Iterator[BookStage]:
    assert built_page.is_dir()
    with tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as path:
        found = BookStage(Path(path), browser)
        yield found
        found.close()


def select(page: Any, text: str) -> None:
    """Select the first block that has a text, as a mouse does."""
    block = page.locator("article :is(p, li, figure)", has_text=text).first
    block.scroll_into_view_if_needed()
    block.evaluate("block => getSelection().selectAllChildren(block)")
    page.wait_for_selector(".assistant-button.floating")


def ask(page: Any, question: str) -> Any:
    """Ask in the open dialog; return the last exchange, answered."""
    page.get_by_label("Question", exact=True).fill(question)  # once the dialog is there, with the earlier exchanges
    count = page.locator(".exchange").count()
    page.keyboard.press("Enter")
    exchange = page.locator(".exchange").nth(count)
    exchange.locator(".exchange-meta, .failed").first.wait_for()
    return exchange


def marked(page: Any) -> str:
    page.wait_for_selector("mark.cited")
    return squeezed("".join(page.locator("mark.cited").all_inner_texts()))


def squeezed(text: str) -> str:
    """Return a text without its spaces: marks of several lines have none between them."""
    return "".join(text.split())


def test_a_book_without_a_run_says_how(stage: BookStage):
    page = stage.go("odd.html")
    live = page.locator(".live-plot")
    assert "busflow run configs/textbook.yaml" in live.inner_text()
    page.get_by_role("button", name="AI Assistant").click()
    page.wait_for_selector(".assistant-state:has-text('busflow run configs/textbook.yaml')")
    assert page.get_by_role("button", name="Ask", exact=True).is_disabled()
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")
    stage.start()
    page.wait_for_selector(".live-plot .live-panel")


def test_the_live_plot_moves(stage: BookStage, screenshot: Callable[[Any, str], None]):
    page = stage.go("odd.html")
    canvas = page.locator("busflow-plot canvas").first
    canvas.wait_for()
    moved = "before => document.querySelector('busflow-plot').shadowRoot.querySelector('canvas').toDataURL() !== before"
    page.wait_for_function(moved, arg=canvas.evaluate("each => each.toDataURL()"))
    slider = page.get_by_label("noise.imu, slider")
    slider.focus()
    slider.press("ArrowRight")
    page.locator("busflow-parameter .parameter.differs").wait_for()
    screenshot(page, "book-live")


@pytest.mark.parametrize("question", QUESTIONS)
def test_a_selection_answers_the_labs_questions(
    stage: BookStage, question: str, screenshot: Callable[[Any, str], None]
):
    page = stage.go("lab1.html")
    select(page, SELECTED[question])
    page.locator(".assistant-button.floating").click()
    page.wait_for_selector(".assistant-state:has-text('Nothing leaves this machine')")
    exchange = ask(page, question)
    assert "extractive" in exchange.locator(".exchange-meta").inner_text()
    wanted = squeezed(QUESTIONS[question])
    assert wanted in squeezed(exchange.locator(".exchange-answer").inner_text())
    citations = exchange.locator(".citation")
    citations.first.click()
    assert marked(page).startswith(squeezed(citations.first.locator(".citation-text").inner_text()).rstrip("…"))
    assert page.locator("mark.cited").first.is_visible()
    screenshot(page, "book-answer")


def test_an_answer_beyond_the_selection_says_so(stage: BookStage):
    page = stage.go("lab1.html")
    select(page, "You need no robot")
    page.locator(".assistant-button.floating").click()
    exchange = ask(page, "What does the sensor processor node do?")
    assert "Not in your selection; the page says:" in exchange.inner_text()


def test_what_the_page_does_not_say_is_refused(stage: BookStage):
    page = stage.go("lab1.html")
    page.locator(".assistant-button.corner").click()
    exchange = ask(page, "Which GPU does the lab need?")
    exchange.locator(".refused").wait_for()
    assert exchange.locator(".citation").count() == 0


def test_the_talk_goes_on_in_another_chapter(stage: BookStage):
    page = stage.go("lab1.html")
    page.locator(".assistant-button.corner").click()
    page.locator(".exchange").first.wait_for()  # it was kept over a new page too
    before = page.locator(".exchange").count()
    ask(page, "What does the sensor processor node do?").locator(".citation").first.wait_for()
    page.keyboard.press("Escape")
    page.evaluate("window.isSame = true")
    page.get_by_role("link", name="The lab, with noise").first.click()
    page.wait_for_selector("main[data-page='live_noise.md']")
    page.locator(".assistant-button.corner").click()
    page.locator(".exchange").nth(before).wait_for()
    page.locator(".exchange").last.locator(".citation").first.click()
    page.wait_for_selector("main[data-page='lab1.md']")
    assert "sensor_processor" in marked(page)
    assert page.evaluate("window.isSame"), "the page was never left"
    page.keyboard.press("Escape")
    page.go_back()
    page.wait_for_selector("main[data-page='live_noise.md']")


def test_markup_stays_text_everywhere(stage: BookStage):
    page = stage.go("odd.html")
    select(page, "The odd node")
    page.locator(".assistant-button.floating").click()
    exchange = ask(page, f"How often does the odd node publish {MARKUP}?")
    assert "7 Hz" in exchange.inner_text()
    assert MARKUP in exchange.locator(".exchange-question").inner_text()
    assert MARKUP in exchange.locator(".exchange-answer").inner_text()
    exchange.locator(".citation").first.click()
    assert squeezed(MARKUP) in marked(page)
    assert page.locator("main img, main b, dialog img, dialog b").count() == 0
    assert page.title() != "1"


def test_all_of_it_works_by_keyboard(stage: BookStage):
    page = stage.go("odd.html")
    page.wait_for_selector(".live-plot .live-panel input")  # Tab comes to its fields before it comes to the button
    page.locator("article h1").click()
    page.keyboard.press("Control+a")
    page.wait_for_selector(".assistant-button.floating")
    for _ in range(60):
        if page.evaluate("document.activeElement.matches('.assistant-button.floating')"):
            break
        page.keyboard.press("Tab")
    else:
        pytest.fail("Tab never comes to the button beside the selection")
    page.keyboard.press("Enter")
    page.wait_for_selector("dialog[open]")
    assert page.evaluate("document.activeElement.matches('dialog textarea')")
    page.wait_for_selector(".assistant-state:has-text('Nothing leaves')")
    page.keyboard.type("How often does the odd node publish?")
    page.keyboard.press("Enter")
    page.locator(".exchange").last.locator(".citation").first.wait_for()
    for _ in range(12):
        page.keyboard.press("Tab")
        assert page.evaluate(
            "document.activeElement === document.body || document.activeElement.closest('dialog') !== null"
        )
    page.locator(".exchange").last.locator(".citation").first.focus()
    page.keyboard.press("Enter")
    assert "7Hz" in marked(page)
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")
    assert page.evaluate("document.activeElement.matches('.assistant-button')")


def test_a_long_selection_is_cut_and_said(stage: BookStage):
    page = stage.go("lab1.html")
    page.evaluate("getSelection().selectAllChildren(document.querySelector('article'))")
    page.locator(".assistant-button.floating").click()
    page.wait_for_selector("dialog .warn:has-text('the first 20 kB are asked about')")
    page.get_by_role("button", name="Ask about the page instead").click()
    page.wait_for_selector(".assistant-about:has-text('About the page')")
    page.keyboard.press("Escape")


def test_a_finger_has_the_button_too(stage: BookStage):
    context = stage.browser.new_context(viewport={"width": 390, "height": 800}, has_touch=True, is_mobile=True)
    with closing(context):
        page = patient(context.new_page())
        page.goto(f"{stage.shown.url}/odd.html#token={stage.shown.token}")
        page.wait_for_selector(".live-plot .live-panel")
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "nothing leads out to the side"
        page.locator(".assistant-button.corner").tap()
        page.locator("dialog").get_by_role("button", name="Close").tap()
        select(page, "The odd node")
        page.locator(".assistant-button.floating").tap()
        ask(page, "How often does the odd node publish?").locator(".citation").first.tap()
        assert "7Hz" in marked(page)
        assert page.locator("dialog").count() == 0, "it would cover the text"


def test_code_is_copied_and_the_book_searched(stage: BookStage):
    page = stage.go("lab1.html")
    stage.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    figure = page.locator("figure.code", has_text="--sim --for 10min").first
    figure.hover()
    figure.get_by_role("button", name="Copy").click()
    page.wait_for_selector("figure.code button:has-text('Copied')")
    assert page.evaluate("navigator.clipboard.readText()").startswith(
        "busflow run configs/lab1.yaml --sim --for 10min\n"
    )
    page.keyboard.press("/")
    page.keyboard.type("odd node")
    page.locator(".book-results a").first.wait_for()
    page.keyboard.press("Enter")
    page.wait_for_selector("main[data-page='odd.md']")


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_book_is_accessible(stage: BookStage, theme: str):
    if not AXE.is_file():
        assert not os.environ.get("CI"), "run npm ci in ui/page first"
        pytest.skip("axe-core is not there: npm ci in ui/page")
    page = stage.go("live_noise.html")
    page.wait_for_selector(".live-plot .live-panel")
    page.emulate_media(color_scheme=theme, reduced_motion="reduce")  # a colour on its way has no contrast yet
    page.evaluate(AXE.read_text("utf-8"))
    serious: list[str] = []
    for is_asking in (False, True):
        if is_asking:
            page.locator(".assistant-button.corner").click()
            page.wait_for_selector(".exchange .citation")
        found = page.evaluate("axe.run(document, {resultTypes: ['violations']})")
        serious += [
            f"{each['id']}: {node['html'][:160]}"
            for each in found["violations"]
            if each["impact"] in {"serious", "critical"}
            for node in each["nodes"]
        ]
    page.emulate_media(color_scheme="light", reduced_motion="no-preference")
    assert not serious, "\n".join(serious)


def test_another_site_asks_with_one_tag(stage: BookStage):
    server = stage.shown.url.removesuffix("/book")
    html = SITE_PAGE.replace("SERVER", server).replace("TOKEN", stage.asking)
    (stage.site_folder / "index.html").write_text(html, "utf-8")
    with closing(stage.opened(stage.origin)) as page:
        page.locator(".assistant-button.corner").click()
        exchange = ask(page, "How often does the pump node publish the pressure?")
        assert "25 times a second" in exchange.inner_text()
        exchange.locator(".citation").first.click()
        assert "25timesasecond" in marked(page)


def test_a_killed_assistant_comes_back(stage: BookStage):
    page = stage.go("odd.html")
    page.wait_for_selector(".live-plot .live-panel")
    page.locator(".assistant-button.corner").click()
    page.wait_for_selector(".assistant-state:has-text('Nothing leaves')")
    assert stage.run is not None
    stage.run.process.kill()
    page.wait_for_selector(".assistant-state:has-text('busflow run configs/textbook.yaml')")
    page.wait_for_selector(".live-plot:not(.is-live)")
    count = page.locator(".exchange").count()
    page.get_by_label("Question", exact=True).fill("How often does the odd node publish?")
    page.keyboard.press("Enter")
    page.wait_for_selector("text=Your question is asked as soon as an assistant answers")
    endpoint = "nodes.assistant.parameters.endpoint"  # at a port where nothing listens
    stage.start("--set", f"{endpoint}.url=http://127.0.0.1:9/v1", "--set", f"{endpoint}.model=tiny")
    exchange = page.locator(".exchange").nth(count)
    exchange.locator(".exchange-meta").wait_for()
    assert "Questions go to 127.0.0.1" in page.locator(".assistant-state").inner_text()
    assert "7 Hz" in exchange.inner_text(), "the quotes, without the model"
    page.wait_for_selector(".live-plot .live-panel", state="attached")


def test_an_exported_book_opens_as_files(stage: BookStage, tmp_path: Path):
    site = tmp_path / "site"
    assert main(["ui", "--book", str(stage.folder / "pages"), "--export", str(site)]) == 0
    with closing(stage.opened(f"file://{site}/index.html")) as page:
        page.wait_for_selector("main h1")
        page.get_by_role("link", name="Odd").first.click()
        page.wait_for_selector(".live-how:has-text('busflow run configs/textbook.yaml')")
        page.keyboard.press("/")
        page.keyboard.type("noise")
        page.locator(".book-results a").first.wait_for()
        assert page.locator(".assistant-button").count() == 0


def test_the_browser_complains_of_nothing(stage: BookStage):
    """Last: no error in its console, and no request to another server, in all that was shown."""
    lost = ("WebSocket connection to", "ERR_CONNECTION_REFUSED")  # while the run was away
    assert [each for each in stage.complaints if not any(word in each for word in lost)] == []
