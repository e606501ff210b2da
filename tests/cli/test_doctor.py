"""`busflow doctor`: what it finds in graphs that run, and around them."""

import os
import signal
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from busflow import Node
from busflow.cli import main
from busflow.cli.doctor import problems_in
from busflow.interfaces.encoding.foreign import ForeignType
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.std_msgs import String
from busflow.wire.client.client import join
from tests.cli.conftest import LABS, Shell
from tests.golden import Golden

ENDS = {r"_busflow_cli_\w+": "COMMAND", r"std_msgs/msg/\w+ \([^)]*\)": "TYPE (NODES)"}
MACHINE = {
    r"process \d+": "process PID",
    r"(?m)^(busflow|Python|Zenoh) .*": r"\1 VERSION",
    r"answers in .*": "answers in #",
    r"(?m)^(\w+) +(\d+ nodes?, )": r"\1  \2",
}


@pytest.fixture
def string() -> ForeignType:
    support = TypeSupport(String)
    return ForeignType(support.name, support.type_hash, support.description)


@pytest.fixture
def talk_in_order(start_run: Callable[..., Any]) -> None:
    """A run without timers: one that misses ticks, as any does on a busy machine, is a finding."""
    start_run(LABS, "quiet_talk.yaml").wait_for("heard")


@pytest.mark.e2e
@pytest.mark.usefixtures("talk_in_order")
def test_a_graph_in_order_is_fine(shell: Shell, string: ForeignType):
    assert shell("doctor", mask=MACHINE) == 0
    with join() as peer, join() as other, peer.advertise("/hasty", string, qos="2::,10:,:,:,,"):
        hasty = other.graph().topics["/hasty"]
        with other.listen(hasty, string):  # which is a command, and no problem
            assert shell.data("doctor")["findings"] == []


@pytest.mark.e2e
def test_external_topic_is_no_problem(start_run: Callable[..., Any], shell: Shell):
    start_run(LABS, "driven.yaml").wait_for("ready")
    assert shell("doctor", mask=MACHINE) == 0


@pytest.mark.e2e
def test_problems_of_other_processes_have_a_fix(
    project: Path, start_run: Callable[..., Any], shell: Shell, string: ForeignType, golden: Golden
):
    start_run(project, "talk.yaml", "rate_hz:=10").wait_for("heard")
    with join() as peer:
        numbers = peer.type("std_msgs/msg/Float64")
        with peer.advertise("/numbers", string), peer.advertise("/numbers", numbers, qos="2::,10:,:,:,,"):
            answer = shell.data("doctor", code=3)
    found = {each["code"]: each for each in answer["findings"]}
    assert {each["run"] for each in answer["findings"]} == {"talk"}
    assert (answer["version"], answer["ok"]) == (1, False)
    for code in ("type-mismatch", "qos-mismatch"):  # a busy machine may have more
        golden(f"{found[code]['message']}\n  fix: {found[code]['fix']}", code, mask=ENDS)


@pytest.mark.e2e
def test_failing_calls_and_missing_servers_are_found(start_run: Callable[..., Any], shell: Shell):
    start_run(LABS, "hand.yaml").wait_for("ready")
    assert main(["service", "call", "gripper/grip", "std_srvs/srv/Trigger"]) == 1
    assert shell("doctor", mask=MACHINE) == 3


@pytest.mark.e2e
def test_messages_lost_on_the_way_in_are_found(project: Path, start_run: Callable[..., Any], shell: Shell):
    start_run(project, "talk.yaml", "rate_hz:=10").wait_for("heard")
    with join() as peer, peer.advertise("/numbers", peer.type("std_msgs/msg/Float64")) as speaker:
        speaker.publish({"data": 1.0})
        speaker.published += 3  # which are lost between here and there
        speaker.publish({"data": 2.0})
        while not peer.graph().topic("numbers").details["losses"].get("lost"):
            pass
        (answer,) = peer.ask("report")
        assert [topic["losses"] for topic in answer["topics"] if topic["name"] == "/numbers"] == [{"lost": 3}]
        (lost,) = [each for each in shell.data("doctor", code=3)["findings"] if each["code"] == "lost-on-the-way-in"]
    shell.note(lost["message"])


@pytest.mark.e2e
def test_remains_of_dead_runs_are_removed(project: Path, start_run: Callable[..., Any], place: Any, shell: Shell):
    run = start_run(project, "talk.yaml")
    run.wait_for("heard")
    os.kill(run.process.pid, signal.SIGKILL)
    run.process.wait()
    assert shell("doctor", mask=MACHINE) == 0
    assert not (place.path / "talk").exists()
    place.path.chmod(0o755)
    assert shell("doctor", mask=MACHINE) == 3


@pytest.mark.e2e
def test_a_run_that_hangs_is_a_finding(project: Path, start_run: Callable[..., Any], shell: Shell):
    run = start_run(project, "talk.yaml")
    run.wait_for("heard")
    run.process.send_signal(signal.SIGSTOP)
    (finding,) = shell.data("doctor --run talk", code=3)["findings"]  # its words depend on when the signal arrives
    assert finding["code"] == "silent"
    assert "talk" in finding["message"]
    assert "run_sync" in finding["fix"]


@pytest.mark.usefixtures("place")
def test_missing_zenoh_is_a_finding(shell: Shell, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "zenoh", None)
    assert [each["code"] for each in shell.data("doctor", code=3)["findings"]] == ["no-zenoh"]


@pytest.mark.usefixtures("place")
def test_a_run_that_is_not_there():
    assert main(["doctor", "--run", "talk"]) == 4


FACTS = {
    "machines": {
        "arm": {"linked": False, "reason": "nothing listens"},
        "leg": {"linked": True, "reason": "", "version": "0.0.1"},
    },
    "restarts": 2,
    "programs": [
        {"program": "/camera", "state": "running", "restarts": 1, "last_failure": "it ended with exit code 3"},
        {"program": "/lidar", "state": "waiting", "restarts": 0, "last_failure": ""},
    ],
}
"""What the main process of a run with machines, processes and programs answers besides."""


@pytest.mark.asyncio
async def test_machines_processes_and_programs_are_findings(looked_at: Callable[..., Any], golden: Golden):
    async with looked_at(Node) as looked:
        peer, ask = looked.peer, looked.peer.ask
        peer.run = replace(peer.run, card=replace(peer.run.card, file="/lab/robot.yaml"))
        peer.ask = lambda question, **words: [
            each | FACTS if question == "run" else each for each in ask(question, **words)
        ]
        found = {each.code: each.message for each in await looked.ask(problems_in, peer)}
    golden("\n".join(f"{code}: {found[code]}" for code in sorted(found)), mask={r"machine has .*": "machine has …"})
