"""A run with actions is recorded whole, and each of its sides can be run again on the recording."""

import os
import sys
from contextlib import ExitStack
from pathlib import Path
from subprocess import Popen

import pytest

from busflow.cli import main
from tests.processes.conftest import Run

ARM = """
from tests.actions import conftest


class Arm(conftest.Arm):
    '''An arm.'''
"""
BOSS = """
from busflow import Node, action_client, publisher
from busflow.msgs.std_msgs import Float64
from tests.actions.conftest import MoveTo


class Boss(Node):
    move = action_client(MoveTo, "arm/move")
    reached = publisher(Float64, "reached")

    async def run(self) -> None:
        for angle in (1, 2):
            result = await self.move.run(MoveTo.Goal(angle=angle))
            self.reached.publish(Float64(data=result.angle))
        async with self.move.send(MoveTo.Goal(angle=9)):
            await self.clock.sleep(1.5)
"""


@pytest.fixture
def graph(directory, monkeypatch):
    """A folder with the launch file of an arm and its boss."""
    monkeypatch.chdir(directory)
    text = "name: moves\nplugins: [.]\nnodes:\n  arm: {plugin: arm}\n  boss: {plugin: boss}\n"
    (directory / "graph.yaml").write_text(text)
    return directory


def replays(graph, arm, boss, *options, late=()):
    """Record a run of two nodes, and replay each of them as it was recorded."""
    (graph / "arm.py").write_text(arm)
    (graph / "boss.py").write_text(boss)
    assert main(["run", "graph.yaml", "--record", "moves.mcap", *options]) == 0
    for node in ("arm", "boss"):
        assert main(["replay", "moves.mcap", "graph.yaml", "--node", node, *late]) == 0


def test_all_of_an_action_is_recorded_and_replays(graph, capsys):
    replays(graph, ARM, BOSS, "--sim", "--for", "8s")
    capsys.readouterr()
    assert main(["bag", "info", "moves.mcap"]) == 0
    found = {line.split()[0] for line in capsys.readouterr().out.splitlines() if "/_action/" in line}
    events = {f"/arm/move/_action/{each}/_service_event" for each in ("send_goal", "cancel_goal", "get_result")}
    assert found == events | {"/arm/move/_action/feedback", "/arm/move/_action/status"}


PUSHED_ARM = """
from busflow import subscription
from busflow.msgs.std_msgs import Float64
from tests.actions import conftest


class Arm(conftest.Arm):
    @subscription("push")
    def on_push(self, push: Float64) -> None:
        self.at += push.data
"""
PUSHING_BOSS = """
from busflow import Node, action_client, publisher
from busflow.msgs.std_msgs import Float64
from tests.actions.conftest import MoveTo


class Boss(Node):
    move = action_client(MoveTo, "arm/move")
    push = publisher(Float64, "push")

    async def run(self) -> None:
        async with self.move.send(MoveTo.Goal(angle=3)) as going:
            await self.clock.sleep(1.5)
            self.push.publish(Float64(data=1))
            await going.result()
"""


def test_uncanceled_goal_with_later_inputs_replays(graph, capsys):
    """No recorded answer says that the action has a `cancel_goal`; the first push comes while the goal runs."""
    replays(graph, PUSHED_ARM, PUSHING_BOSS, "--sim", "--for", "8s")
    assert capsys.readouterr().out.count("1 on /arm/move/_action/get_result") == 2


QUICK_ARM = """
from busflow import Node, RunningGoal, action
from tests.actions.conftest import MoveTo


class Arm(Node):
    @action(MoveTo, "~/move")
    async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
        for left in reversed(range(int(goal.request.angle))):
            await self.clock.sleep(0.01)
            goal.feedback(MoveTo.Feedback(left=left))
        return MoveTo.Result(angle=goal.request.angle)
"""
FOLLOWING_BOSS = """
from busflow import Node, action_client, publisher
from busflow.msgs.std_msgs import Float64
from tests.actions.conftest import MoveTo


class Boss(Node):
    move = action_client(MoveTo, "arm/move")
    seen = publisher(Float64, "seen")

    async def run(self) -> None:
        for angle in (3, 2):
            async with self.move.send(MoveTo.Goal(angle=angle)) as going:
                async for feedback in going:
                    self.seen.publish(Float64(data=feedback.left))
                self.seen.publish(Float64(data=(await going.result()).angle))
        async with self.move.send(MoveTo.Goal(angle=90)) as going:
            async for feedback in going:
                break
        self.seen.publish(Float64(data=-1))
"""


def test_random_identifiers_replay_as_recorded(graph, capsys):
    """On the system's time a goal has another identifier in each run; its feedback reaches the client all the same."""
    late = ["--time-tolerance=60s"]  # a machine that is busy starts a run late
    replays(graph, QUICK_ARM, FOLLOWING_BOSS, "--set", "nodes.boss.on_exit=shutdown", late=late)
    assert "8 on /seen" in capsys.readouterr().out


PATIENT_ARM = """
from busflow import Node, RunningGoal, action
from tests.actions.conftest import MoveTo


class Arm(Node):
    @action(MoveTo, "~/move", when_busy="queue")
    async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
        self.log.info("begins")
        try:
            await self.clock.sleep(3600)
        finally:
            self.log.info("ends", why=goal.reason)
        return MoveTo.Result()
"""


def test_goals_of_a_killed_client_replay_as_recorded(graph, monkeypatch, capsys):
    """The cancel that comes of a client's death is in the recording, and so they end in the replay too."""
    (graph / "arm.py").write_text(PATIENT_ARM)
    (graph / "run.yaml").write_text("name: moves\nplugins: [.]\nnodes:\n  arm: {plugin: arm}\n")
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))
    run = Run(graph, graph, "--record", "moves.mcap")
    command = [
        sys.executable,
        "-m",
        "busflow",
        "action",
        "send_goal",
        "arm/move",
        "my_robot/action/MoveTo",
        "--wait=60",
    ]
    with ExitStack() as ended:
        ended.callback(run.process.kill)
        for times in (1, 2):
            sending = ended.enter_context(Popen(command, env={**os.environ, "BUSFLOW_RUNTIME_DIR": str(graph)}))
            run.wait_for("begins", times=times)
            sending.kill()
            run.wait_for("ends", "its client has gone", times=times)
        assert run.end() == 130
    assert main(["replay", "moves.mcap", "run.yaml", "--time-tolerance=60s"]) == 0, capsys.readouterr().out
