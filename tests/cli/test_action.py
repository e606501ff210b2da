"""`busflow action`: in ROS 2's words, with a node that reaches its goals, rejects, fails and is canceled."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

from busflow.cli import main

Captured = pytest.CaptureFixture[str]

ARM = """
import asyncio

from busflow import ActionType, Message, Node, RunningGoal, action, action_client


class MoveTo(ActionType, package="my_robot"):
    class Goal(Message):
        angle: float = 0.0
        name: str = ""

    class Result(Message):
        angle: float = 0.0

    class Feedback(Message):
        left: float = 0.0


class Arm(Node):
    missing = action_client(MoveTo, "nobody/move")

    async def run(self) -> None:
        self.log.info("works")

    @action(MoveTo, "~/move", when_busy="parallel")
    async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
        if goal.request.angle < 0:
            raise ValueError("no way \\x1b[31mback")
        left = goal.request.angle
        while left > 0:
            await self.clock.sleep(0.01)
            left -= 1
            goal.feedback(MoveTo.Feedback(left=left))
        return MoveTo.Result(angle=goal.request.angle)

    @move.accepts
    def reachable(self, request: MoveTo.Goal) -> bool | str:
        return request.angle < 1e6 or "out of reach"
"""


@pytest.fixture(scope="module")
def room(stand: Callable[..., Any]) -> Any:
    """The place of a run of an arm."""
    place, run = stand("room", "name: room\nplugins: [plugins]\nnodes:\n  arm:\n    plugin: arm\n", {"arm": ARM})
    run.wait_for("works")
    return place


@pytest.fixture(autouse=True)
def arm(room: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The running arm, found by commands of this process."""
    room.look(monkeypatch)


def asked(capsys: Captured, *command: str) -> tuple[int, str, str]:
    code = main(["action", *command])
    out, err = capsys.readouterr()
    return code, out, err


@pytest.mark.parametrize(
    ("command", "printed"),
    [
        ("list", "/arm/move\n/nobody/move\n"),
        ("list -t", "/arm/move [my_robot/action/MoveTo]\n/nobody/move [my_robot/action/MoveTo]\n"),
        ("list -c", "2\n"),
        ("type arm/move", "my_robot/action/MoveTo\n"),
        ("find my_robot/MoveTo", "/arm/move\n/nobody/move\n"),
        ("info -c arm/move", "Action: /arm/move\nAction clients: 0\nAction servers: 1\n"),
        (
            "info -t nobody/move",
            "Action: /nobody/move\nAction clients: 1\n    /arm [my_robot/action/MoveTo]\n",
        ),
    ],
)
def test_actions_are_shown_in_ros_words(capsys: Captured, command: str, printed: str):
    code, out, _ = asked(capsys, *command.split())
    assert code == 0
    assert out.startswith(printed)


def test_goal_prints_its_way_as_in_ros(capsys: Captured):
    code, out, err = asked(capsys, "send_goal", "-f", "arm/move", "my_robot/action/MoveTo", "{angle: 2, name: up}")
    assert (code, err) == (0, "")
    accepted = next(line for line in out.splitlines() if line.startswith("Goal accepted with ID: "))
    assert len(accepted.split()[-1]) == 32
    assert out.replace(accepted, "Goal accepted with ID: …") == (
        "Waiting for an action server to become available...\n"
        "Sending goal:\n    angle: 2.0\n    name: up\n\n"
        "Goal accepted with ID: …\n\n"
        "Feedback:\n    left: 1.0\n\nFeedback:\n    left: 0.0\n\n"
        "Result:\n    angle: 2.0\n\n"
        "Goal finished with status: SUCCEEDED\n"
    )


