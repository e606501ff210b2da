"""Endings of a worker process before it is asked to end: one rule for all, in `busflow/processes/worker_process.py`."""

import pytest

DYING = """
import os
import signal
from pathlib import Path

from busflow import Node, timer

WAYS = [lambda: os._exit(0), lambda: os._exit(3)]
WAYS += [lambda n=n: signal.raise_signal(n) for n in (signal.SIGTERM, signal.SIGKILL, signal.SIGSEGV)]
LIVES = Path("lives")


def die(stage):
    if os.environ.get("STAGE") == stage and LIVES.stat().st_size < len(WAYS):
        with LIVES.open("a") as lives:
            lives.write(".")
        WAYS[LIVES.stat().st_size - 1]()


die("import")


class Dying(Node):
    async def start(self) -> None:
        die("start")

    @timer(hz=20)
    def work(self) -> None:
        die("run")
        if LIVES.stat().st_size == len(WAYS):
            self.log.info("settled")
"""
RUN = """
processes:
  left: {env: {STAGE: "WHEN"}, restart: {policy: POLICY, backoff: [1ms, 1ms]}}
nodes: {dying: {plugin: dying, process: left}}
"""
FATES = [
    "the process left ended with exit code 0, before its nodes had ended",
    "the process left ended with exit code 3",
    "the process left was ended by SIGTERM",
    "the process left was ended by SIGKILL",
    "the process left was ended by SIGSEGV",
]


@pytest.mark.parametrize("when", ["run", *(pytest.param(each, marks=pytest.mark.long) for each in ("import", "start"))])
def test_every_unasked_end_is_restarted(start, project, when):
    (project / "lives").touch()
    text = RUN.replace("WHEN", when).replace("POLICY", "on-failure")
    run = start(text, files={"plugins/dying.py": DYING})
    run.wait_for("settled")
    assert run.end() == 130
    (left,) = [each for each in run.report()["processes"] if each["name"] == "left"]
    assert left["fates"] == FATES


@pytest.mark.parametrize(
    ("lives", "fate"),
    [pytest.param(n, fate, marks=[pytest.mark.long] if n else []) for n, fate in enumerate(FATES)],
)
def test_unasked_end_without_restart_fails_run(start, project, lives, fate):
    (project / "lives").write_text("." * lives)
    text = RUN.replace("WHEN", "run").replace("POLICY", "never")
    run = start(text, files={"plugins/dying.py": DYING})
    assert run.end(None) == 1
    assert [line for line in run.lines if line.startswith("error:")] == [f"error: {fate}\n"]
