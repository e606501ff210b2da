"""`busflow action`: in ROS 2's words, with a node that reaches its goals, rejects, fails and is canceled."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from busflow.cli import main
from busflow.definitions.library import Library
from busflow.interfaces.encoding.description import rihs01
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.launchfile.model.interface_folders import name_folders
from busflow.msgs.action_msgs import CancelGoal
from busflow.wire.zenoh.keys import Token, TokenKind, topic_key
from busflow.wire.zenoh.run_directory import find_run
from busflow.wire.zenoh.session import open_session
from tests.definitions.test_library import write

Captured = pytest.CaptureFixture[str]

ARM = """
import asyncio

from busflow import ActionType, Message, Node, RunningGoal, action, action_client
from busflow.msgs.example_interfaces import Fibonacci


class MoveTo(ActionType, package="my_robot"):
    class Goal(Message):
        angle: float = 0.0
        name: str = ""

    class Result(Message):
        angle: float = 0.0

    class Feedback(Message):
        left: float = 0.0


class Counting(Node):
    '''The server of ROS 2's tutorials.'''

    @action(Fibonacci, "/fibonacci")
    async def count(self, goal: RunningGoal[Fibonacci]) -> Fibonacci.Result:
        found = [0, 1]
        for _ in range(goal.request.order - 1):
            found.append(found[-1] + found[-2])
            goal.feedback(Fibonacci.Feedback(sequence=found))
        return Fibonacci.Result(sequence=found)


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


LAUNCH = """
name: room
plugins: [plugins]
nodes:
  arm: {plugin: "arm:Arm"}
  counting: {plugin: "arm:Counting"}
"""
HOLD = {"src/grip_msgs/action/Hold.action": "float64 seconds 2\n---\nbool held\n---\nfloat64 left\n"}


@pytest.fixture(scope="module")
def room(stand: Callable[..., Any]) -> Any:
    """The place of a run of an arm."""
    place, run = stand("room", LAUNCH, {"arm": ARM})
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


MOVE_TO = "my_robot/action/MoveTo"
FIBONACCI = "example_interfaces/action/Fibonacci"


