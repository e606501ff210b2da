"""Tests of `listing.py`, `info.py`, `stats.py`, `echo.py`, `measuring.py` and `pub.py`, beside output of ROS 2."""

import json
import re
from collections.abc import Callable

import pytest

from busflow.cli import main

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
    ("arguments", "expected"),
    [
        ("info imu/dta", "there is no topic /imu/dta; did you mean '/imu/data'?"),
        ("type joint_state", "did you mean '/joint_states'?"),
        ("echo imu_data", "did you mean '/imu/data'?"),
        ("hz imu", "there is no topic /imu; "),
        ("find sensor_msgs/msg/Im", "no topic has the type sensor_msgs/msg/Im; did you mean 'sensor_msgs/msg/Imu'?"),
        ("list --run imu_lb", "there is no run 'imu_lb'; did you mean 'imu_lab'?"),
        ("info \x1b[31m", r"there is no topic /\x1b[31m"),
    ],
)
def test_unknown_names_exit_4_with_the_nearest(capsys: Captured, arguments: str, expected: str):
    assert main(["topic", *arguments.split()]) == 4
    out, err = capsys.readouterr()
    assert out == ""
    assert expected in err
    assert len(err.splitlines()) == 1


@in_the_lab
def test_json_says_it_with_a_version(capsys: Captured):
    assert main(["topic", "list", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["version"], answer["run"]) == (1, "imu_lab")
    assert {"name": "/imu/data", "types": ["sensor_msgs/msg/Imu"], "publishers": 1, "subscriptions": 1}.items() <= next(
        topic for topic in answer["topics"] if topic["name"] == "/imu/data"
    ).items()
    assert main(["topic", "type", "imu/data", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["types"] == ["sensor_msgs/msg/Imu"]
    assert main(["topic", "find", "sensor_msgs/msg/Imu", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["topics"] == ["/imu/data"]


@in_the_lab
def test_json_info_has_counts_and_declaration_places(capsys: Captured):
    assert main(["topic", "info", "imu/data", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    (subscription,) = answer["subscriptions"]
    assert (subscription["node"], subscription["origin"]) == ("/processor", "Processor.on_imu")
    assert subscription["qos"]["reliability"] == "best_effort"
    accounted = subscription["delivered"] + subscription["dropped"] + subscription["queued"]
    assert subscription["published"] == accounted > 0


@pytest.mark.usefixtures("odds")
def test_hidden_topics_are_shown_on_request(capsys: Captured):
    assert main(["topic", "list"]) == 0
    assert "/_hidden/count" not in capsys.readouterr().out
    assert main(["topic", "list", "--include-hidden-topics"]) == 0
    assert "/_hidden/count\n" in capsys.readouterr().out


@pytest.mark.usefixtures("place")
def test_missing_run_is_exit_4_with_advice(capsys: Captured):
    assert main(["topic", "list"]) == 4
    assert "busflow run FILE" in capsys.readouterr().err


@in_the_lab
def test_stats_shows_each_subscription(capsys: Captured):
    assert main(["topic", "stats", "imu/data"]) == 0
    head, topic, line = (line.split() for line in capsys.readouterr().out.splitlines())
    assert head == ["topic", "type", "published", "rate", "delivered", "dropped", "queued"]
    assert topic[:2] == ["/imu/data", "sensor_msgs/msg/Imu"]
    assert line[1:5] == ["/processor", "depth", "5,", "drop_oldest"]
    assert main(["topic", "stats", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    lines = [line for topic in answer["topics"] for line in topic["subscriptions"]]
    assert {line["node"] for line in lines} == {"/processor"}
    assert all(line["published"] == line["delivered"] + line["dropped"] + line["queued"] for line in lines)


def completed(arguments: str, monkeypatch: pytest.MonkeyPatch, capsys: Captured) -> list[str]:
    monkeypatch.setenv("_BUSFLOW_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", f"busflow {arguments}")
    monkeypatch.setenv("COMP_CWORD", str(len(arguments.split(" "))))
    main([])
    out, err = capsys.readouterr()
    assert err == ""
    return [line.partition(",")[2] for line in out.splitlines() if line]


@in_the_lab
def test_names_are_completed_as_they_are_typed(monkeypatch: pytest.MonkeyPatch, capsys: Captured):
    assert completed("topic echo im", monkeypatch, capsys) == ["imu/data"]
    assert completed("topic hz imu/data /j", monkeypatch, capsys) == ["/joint_states"]
    assert completed("topic find sensor", monkeypatch, capsys) == ["sensor_msgs/msg/Imu", "sensor_msgs/msg/JointState"]
    assert completed("topic list --run ", monkeypatch, capsys) == ["imu_lab"]


@pytest.mark.usefixtures("place")
def test_completion_without_a_run_is_silent(monkeypatch: pytest.MonkeyPatch, capsys: Captured):
    assert completed("topic echo im", monkeypatch, capsys) == []


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ("echo imu/data --count 0", "--count"),
        ("echo imu/data --csv --json", "exclude each other"),
        ("hz", "NAME"),
        ("bw imu/data --every never", "--every"),
        ("pub cmd std_msgs/msg/Float64 --once --times 2", "--once and --times exclude each other"),
        ("pub cmd std_msgs/msg/Float64 --rate 0", "--rate"),
    ],
)
@pytest.mark.usefixtures("place")
def test_wrong_usage_needs_no_run(capsys: Captured, arguments: str, expected: str):
    assert main(["topic", *arguments.split()]) == 2
    assert expected in capsys.readouterr().err
