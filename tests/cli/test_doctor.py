"""`busflow doctor`: what it finds in graphs that run, and around them."""

import json
import os
import re
import signal
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

Captured = pytest.CaptureFixture[str]


@pytest.fixture
def string() -> ForeignType:
    support = TypeSupport(String)
    return ForeignType(support.name, support.type_hash, support.description)


DRIVEN = """
from busflow import Node, subscription
from busflow.msgs.std_msgs import Float64


class Driven(Node):
    @subscription("cmd_vel")
    def on_command(self, speed: Float64) -> None: ...

    async def start(self) -> None:
        self.log.warning("ready")
"""


SAYS_ONE_THING = """
from busflow import Node, publisher
from busflow.msgs.std_msgs import Float64


class Talker(Node):
    numbers = publisher(Float64, "numbers")

    async def start(self) -> None:
        self.numbers.publish(Float64(data=1.0))
"""


@pytest.fixture
def talk_in_order(project: Path, start_run: Callable[..., Any]) -> None:
    """A run without timers: one that misses ticks, as any does on a busy machine, is a finding."""
    (project / "plugins/talker.py").write_text(SAYS_ONE_THING)
    nodes = "nodes: {talker: {plugin: talker}, listener: {plugin: listener}}"
    (project / "talk.yaml").write_text(f"name: talk\nplugins: [plugins]\n{nodes}\n")
    start_run(project, "talk.yaml").wait_for("heard")


@pytest.mark.e2e
@pytest.mark.usefixtures("talk_in_order")
def test_a_graph_in_order_is_fine(capsys: Captured):
    assert main(["doctor"]) == 0
    captured = capsys.readouterr()
    assert captured.out.splitlines()[0].split() == ["busflow", "0.1.0"]
    (line,) = (line for line in captured.out.splitlines() if line.startswith("talk "))
    assert line.split("  ")[-1].strip().startswith("2 nodes, 2 topics, system clock, answers in ")
    assert captured.out.endswith("\nnothing is wrong\n")


@pytest.mark.e2e
@pytest.mark.usefixtures("talk_in_order")
def test_listening_command_is_no_problem(capsys: Captured, string: ForeignType):
    with join() as peer, join() as other, peer.advertise("/hasty", string, qos="2::,10:,:,:,,"):
        hasty = other.graph().topics["/hasty"]
        with other.listen(hasty, string):
            assert main(["doctor"]) == 0, capsys.readouterr().out


@pytest.mark.e2e
def test_external_topic_is_no_problem(project: Path, start_run: Callable[..., Any], capsys: Captured):
    (project / "plugins/driven.py").write_text(DRIVEN)
    text = "plugins: [plugins]\nnodes: {driven: {plugin: driven}}\ntopics: {/cmd_vel: {external: true}}\n"
    (project / "driven.yaml").write_text(text)
    start_run(project, "driven.yaml").wait_for("ready")
    assert main(["doctor"]) == 0
    assert re.search(r"1 node, 2 topics, .*\nnothing is wrong\n$", capsys.readouterr().out, re.DOTALL)


@pytest.mark.e2e
def test_problems_of_other_processes_have_a_fix(
    project: Path, start_run: Callable[..., Any], capsys: Captured, string: ForeignType
):
    start_run(project, "talk.yaml", "rate_hz:=10").wait_for("heard")
    with join() as peer:
        numbers = peer.type("std_msgs/msg/Float64")
        with peer.advertise("/numbers", string), peer.advertise("/numbers", numbers, qos="2::,10:,:,:,,"):
            assert main(["doctor"]) == 3
            out = capsys.readouterr().out
            assert main(["doctor", "--json"]) == 3
            answer = json.loads(capsys.readouterr().out)
    assert "talk:\nerror: /numbers carries std_msgs/msg/" in out
    assert "reliability: best_effort is offered, reliable is requested" in out
    assert "  fix: set reliability: best_effort on the subscription" in out
    assert {each["code"] for each in answer["findings"]} >= {"type-mismatch", "qos-mismatch"}
    assert {each["run"] for each in answer["findings"]} == {"talk"}
    assert (answer["version"], answer["ok"]) == (1, False)


