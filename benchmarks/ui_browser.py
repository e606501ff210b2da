"""What the page of `busflow ui` does in a browser: frames of a plot, and how soon a graph, a hang and an end are seen.

    python -m benchmarks.ui_browser [--frames 300]

It needs Chromium, playwright (`pip install './ui[test]'`), and `npm ci --ignore-scripts` in ui/page. Linux: it reads
/proc.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from contextlib import closing
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

from playwright.sync_api import sync_playwright

from benchmarks.ui import TICK_S, started

PAGE = Path(__file__).parents[1] / "ui/page"
ESBUILD = PAGE / "node_modules/.bin/esbuild"
LOADS = 5
DRAWN = """new MutationObserver((_, observer) => {
    if (document.querySelector('[data-vertex]') === null) return;
    observer.disconnect();
    requestAnimationFrame(() => setTimeout(() => window.drawnMs = performance.now()));
}).observe(document, {childList: true, subtree: true});"""
"""Keeps when the graph was drawn, by the page's own clock: what drives the browser costs as much as the page."""
OPTIONS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]


def children_of(process: int) -> list[int]:
    """Return a process and all below it."""
    found = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    return [process, *(each for child in found for each in children_of(int(child)))]


def cpu_s(process: int) -> float:
    """Processor time that a process and those below it have used so far."""
    total = 0
    for each in children_of(process):
        fields = Path(f"/proc/{each}/stat").read_text().rpartition(")")[2].split()
        total += int(fields[11]) + int(fields[12])
    return total * TICK_S


def print_frames(browser: Any, folder: Path, frames: int) -> None:
    """Print the frames of 20 lines of 10,000 points that move, and what each costs."""
    command = [str(ESBUILD), "src/plots/measured_chart.ts", "--bundle", "--minify", f"--outfile={folder}/chart.js"]
    jsx = ["--jsx=automatic", "--jsx-import-source=preact"]
    subprocess.run([*command, *jsx], cwd=PAGE, check=True, capture_output=True)  # noqa: S603  # a command of ours
    (folder / "chart.html").write_text('<link rel="stylesheet" href="chart.css"><body><script src="chart.js"></script>')
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.goto(f"file://{folder}/chart.html")
    page.evaluate("measure(20)")
    before = cpu_s(os.getpid())  # the browser is below us
    found = page.evaluate("frames => measure(frames)", frames)
    cpu_ms = (cpu_s(os.getpid()) - before) / frames * 1000
    page.close()
    print(f"20 lines of 10,000 points: {found['framesPerSecond']:.0f} frames a second (aim: 60)")
    print(f"  {found['drawnMs']:.1f} ms of each in the page, {cpu_ms:.1f} ms of processor time in all of the browser")


def timed_ms(page: Any, selector: str, begin: Any) -> float:
    """Return the time from an act until something is seen."""
    begun = perf_counter()
    begin()
    page.wait_for_selector(selector)
    return (perf_counter() - begun) * 1000


def drawn_ms(page: Any, url: str) -> float:
    """Open a page, and return the time from the beginning of its navigation until the graph is drawn."""
    page.add_init_script(DRAWN)
    page.goto(url)
    page.wait_for_function("() => window.drawnMs")
    return page.evaluate("window.drawnMs")


def print_delays(browser: Any, folder: Path) -> None:
    """Print how soon the graph appears, a run that hangs is reported, and one that was killed."""
    root = Path(__file__).parents[1]
    (folder / "runs").mkdir(mode=0o700)
    with started(folder, "run", str(root / "configs/lab1.yaml")) as run:
        wait_for_run(folder)
        with started(folder, "ui", "--port", "0") as ui:
            found = re.search(r"http://\S+", ui.stdout.readline() if ui.stdout else "")
            if found is None:
                sys.exit("busflow ui does not start: is the page built?")
            context = browser.new_context(viewport={"width": 1280, "height": 800})  # with a cache of its own
            page = context.new_page()
            first_ms, again_ms = drawn_ms(page, found[0]), []
            for _ in range(LOADS):
                with closing(context.new_page()) as other:
                    again_ms.append(drawn_ms(other, found[0]))
            hang_ms = timed_ms(page, ".banner:has-text('has not answered')", lambda: run.send_signal(signal.SIGSTOP))
            run.send_signal(signal.SIGCONT)
            page.wait_for_selector(".banner:has-text('has not answered')", state="detached")
            end_ms = timed_ms(page, ".banner:has-text('has ended')", run.kill)
            context.close()
    print(
        f"the graph is drawn after {first_ms:.0f} ms in a new browser, then after {median(again_ms):.0f} ms (aim: 500)"
    )
    print(f"a run that hangs is shown after {hang_ms:.0f} ms, one that was killed after {end_ms:.0f} ms (aim: 1000)")


def wait_for_run(folder: Path) -> None:
    """Wait until the run is found."""
    environment = {**os.environ, "BUSFLOW_RUNTIME_DIR": str(folder / "runs")}
    for _ in range(100):
        command = [sys.executable, "-m", "busflow", "node", "list"]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)  # noqa: S603  # as above
        if "sensor_publisher" in done.stdout:
            return
    sys.exit("the run does not start")


def main(frames: int) -> None:
    """Print all of it."""
    path = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if path is None:
        sys.exit("there is no Chromium on this machine: apt-get install chromium")
    if not ESBUILD.is_file():
        sys.exit("esbuild is not installed: run `npm ci --ignore-scripts` in ui/page")
    with tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=OPTIONS)
        print_frames(browser, Path(folder), frames)
        print_delays(browser, Path(folder))
        browser.close()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=300)
    main(parser.parse_args().frames)
