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

from busflow.definitions.folders import name_folders
from busflow.definitions.library import Library
from busflow.interfaces.encoding.description import rihs01
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.action_msgs import CancelGoal
from busflow.wire.zenoh.keys import Token, TokenKind, topic_key
from busflow.wire.zenoh.run_directory import find_run
from busflow.wire.zenoh.session import open_session
from tests.cli.conftest import LABS, Shell
from tests.definitions.test_library import write

HOLD = {"src/grip_msgs/action/Hold.action": "float64 seconds 2\n---\nbool held\n---\nfloat64 left\n"}


@pytest.fixture(scope="module")
def room(stand: Callable[..., Any]) -> Any:
    """The place of a run of an arm."""
    place, run = stand(LABS / "room.yaml")
    run.wait_for("works")
    return place


@pytest.fixture(autouse=True)
def arm(room: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The running arm, found by commands of this process."""
    room.look(monkeypatch)


MOVE_TO = "my_robot/action/MoveTo"
SEND = f"send_goal arm/move {MOVE_TO}"
IDENTIFIER = {r"\b[0-9a-f]{32}\b": "UUID", r"and \d+ more": "and # more"}


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("list", 0),
        ("list -t", 0),
        ("list -c", 0),
        ("type arm/move", 0),
        ("find my_robot/MoveTo", 0),
        ("find -c my_robot/MoveTo", 0),
        ("find my_robot/action/Wave", 4),
        ("info -c arm/move", 0),
        ("info -t nobody/move", 0),
        ("info nothing", 4),
        # Line by line the output that the tests of `ros2 action send_goal` expect of its own server.
        ("send_goal -f /fibonacci example_interfaces/action/Fibonacci '{order: 3}'", 0),
        (f"{SEND} -f '{{angle: 2, name: up}}'", 0),
        (f"{SEND} '{{angle: 1e9}}'", 1),
        (f"{SEND} '{{angle: -1}}'", 1),
        (f"{SEND} '{{angel: 1}}'", 2),
        ("send_goal arm/move my_robot/action/Wave", 2),
        (f"send_goal arm/mov {MOVE_TO}", 4),
        (f"send_goal nobody/move {MOVE_TO}", 1),
        ("cancel arm/move", 2),
        ("cancel arm/move seven", 2),
        (f"cancel arm/move {'07' * 16}", 4),
    ],
)
def test_output(shell: Shell, line: str, code: int):
    counts = {r"(?m)^(    /\S+ .*\d+ (goals?|received|called)).*": r"\1 …"}
    assert shell(f"action {line}", mask=IDENTIFIER | counts) == code


@pytest.mark.parametrize(
    ("line", "code"),
    [
        (f"{SEND} '{{angle: 1e9}}'", "goal-rejected"),
        ("send_goal arm/move my_robot/action/Wave", "type"),
        ("cancel arm/move seven", "goal"),
    ],
)
def test_error_is_data_too(shell: Shell, line: str, code: str):
    assert shell.data(f"action {line}", code=None)["error"]["code"] == code


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
        assert read_until(process, "status: CANCELED")
    assert process.returncode == 1


def test_goals_are_listed_and_canceled(shell: Shell, room: Any):
    with send(room, "--json") as process:
        goal = json.loads(read_until(process, "accepted"))["accepted"]
        states = {each["id"]: each["state"] for each in shell.data("action goals arm/move")["goals"]}
        assert states[goal] == "EXECUTING"
        assert shell(f"action cancel arm/move {goal}", mask=IDENTIFIER) == 0
        ended = json.loads(read_until(process, "status"))
    assert (ended["status"], ended.get("reason")) == ("CANCELED", None)
    assert shell(f"action cancel arm/move {goal}", mask=IDENTIFIER) == 4
    (line,) = [line for line in shell.text("action goals arm/move").splitlines() if goal in line]
    assert re.fullmatch(rf"{goal}  CANCELED +\d{{4}}-\d\d-\d\d \d\d:\d\d:\d\d", line)


def test_killed_command_leaves_no_goal(shell: Shell, room: Any):
    with send(room, "--json") as process:
        goal = json.loads(read_until(process, "accepted"))["accepted"]
        assert shell.data("action echo arm/move -n 1")["message"]["feedback"].keys() == {"left"}
        process.kill()
    state = ""
    while state != "CANCELED":
        state = {each["id"]: each["state"] for each in shell.data("action goals arm/move")["goals"]}[goal]
        assert state in ("EXECUTING", "CANCELING", "CANCELED")


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


def test_definition_files_suffice_for_a_strange_server(shell: Shell, stranger: Path):
    goal = ("stranger/hold", "grip_msgs/action/Hold", "{seconds: 3}")
    assert shell("action send_goal --wait 60s --interfaces", str(stranger), *goal, mask=IDENTIFIER) == 0
    assert shell("action cancel --all stranger/hold --interfaces", str(stranger)) == 0
    name_folders([])
    assert shell("action send_goal", *goal) == 2
