"""Readers that block, await, are stopped, killed or late, in one process, two and three: they harm only themselves."""

import ast
import json
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from benchmarks.questions import age
from benchmarks.questions.processes import run_launch_file
from busflow.timeouts import VARIABLE

WAYS = ("awaits", "blocks", "late", "stopped", "killed")
DEPTHS, LAST = {"small": 3, "large": 1}, {"small": 400, "large": 40}
WINDOW = 32
"""So many messages may be under way to a reader."""
LAUNCH_FILE = """
processes: {{near: , far: {{restart: always}}}}
nodes:
  writer: {{plugin: "slow_readers:Writer", process: {writer}, parameters: {{ways: [{ways}], alone: {alone}}}}}
"""
READER = """\
  {way}: {{plugin: "slow_readers:Reader", process: {process}, parameters: {{way: {way}}}}}
"""
BESIDE = """\
  beside: {{plugin: "slow_readers:Beside", parameters: {{ways: [{ways}]}}}}
"""
PLACES: dict[int, Any] = {
    1: {"ways": ("awaits", "blocks", "late"), "writer": "main", "reader": "main"},
    2: {"ways": WAYS, "writer": "main", "reader": "far"},
    3: {"ways": WAYS, "writer": "near", "reader": "far"},
}


@dataclass
class Ran:
    """Where it ran, and what came of each topic."""

    processes: int
    outcomes: dict[tuple[str, str, str], tuple[list[int], list[Any]]]
    report: dict[str, Any]
    missing: list[Any]

    def of(self, overflow: str) -> list[tuple[str, str, list[int], list[Any]]]:
        return [(way, size, *found) for (way, of, size), found in self.outcomes.items() if of == overflow]


def launch_file(processes: int) -> str:
    place, alone = PLACES[processes], str(processes == 1).lower()
    ways = ", ".join(place["ways"])
    text = LAUNCH_FILE.format(writer=place["writer"], ways=ways, alone=alone)
    text += "".join(READER.format(way=way, process=place["reader"]) for way in place["ways"])
    return text + (BESIDE.format(ways=ways) if processes > 1 else "")


@pytest.fixture(scope="module", params=[1, pytest.param(2, marks=pytest.mark.long), 3])
def ran(request, start_for_all) -> Ran:
    with pytest.MonkeyPatch.context() as patch:
        # A process that is stopped, or held up by a busy machine, is no blocked one here.
        patch.setenv(VARIABLE, f"{os.environ[VARIABLE]},held_messages=inf,process_silent=inf")
        run = start_for_all(launch_file(request.param), "-v")
    run.wait_for('"done"')
    assert run.end() == 130
    own = [each for each in run.log() if each["event"] == "outcome"]
    outcomes = {
        tuple(each["topic"].split("/")): (ast.literal_eval(each["received"]), ast.literal_eval(each["account"]))
        for each in own
    }
    missing = [(each["topic"], each["received"]) for each in run.log() if each["event"] == "missing"]
    return Ran(request.param, outcomes, run.report(), missing)


def test_each_message_is_accounted_for(ran):
    assert len(ran.outcomes) == 4 * len(PLACES[ran.processes]["ways"])
    for (way, overflow, size), (received, (published, delivered, dropped, drops)) in ran.outcomes.items():
        assert (published, delivered) == (LAST[size] + 1, len(received)), (way, overflow, size)
        assert published == delivered + dropped, (way, overflow, size)
        assert drops in ({}, {"overflow": dropped}), (way, overflow, size)
    for topic in ran.report["topics"]:
        assert topic["losses"] == {}
        for line in topic["subscriptions"]:
            assert line["published"] == line["delivered"] + line["dropped"] + line["queued"] > 0


def test_newest_messages_reach_a_queue_that_drops_its_oldest(ran):
    for way, size, received, _ in ran.of("drop_oldest"):
        last, depth = LAST[size], DEPTHS[size]
        assert received == sorted(set(received)), (way, size)
        assert received[-depth:] == [*range(last - depth + 1, last + 1)], (way, size)
        if way == "awaits":
            assert received[:-depth] == [0]
        elif way == "blocks":
            assert len(received) <= 1 + 2 * depth, (way, size)


def test_oldest_messages_stay_in_a_queue_that_drops_its_newest(ran):
    for way, size, received, _ in ran.of("drop_newest"):
        depth = DEPTHS[size]
        assert received == sorted(set(received)), (way, size)
        assert received[:depth] == [*range(depth)], (way, size)
        if way == "awaits":
            assert received == [*range(1 + depth)]
        elif way == "blocks":
            assert len(received) <= 1 + max(depth, WINDOW) + depth, (way, size)


def test_reader_beside_loses_nothing(ran):
    assert ran.missing == []


OTHER = """\
  other: {{plugin: "slow_readers:Stamper", process: far, parameters: {{topic: other, rate_hz: 200, depth: 500}}}}
  counts: {{plugin: "slow_readers:Blocking", parameters: {{topic: other, depth: 500, seconds: 1000}}}}
"""


@pytest.mark.long
def test_slow_reader_of_10_khz_gets_the_newest_and_delays_no_other_topic():
    pace = age.PACES["8 B, 10 kHz, 200 ms"]
    with tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as folder:
        report = Path(folder) / "report.json"
        text = age.launch_file(pace, age.Way(), 2.0, Path(folder)) + OTHER.format()
        found = run_launch_file(Path(folder), text, "--report", str(report))
        topics = {topic["name"]: topic for topic in json.loads(report.read_text())["topics"]}
    least_s = pace.blocks_s + 2 / pace.rate_hz + 0.005
    assert found["worst s"] < 10 * least_s, "on however busy a machine: the benchmark says how old it is"
    (slow,), (other,) = (topics[name]["subscriptions"] for name in ("/small", "/other"))
    assert other["published"] == other["delivered"] + other["dropped"] + other["queued"] > 200
    assert slow["published"] == slow["delivered"] + slow["dropped"] + slow["queued"] > 1000
    # Messages that are published after the end of the readers' process count as `unmatched`, e.g. the last ones.
    assert other["drops"].keys() <= {"unmatched"}
    assert {"overflow"} <= slow["drops"].keys() <= {"overflow", "unmatched"}
    assert not topics["/small"]["losses"]
