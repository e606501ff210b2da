"""Tests of `listing.py`, `info.py`, `stats.py`, `echo.py`, `measuring.py` and `pub.py`, beside output of ROS 2."""

import re
from collections.abc import Callable

import pytest

from busflow.cli import main
from tests.cli.conftest import Shell

Captured = pytest.CaptureFixture[str]
Said = Callable[[str], str]

in_the_lab = pytest.mark.usefixtures("lab")
_ELSEWHERE = ("/parameter_events", "/rosout")
"""Topics on which every node of ROS 2 has an endpoint."""
_GID = re.compile("GID: [0-9a-f.]+")


def of_the_lab(text: str) -> str:
    return "".join(line for line in text.splitlines(keepends=True) if not any(word in line for word in _ELSEWHERE))


@in_the_lab
@pytest.mark.parametrize(
    ("arguments", "capture"),
    [
        ("list", "04_topic_list"),
        ("list -t", "05_topic_list_t"),
        ("list --show-types", "05_topic_list_t"),
        ("list -v", "06_topic_list_v"),
        ("info /imu/data", "08_topic_info_imu_data"),
        ("info joint_states", "14_topic_info_joint_states"),
        ("info balance_state", "20_topic_info_balance_state"),
        ("info -v balance_state", "21_topic_info_v_balance_state"),
        ("info -v joint_states", "15_topic_info_v_joint_states"),
        ("find sensor_msgs/msg/Imu", "38_topic_find"),
        ("find sensor_msgs/Imu", "38_topic_find"),
        ("type imu/data", "39_topic_type"),
    ],
)
def test_output_is_that_of_ros2(capsys: Captured, ros2_said: Said, arguments: str, capture: str):
    assert main(["topic", *arguments.split()]) == 0
    out, err = capsys.readouterr()
    assert (_GID.sub("GID: #", of_the_lab(out)), err) == (_GID.sub("GID: #", of_the_lab(ros2_said(capture))), "")


@in_the_lab
def test_count_is_that_of_the_list(capsys: Captured):
    assert main(["topic", "list", "-c"]) == 0
    count = int(capsys.readouterr().out)
    assert main(["topic", "list"]) == 0
    assert count == len(capsys.readouterr().out.splitlines())
    assert main(["topic", "find", "-c", "std_msgs/msg/Float64"]) == 0
    assert capsys.readouterr().out == "2\n"


@in_the_lab
@pytest.mark.parametrize(
    "line",
    [
        "info imu/dta",
        "type joint_state",
        "echo imu_data",
        "hz imu",
        "find sensor_msgs/msg/Im",
        "list --run imu_lb",
        "info '\x1b[31m'",
    ],
)
def test_unknown_names_exit_4_with_the_nearest(shell: Shell, line: str):
    assert shell(f"topic {line}", mask={"; known: .*": "; known: …"}) == 4
    assert shell.out == ""


@in_the_lab
def test_json_says_it_with_a_version(shell: Shell):
    answer = shell.data("topic list")
    assert (answer["version"], answer["run"]) == (1, "imu_lab")
    assert {"name": "/imu/data", "types": ["sensor_msgs/msg/Imu"], "publishers": 1, "subscriptions": 1}.items() <= next(
        topic for topic in answer["topics"] if topic["name"] == "/imu/data"
    ).items()
    assert shell.data("topic type imu/data")["types"] == ["sensor_msgs/msg/Imu"]
    assert shell.data("topic find sensor_msgs/msg/Imu")["topics"] == ["/imu/data"]


@in_the_lab
def test_json_info_has_counts_and_declaration_places(shell: Shell):
    (subscription,) = shell.data("topic info imu/data")["subscriptions"]
    assert (subscription["node"], subscription["origin"]) == ("/processor", "Processor.on_imu")
    assert subscription["qos"]["reliability"] == "best_effort"
    accounted = subscription["delivered"] + subscription["dropped"] + subscription["queued"]
    assert subscription["published"] == accounted > 0


@pytest.mark.usefixtures("odds")
def test_hidden_topics_are_shown_on_request(shell: Shell):
    assert "/_hidden/count" not in shell.text("topic list")
    assert "/_hidden/count\n" in shell.text("topic list --include-hidden-topics")


@in_the_lab
def test_stats_shows_each_subscription(shell: Shell):
    assert shell("topic stats imu/data", mask={r"\d+(\.\d+)? +(Hz)?": "# ", r"\b\d+$": "#", " {2,}": "  "}) == 0
    lines = [line for topic in shell.data("topic stats")["topics"] for line in topic["subscriptions"]]
    assert {line["node"] for line in lines} == {"/processor"}
    assert all(line["published"] == line["delivered"] + line["dropped"] + line["queued"] for line in lines)


@pytest.mark.usefixtures("place")
def test_completion_without_a_run_is_silent(completed: Callable[[str], list[str]]):
    assert completed("topic echo im") == []


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("list", 4),
        ("echo imu/data --count 0", 2),
        ("hz", 2),
        ("bw imu/data --every never", 2),
        ("pub cmd std_msgs/msg/Float64 --once --times 2", 2),
        ("pub cmd std_msgs/msg/Float64 --rate 0", 2),
    ],
)
@pytest.mark.usefixtures("place")
def test_without_a_run(shell: Shell, line: str, code: int):
    assert shell(f"topic {line}") == code
