"""Endings of a worker process before it is asked to end: one rule for all, in `busflow/processes/worker_process.py`."""

import os
import signal
from contextlib import suppress
from pathlib import Path

import pytest

PATIENCE_S = 60.0

DYING = """
import os
import signal
from pathlib import Path

from busflow import Node, timer

WAYS = [lambda: os._exit(0), lambda: os._exit(3)]
WAYS += [lambda n=n: signal.raise_signal(n) for n in (signal.SIGTERM, signal.SIGKILL, signal.SIGSEGV)]
LIVES = Path("lives")
STAGES = os.environ.get("STAGES", "").split()[LIVES.stat().st_size :]  # in which this life and later ones end
ENDED = []  # one that got SIGTERM may come here once more before it has stopped


def die(stage):
    if STAGES[:1] == [stage] and not ENDED:
        ENDED.append(stage)
        with LIVES.open("a") as lives:
            lives.write(".")
        WAYS[(LIVES.stat().st_size - 1) % len(WAYS)]()


die("import")


class Dying(Node):
    async def start(self) -> None:
        die("start")

    @timer(hz=20)
    def work(self) -> None:
        die("run")
        if not STAGES:
            self.log.info("settled")
"""
RUN = """
processes:
  left: {env: {STAGES: "WHEN"}, restart: {policy: POLICY, backoff: [1ms, 1ms]}}
nodes: {dying: {plugin: dying, process: left}}
"""
PAGE = Path(__file__).parents[2] / "docs/processes.md"
HEAD = "| how it ends"
FATES = [
    "the process left ended with exit code 0, before its nodes had ended",
    "the process left ended with exit code 3",
    "the process left was ended by SIGTERM",
    "the process left was ended by SIGKILL",
    "the process left was ended by SIGSEGV",
]


@pytest.mark.long
def test_every_unasked_end_is_restarted(start, project):
    """Of each end while the nodes run; the rule is the same before that, where one end each shows it."""
    (project / "lives").touch()
    text = RUN.replace("WHEN", "run run run run run import start").replace("POLICY", "on-failure")
    run = start(text, files={"plugins/dying.py": DYING})
    run.wait_for("settled")
    assert run.end() == 130
    (left,) = [each for each in run.report()["processes"] if each["name"] == "left"]
    assert left["fates"] == [*FATES, *FATES[:2]]


@pytest.mark.parametrize(
    ("life", "fate"),
    [(0, FATES[0]), pytest.param(3, FATES[3], marks=pytest.mark.long)],
    ids=["exit code", "signal"],
)
def test_unasked_end_without_restart_fails_run(start, project, life, fate):
    (project / "lives").write_text("." * life)
    text = RUN.replace("WHEN", "run " * len(FATES)).replace("POLICY", "never")
    run = start(text, files={"plugins/dying.py": DYING})
    assert run.end(None) == 1
    assert [line for line in run.lines if line.startswith("error:")] == [f"error: {fate}\n"]


ENDING = """
import os
from pathlib import Path

from busflow import Node, timer


class Ending(Node):
    async def run(self) -> None:
        with Path("lives").open("a") as lives:
            lives.write(f"{os.getpid()}\\n")


class Watching(Node):
    @timer(hz=20)
    def look(self) -> None:
        pids = Path("lives").read_text().split()
        if len(pids) >= int(os.environ["LIVES"]):
            try:
                os.kill(int(pids[-1]), 0)
            except ProcessLookupError:
                self.log.info("settled")
"""
ENDED = """
env: {LIVES: "COUNT"}
processes:
  left: {restart: {policy: POLICY, backoff: [1ms, 1ms]}}
nodes: {ending: {plugin: "ending:Ending", process: left}, watching: {plugin: "ending:Watching"}}
"""


@pytest.mark.parametrize(
    ("policy", "lives"),
    [
        ("never", 1),
        pytest.param("on-failure", 1, marks=pytest.mark.long),
        pytest.param("always", 2, marks=pytest.mark.long),
    ],
)
def test_end_of_all_nodes_restarts_with_always_only(start, project, policy, lives):
    (project / "lives").touch()
    run = start(ENDED.replace("POLICY", policy).replace("COUNT", str(lives)), files={"plugins/ending.py": ENDING})
    run.wait_for("settled")
    assert run.end() == 130
    (left,) = [each for each in run.report()["processes"] if each["name"] == "left"]
    assert (left["restarts"] > 0, left["fates"]) == (policy == "always", [])


def test_page_has_a_row_for_each_end():
    rows = [line.split(" | ") for line in PAGE.read_text(encoding="utf-8").splitlines() if line.count(" | ") == 3]
    (_, *rows) = rows[[row[0] for row in rows].index(HEAD) :][: len(FATES) + 2]
    said = [f"the process left {row[1]}" for row in rows]
    assert said == ["the process left nothing", *FATES]


LEAVING = """
import os
import signal
import subprocess
import sys

from busflow import Node

WAITING = "import signal; signal.pause()"


class Leaving(Node):
    async def start(self) -> None:
        if os.environ["LEAVES"] == "program":
            pid = subprocess.Popen([sys.executable, "-c", WAITING]).pid
        elif (pid := os.fork()) == 0:
            if os.environ["LEAVES"] == "session":
                os.setsid()
            signal.pause()
            os._exit(0)
        self.log.info("left behind", left=pid)
"""


@pytest.fixture
def leaving(start):
    """A run whose node starts another process, and the id of that one; it is killed at the end."""
    left = []

    def leaving(what):
        text = "processes: {left: {env: {LEAVES: WHAT}}}\nnodes: {leaving: {plugin: leaving, process: left}}\n"
        text = text.replace("WHAT", what)
        run = start(text, "-v", files={"plugins/leaving.py": LEAVING})
        run.wait_for("left behind")
        (pid,) = [each["left"] for each in run.log() if each["event"] == "left behind"]
        left.append(pid)
        return run, pid

    yield leaving
    for pid in left:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


@pytest.mark.parametrize("what", ["program", pytest.param("fork", marks=pytest.mark.long)])
def test_killed_process_leaves_nothing_behind(leaving, have_ended, what):
    run, pid = leaving(what)
    run.kill("left")
    assert run.end(None) == 1
    assert have_ended([pid], PATIENCE_S)


def test_forked_process_does_not_delay_the_end(leaving):
    run, _ = leaving("session")
    assert run.end() == 130
    (left,) = [each for each in run.report()["processes"] if each["name"] == "left"]
    assert (left["state"], left["fates"]) == ("ended", [])
    assert not [line for line in run.lines if "in time" in line]
