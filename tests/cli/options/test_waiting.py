"""`--wait`: commands that are given before the run, the topic or the service is there."""

import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from busflow.cli import main
from busflow.cli.options import waiting
from busflow.cli.options.waiting import Waiting
from busflow.clock import NS_PER_S, SystemClock
from busflow.errors import NoSuchTarget
from busflow.wire.client.client import join
from busflow.wire.client.known_type import known_type
from tests.cli.conftest import Shell

Captured = pytest.CaptureFixture[str]

CALL = ("service", "call", "talker/get_parameter_types", "rcl_interfaces/srv/GetParameterTypes", "{names: [rate_hz]}")


@pytest.fixture
def virtual(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the time of `--wait` pass only between two looks: to join a run takes as long as the machine is busy."""
    now_ns = [0.0]
    monkeypatch.setattr(SystemClock, "monotonic_ns", lambda _: now_ns[-1])
    monkeypatch.setattr(waiting, "sleep", lambda seconds: now_ns.append(now_ns[-1] + seconds * NS_PER_S))


def test_what_comes_in_time_is_found(capsys: Captured):
    looks = iter([NoSuchTarget("no /later"), NoSuchTarget("no /later"), None])

    def find() -> str:
        if missing := next(looks):
            raise missing
        return "/later"

    assert Waiting(60).until(find, NoSuchTarget) == "/later"
    assert capsys.readouterr() == ("", "waiting: no /later\n")


@pytest.mark.usefixtures("lab", "virtual")
@pytest.mark.parametrize(
    "line",
    [
        "topic echo imu/dta --wait 1s",
        "topic hz --wait 1s imu/data imu/dta",
        "topic bw imu/dta --wait=1s",
        "topic delay imu/dta --wait 1",
        "topic hz imu/dta",
    ],
)
def test_wait_ends_with_the_error(shell: Shell, line: str):
    assert shell(line) == 4


@pytest.mark.usefixtures("lab")
def test_bare_wait_takes_no_name():
    assert main(["topic", "hz", "--wait", "imu/data", "-n", "1", "--every", "10ms"]) == 0
    assert main(["topic", "hz", "imu/data", "-n", "1", "--every", "10ms", "--wait"]) == 0


@pytest.mark.usefixtures("place", "virtual")
def test_wait_is_also_for_the_run(shell: Shell):
    assert shell("", *CALL, "--wait", "10ms") == 4


@pytest.mark.usefixtures("lab")
def test_echo_with_a_type_needs_no_topic(shell: Shell):
    def publish() -> None:
        with join() as peer:
            type_ = known_type(peer, "std_msgs/msg/Int64")
            with peer.advertise("/later", type_) as speaker:
                assert speaker.wait_for_listener(60)
                speaker.publish({"data": 7})

    publisher = threading.Thread(target=publish)
    publisher.start()
    assert shell.text("topic echo later std_msgs/Int64 --once --timeout 60") == "data: 7\n---\n"
    publisher.join()
    assert shell("topic echo never std_msgs/Int64 --timeout 10ms", mask={"; known: .*; waiting": "; …; waiting"}) == 1


@pytest.mark.long
def test_commands_wait_for_a_later_run(project: Path, place: Any, start_run: Callable[..., Any]):
    commands = [CALL, ("topic", "hz", "numbers", "-n", "1"), ("topic", "echo", "numbers", "--once")]
    waiting = [
        subprocess.Popen(
            [sys.executable, "-m", "busflow", *command, "--wait"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=place.environment,
        )
        for command in commands
    ]
    for each in waiting:
        assert each.stderr is not None
        assert each.stderr.readline().startswith("waiting: ")
    start_run(project, "talk.yaml")
    answers = [each.communicate(timeout=60)[0] for each in waiting]
    assert [each.returncode for each in waiting] == [0, 0, 0]
    for answer, part in zip(answers, ("types=[3]", "average rate: ", "data: "), strict=True):
        assert part in answer