@pytest.mark.parametrize(
    ("command", "printed"),
    [
        ("list", "/arm/move\n/fibonacci\n/nobody/move\n"),
        ("list -t", f"/arm/move [{MOVE_TO}]\n/fibonacci [{FIBONACCI}]\n/nobody/move [{MOVE_TO}]\n"),
        ("list -c", "3\n"),
        ("type arm/move", "my_robot/action/MoveTo\n"),
        ("find my_robot/MoveTo", "/arm/move\n/nobody/move\n"),
        ("find -c my_robot/MoveTo", "2\n"),
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


def test_fibonacci_prints_what_ros_prints(capsys: Captured):
    """Line by line what the tests of `ros2 action send_goal` expect of its own server."""
    code, out, err = asked(capsys, "send_goal", "-f", "/fibonacci", FIBONACCI, "{order: 3}")
    assert (code, err) == (0, "")
    sequences = [[0, 1, 1], [0, 1, 1, 2]]
    lists = [["    sequence:", *(f"    - {number}" for number in numbers), ""] for numbers in sequences]
    assert re.sub("ID: [0-9a-f]{32}\n", "ID: #\n", out).splitlines() == [
        *("Waiting for an action server to become available...", "Sending goal:", "     order: 3", ""),
        *("Goal accepted with ID: #", ""),
        *(line for each in lists for line in ("Feedback:", *each)),
        *("Result:", *lists[-1], "Goal finished with status: SUCCEEDED"),
    ]


def test_goal_prints_its_way_as_in_ros(capsys: Captured):
    code, out, err = asked(capsys, "send_goal", "-f", "arm/move", "my_robot/action/MoveTo", "{angle: 2, name: up}")
    assert (code, err) == (0, "")
    accepted = next(line for line in out.splitlines() if line.startswith("Goal accepted with ID: "))
    assert len(accepted.split()[-1]) == 32
    assert out.replace(accepted, "Goal accepted with ID: …") == (
        "Waiting for an action server to become available...\n"
        "Sending goal:\n     angle: 2.0\n     name: up\n\n"
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
        (["cancel", "arm/move", "seven"], 2, "'seven' is not the identifier of a goal"),
        (["cancel", "arm/move", "07" * 16], 4, "/arm/move: no goal has this identifier"),
    ],
)
def test_mistake_is_one_clear_error(capsys: Captured, command: list[str], code: int, said: str):
    found, out, err = asked(capsys, *command)
    assert (found, said in out + err) == (code, True), out + err
    assert "Traceback" not in err


def test_rejection_is_in_ros_words_with_its_reason(capsys: Captured):
    _, out, err = asked(capsys, "send_goal", "arm/move", MOVE_TO, "{angle: 1e9}")
    assert out.endswith("\n\nGoal was rejected.\n")
    assert err == "error: the goal was rejected: out of reach\n"
    _, out, _ = asked(capsys, "send_goal", "--json", "arm/move", MOVE_TO, "{angle: 1e9}")
    assert json.loads(out)["error"]["code"] == "goal-rejected"


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
        assert read_until(process, "Goal canceled.")
        assert read_until(process, "Goal finished with status: CANCELED")
    assert process.returncode == 1


def test_goals_are_listed_and_canceled(capsys: Captured, room: Any):
    with send(room, "--json") as process:
        goal = json.loads(read_until(process, "accepted"))["accepted"]
        _, out, _ = asked(capsys, "goals", "arm/move", "--json")
        assert {each["id"]: each["state"] for each in json.loads(out)["goals"]}[goal] == "EXECUTING"
        assert asked(capsys, "cancel", "arm/move", goal)[:2] == (0, f"{goal}\n")
        ended = json.loads(read_until(process, "status"))
    assert (ended["status"], ended.get("reason")) == ("CANCELED", None)
    assert asked(capsys, "cancel", "arm/move", goal)[2].strip() == "error: /arm/move: the goal has ended already"
    (line,) = [line for line in asked(capsys, "goals", "arm/move")[1].splitlines() if goal in line]
    assert re.fullmatch(rf"{goal}  CANCELED +\d{{4}}-\d\d-\d\d \d\d:\d\d:\d\d", line)


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


class Stranger:
    """A program in the run that is not busflow's and says nothing of its types, as a node of ROS 2: it holds things."""

    def __init__(self, folder: Path) -> None:
        """Serve the action `/stranger/hold`, whose definition is in a folder."""
        self.session = open_session(find_run().directory, listen="stranger.sock")
        self.files = Library([folder])
        self.tokens: list[Any] = []
        self.serve("send_goal", "grip_msgs/action/Hold_SendGoal", {"accepted": True})
        self.serve("get_result", "grip_msgs/action/Hold_GetResult", {"status": 4, "result": {"held": True}})
        self.serve("cancel_goal", "action_msgs/srv/CancelGoal", {"return_code": 1})

    def serve(self, part: str, type_name: str, answer: dict[str, Any]) -> None:
        """Give each request of a service this answer."""
        service = f"/stranger/hold/_action/{part}"
        if type_name in self.files:
            type_hash, response = rihs01(self.files.description(type_name)), self.files.foreign(f"{type_name}_Response")
            payload = response.encode(answer)
        else:
            type_hash = TypeSupport(CancelGoal).type_hash
            payload = bytes(TypeSupport(CancelGoal.Response).encode(CancelGoal.Response(**answer)))
        key = topic_key(service, type_name, type_hash)

        def reply(query: Any) -> None:
            query.reply(key, payload, attachment=query.attachment)

        end = ("/", "stranger", service, type_name, type_hash, "::,10:,:,:,,")
        token = Token(str(self.session.info.zid()), 0, len(self.tokens) + 1, TokenKind.SERVICE, *end)
        self.tokens += [
            self.session.declare_queryable(key, reply, complete=True),
            self.session.liveliness().declare_token(str(token)),
        ]


@pytest.fixture
def stranger(tmp_path: Path) -> Iterator[Path]:
    """The folder of definition files that describe what the stranger serves."""
    found = Stranger(write(tmp_path, HOLD) / "src")
    yield tmp_path / "src"
    found.session.close()
    name_folders([])


def test_definition_files_suffice_for_a_strange_server(capsys: Captured, stranger: Path):
    goal = ("stranger/hold", "grip_msgs/action/Hold", "{seconds: 3}")
    code, out, err = asked(capsys, "send_goal", "--wait", "60s", "--interfaces", str(stranger), *goal)
    assert (code, err) == (0, "")
    assert "Sending goal:\n     seconds: 3.0\n" in out
    assert out.endswith("Result:\n    held: true\n\nGoal finished with status: SUCCEEDED\n")
    code, _, err = asked(capsys, "cancel", "--all", "--interfaces", str(stranger), "stranger/hold")
    assert (code, err) == (0, "")
    name_folders([])
    code, _, err = asked(capsys, "send_goal", *goal)
    assert code == 2
    assert "the run does not say what grip_msgs/action/Hold_SendGoal is; " in err
    assert "--interfaces DIR adds types" in err