GRIPPER = '''
from busflow import Node, client, service
from busflow.msgs.std_srvs import Trigger


class Gripper(Node):
    """Drops all it grips."""

    camera = client(Trigger, "camera/take")

    async def start(self) -> None:
        self.log.warning("ready")

    @service(Trigger, "~/grip")
    def grip(self, request: Trigger.Request) -> Trigger.Response:
        raise RuntimeError("it slipped")
'''


@pytest.mark.e2e
def test_failing_calls_and_missing_servers_are_found(project: Path, start_run: Callable[..., Any], capsys: Captured):
    (project / "plugins/gripper.py").write_text(GRIPPER)
    (project / "hand.yaml").write_text("name: hand\nplugins: [plugins]\nnodes: {gripper: {plugin: gripper}}\n")
    start_run(project, "hand.yaml").wait_for("ready")
    assert main(["service", "call", "gripper/grip", "std_srvs/srv/Trigger"]) == 1
    capsys.readouterr()
    assert main(["doctor"]) == 3
    out = capsys.readouterr().out
    assert re.search(r"^hand +1 node, 1 topic, system clock, ", out, re.MULTILINE)
    assert out.endswith(
        "\nhand:\n"
        "warning: /gripper calls /camera/take, which has no server\n"
        "  known: /gripper/grip\n"
        "warning: 1 of 1 call of /gripper/grip failed in /gripper\n"
        "  fix: busflow log --level error shows why\n"
        "\n2 findings\n"
    )


@pytest.mark.e2e
def test_messages_lost_on_the_way_in_are_found(project: Path, start_run: Callable[..., Any], capsys: Captured):
    start_run(project, "talk.yaml", "rate_hz:=10").wait_for("heard")
    with join() as peer, peer.advertise("/numbers", peer.type("std_msgs/msg/Float64")) as speaker:
        speaker.publish({"data": 1.0})
        speaker.published += 3  # which are lost between here and there
        speaker.publish({"data": 2.0})
        while not peer.graph().topic("numbers").details["losses"].get("lost"):
            pass
        (answer,) = peer.ask("report")
        assert [topic["losses"] for topic in answer["topics"] if topic["name"] == "/numbers"] == [{"lost": 3}]
        assert main(["doctor"]) == 3
    assert "3 messages on /numbers from other processes never arrived" in capsys.readouterr().out


@pytest.mark.e2e
def test_remains_of_dead_runs_are_removed(project: Path, start_run: Callable[..., Any], place: Any, capsys: Captured):
    run = start_run(project, "talk.yaml")
    run.wait_for("heard")
    os.kill(run.process.pid, signal.SIGKILL)
    run.process.wait()
    assert main(["doctor"]) == 0
    out = capsys.readouterr().out
    assert f"{place.path}: safe; removed what is left of talk\n" in out
    assert "nothing is running" in out
    assert not (place.path / "talk").exists()


def test_folder_open_to_others_is_a_finding(place: Any, capsys: Captured):
    place.path.chmod(0o755)
    assert main(["doctor"]) == 3
    assert "can be opened by others (mode 0755); chmod 700 it" in capsys.readouterr().out


@pytest.mark.e2e
def test_a_run_that_hangs_is_a_finding(project: Path, start_run: Callable[..., Any], capsys: Captured):
    run = start_run(project, "talk.yaml")
    run.wait_for("heard")
    run.process.send_signal(signal.SIGSTOP)
    assert main(["doctor", "--run", "talk"]) == 3
    out = capsys.readouterr().out
    assert "talk     does not answer" in out
    assert "run_sync" in out


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
async def test_machines_processes_and_programs_are_findings(looked_at: Callable[..., Any]):
    async with looked_at(Node) as looked:
        peer, ask = looked.peer, looked.peer.ask
        peer.run = replace(peer.run, card=replace(peer.run.card, file="/lab/robot.yaml"))
        peer.ask = lambda question, **words: [
            each | FACTS if question == "run" else each for each in ask(question, **words)
        ]
        found = {each.code: each.message for each in await looked.ask(problems_in, peer)}
    assert found["machine-missing"] == "the machine arm is not linked: nothing listens"
    assert found["other-version"].startswith("the machine leg has busflow 0.0.1, and the run's own machine ")
    assert found["process-restarted"].endswith(" was started anew 2 times")
    end = "the last time, it ended with exit code 3"
    assert found["program-restarted"] == f"the program /camera was started anew 1 time; {end}"
    assert found["program-waits"].startswith("the program /lidar has not started")
