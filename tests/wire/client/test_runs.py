"""A run's state comes from the answers of its processes; a run that does not answer is listed all the same."""

from pathlib import Path
from typing import Any

import pytest

from busflow import Node, timer
from busflow.wire.client.runs import PresentRun, ask_run, ask_runs
from busflow.wire.zenoh.run_directory import FoundRun, RunCard, find_run


class Idle(Node):
    @timer(hz=1)
    def tick(self) -> None: ...


@pytest.fixture
def card(tmp_path: Path) -> FoundRun:
    return FoundRun(tmp_path, RunCard("robot", 7, 0))


@pytest.mark.parametrize(
    ("states", "state"),
    [
        ({"running": 3}, "running"),
        ({}, "running"),
        ({"running": 2, "failed": 1}, "1 failed"),
        ({"running": 2, "starting": 1}, "starting"),
        ({"restarting": 1, "waiting": 1}, "restarting"),
        ({"stopping": 1, "restarting": 1}, "stopping"),
    ],
)
def test_the_state_is_the_most_urgent(card: FoundRun, states: dict[str, int], state: str):
    assert PresentRun(card, ({"pid": 1, "nodes": 1, "states": states},)).state == state


def test_nodes_of_all_processes_are_counted(card: FoundRun):
    processes: tuple[dict[str, Any], ...] = ({"pid": 7, "nodes": 2}, {"pid": 8, "nodes": 3, "states": {"failed": 2}})
    assert (PresentRun(card, processes).nodes, PresentRun(card, processes).state) == (5, "2 failed")


def test_machines_without_link_are_the_state(card: FoundRun):
    machines = {"arm": {"linked": False, "reason": "nothing listens"}, "leg": {"linked": True, "reason": ""}}
    found = PresentRun(card, ({"pid": 7, "nodes": 1, "machines": machines}, {"pid": 8, "nodes": 1, "machines": {}}))
    assert (found.missing, found.state) == ({"arm": "nothing listens"}, "arm not linked")


def test_a_silent_run_has_no_count(card: FoundRun):
    found = PresentRun(card, silence="it does not answer")
    assert (found.nodes, found.state) == (None, "does not answer")


@pytest.mark.asyncio
async def test_a_running_graph_answers(looked_at: Any):
    async with looked_at(Idle, name="idle") as looked:
        found = await looked.ask(ask_run, find_run("idle"))
        assert (found.state, found.nodes, found.silence) == ("running", 1, "")
        assert [each.run.name for each in await looked.ask(lambda: list(ask_runs()))] == ["idle"]


def test_a_directory_without_a_socket_is_silent(card: FoundRun):
    found = ask_run(card, 0.1)
    assert found.nodes is None
    assert str(card.directory) in found.silence
