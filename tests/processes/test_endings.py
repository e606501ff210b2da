"""Endings of a worker process before it is asked to end: one rule for all, in `busflow/processes/worker_process.py`."""

import os
import signal
from contextlib import suppress
from pathlib import Path

import pytest

PATIENCE_S = 60.0

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
    """Each end once, while the nodes run, while they start, and while their file is imported."""
    (project / "lives").touch()
    text = RUN.replace("WHEN", "run run run import start").replace("POLICY", "on-failure")
    run = start(text)
    run.wait_for("settled")
    assert run.end() == 130
    (left,) = [each for each in run.report()["processes"] if each["name"] == "left"]
    assert left["fates"] == FATES


def test_unasked_end_without_restart_fails_run(start, project):
    (project / "lives").touch()
    run = start(RUN.replace("WHEN", "run").replace("POLICY", "never"))
    assert run.end(None) == 1
    assert [line for line in run.lines if line.startswith("error:")] == [f"error: {FATES[0]}\n"]


ENDED = """
env: {LIVES: "COUNT"}
processes:
  left: {restart: {policy: POLICY, backoff: [1ms, 1ms]}}
nodes: {ending: {plugin: "leaving:Ending", process: left}, watching: {plugin: "leaving:Watching"}}
"""


@pytest.mark.parametrize(
    ("policy", "lives"),
    [("never", 1), pytest.param("always", 2, marks=pytest.mark.long)],
)
def test_end_of_all_nodes_restarts_with_always_only(start, project, policy, lives):
    (project / "lives").touch()
    run = start(ENDED.replace("POLICY", policy).replace("COUNT", str(lives)))
    run.wait_for("settled")
    assert run.end() == 130
    (left,) = [each for each in run.report()["processes"] if each["name"] == "left"]
    assert (left["restarts"] > 0, left["fates"]) == (policy == "always", [])


def test_page_has_a_row_for_each_end():
    rows = [line.split(" | ") for line in PAGE.read_text(encoding="utf-8").splitlines() if line.count(" | ") == 3]
    (_, *rows) = rows[[row[0] for row in rows].index(HEAD) :][: len(FATES) + 2]
    said = [f"the process left {row[1]}" for row in rows]
    assert said == ["the process left nothing", *FATES]


@pytest.fixture
def leaving(start):
    """A run whose node starts another process, and the id of that one; it is killed at the end."""
    left = []

    def leaving(what):
        node = "nodes: {leaving: {plugin: 'leaving:Leaving', process: left}}\n"
        run = start(f"processes: {{left: {{env: {{LEAVES: {what}}}}}}}\n{node}", "-v")
        run.wait_for("left behind")
        (pid,) = [each["left"] for each in run.log() if each["event"] == "left behind"]
        left.append(pid)
        return run, pid

    yield leaving
    for pid in left:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def test_killed_process_leaves_nothing_behind(leaving, have_ended):
    run, pid = leaving("program")
    run.kill("left")
    assert run.end(None) == 1
    assert have_ended([pid], PATIENCE_S)


def test_forked_process_does_not_delay_the_end(leaving):
    run, _ = leaving("session")
    assert run.end() == 130
    (left,) = [each for each in run.report()["processes"] if each["name"] == "left"]
    assert (left["state"], left["fates"]) == ("ended", [])
    assert not [line for line in run.lines if "in time" in line]


NOTED = """
nodes: {noting: {plugin: noting, process: left}}
processes: {left: }
record: {to: notes_of_all}
"""


def test_recording_of_a_worker_ends_before_its_link(start, project):
    assert start(NOTED, "--for", "300ms").end(None) == 0
    notes = (project / "notes").read_text().splitlines()
    assert notes == ["_Part begin", "Recorder begin", "Recorder end", "_Part end"]