@pytest.mark.parametrize(
    ("command", "code", "said"),
    [
        (["send_goal", "arm/move", "my_robot/action/MoveTo", "{angle: 1e9}"], 1, "the goal was rejected: out of reach"),
        (["send_goal", "arm/move", "my_robot/action/MoveTo", "{angel: 1}"], 2, "did you mean 'angle'?"),
        (["send_goal", "arm/move", "my_robot/action/Wave"], 2, "has the type my_robot/action/MoveTo, not my_robot/act"),
        (["send_goal", "arm/mov", "my_robot/action/MoveTo"], 4, "no action /arm/mov; did you mean '/arm/move'?"),
        (["send_goal", "nobody/move", "my_robot/action/MoveTo"], 1, "/nobody/move has clients only, no server"),
        (["info", "nothing"], 4, "there is no action /nothing"),
        (["find", "my_robot/action/Wave"], 4, "no action has the type my_robot/action/Wave"),
        (["cancel", "arm/move"], 2, "give the identifier of one goal, or --all"),
        (["cancel", "arm/move", "seven"], 2, "'seven' is no identifier of a goal"),
        (["cancel", "arm/move", "07" * 16], 4, "/arm/move: no goal has this identifier"),
    ],
)
def test_mistake_is_one_clear_error(capsys: Captured, command: list[str], code: int, said: str):
    found, out, err = asked(capsys, *command)
    assert (found, said in out + err) == (code, True), out + err
    assert "Traceback" not in err


def test_failed_goal_says_why_without_control_characters(capsys: Captured):
    code, out, _ = asked(capsys, "send_goal", "arm/move", "my_robot/action/MoveTo", "{angle: -1}")
    assert code == 1
    assert out.splitlines()[-1].startswith("Goal finished with status: ABORTED: ValueError: no way ")
    assert "\x1b" not in out


def send(room: Any, *options: str) -> subprocess.Popen[str]:
    """A command of its own that sends a goal which takes an hour."""
    command = [sys.executable, "-m", "busflow", "action", "send_goal", *options]
    command += ["arm/move", "my_robot/action/MoveTo", "{angle: 360000}"]
    return subprocess.Popen(command, env=room.environment, stdout=subprocess.PIPE, text=True, bufsize=1)


def read_until(process: subprocess.Popen[str], text: str) -> str:
    """Read the output of a command until a line has this text; that line."""
    assert process.stdout is not None
    return next(line for line in process.stdout if text in line)


def test_ctrl_c_cancels_the_goal(room: Any):
    with send(room) as process:
        read_until(process, "Goal accepted")
        os.kill(process.pid, signal.SIGINT)
        assert read_until(process, "Canceling goal...")
        assert read_until(process, "Goal finished with status: CANCELED")
    assert process.returncode == 1


def test_goals_are_listed_and_canceled(capsys: Captured, room: Any):
    with send(room, "--json") as process:
        goal = json.loads(read_until(process, "accepted"))["accepted"]
        _, out, _ = asked(capsys, "goals", "arm/move", "--json")
        assert {each["id"]: each["state"] for each in json.loads(out)["goals"]}[goal] == "EXECUTING"
        assert asked(capsys, "cancel", "arm/move", goal)[:2] == (0, f"{goal}\n")
        ended = json.loads(read_until(process, "status"))
    assert (ended["status"], ended["reason"]) == ("CANCELED", "canceled")
    assert asked(capsys, "cancel", "arm/move", goal)[2].strip() == "error: /arm/move: the goal has ended already"
    assert goal in asked(capsys, "goals", "arm/move")[1]


def test_killed_command_leaves_no_goal(capsys: Captured, room: Any):
    with send(room, "--json") as process:
        goal = json.loads(read_until(process, "accepted"))["accepted"]
        _, out, _ = asked(capsys, "echo", "arm/move", "-n", "1", "--json")
        assert json.loads(out)["message"]["feedback"].keys() == {"left"}
        process.kill()
    states = ""
    while states != "CANCELED":
        _, out, _ = asked(capsys, "goals", "arm/move", "--json")
        states = {each["id"]: each["state"] for each in json.loads(out)["goals"]}[goal]
        assert states in ("EXECUTING", "CANCELING", "CANCELED")
