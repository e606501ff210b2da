"""`busflow topic echo`: its output beside that of ROS 2 in the same lab, and on unusual topics."""

import json
import re
import signal
import subprocess
import sys
from collections.abc import Callable

import pytest

from busflow.cli import main
from busflow.wire.client.client import join
from busflow.wire.client.known_type import known_type
from tests.cli.conftest import Shell

Captured = pytest.CaptureFixture[str]
Said = Callable[[str], str]

in_the_lab = pytest.mark.usefixtures("lab")
with_odds = pytest.mark.usefixtures("odds")
BUSFLOW = [sys.executable, "-m", "busflow"]
_NUMBER = re.compile(r"-?[0-9]+(\.[0-9]+)?([eE][-+]?[0-9]+)?")


def alike(text: str) -> list[str]:
    """Return the lines without their numbers and the names of joints."""
    return [_NUMBER.sub("#", line).replace("joint_#", "j#") for line in text.splitlines()]


def printed(capsys: Captured, *arguments: str) -> str:
    assert main(["topic", "echo", *arguments]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    return out


@in_the_lab
@pytest.mark.parametrize(
    ("arguments", "capture"),
    [
        ("--once /imu/data", "10_topic_echo_once_imu_data"),
        ("--once imu/data sensor_msgs/msg/Imu", "10_topic_echo_once_imu_data"),
        ("--last 1 imu/data", "10_topic_echo_once_imu_data"),
        ("--once imu/data --field linear_acceleration.z", "32_topic_echo_field"),
        ("--once --csv balance_state", "33_topic_echo_csv"),
    ],
)
def test_output_is_that_of_ros2(capsys: Captured, ros2_said: Said, arguments: str, capture: str):
    assert alike(printed(capsys, *arguments.split())) == alike(ros2_said(capture))


@in_the_lab
def test_message_info_is_that_of_ros2(capsys: Captured, ros2_said: Said):
    lines = printed(capsys, "--once", "/balance_state", "--include-message-info").splitlines()
    said = ros2_said("220_echo_message_info").splitlines()
    assert [line.partition(":")[0] for line in lines] == [line.partition(":")[0] for line in said]
    info = dict(line.split(": ") for line in lines[:4])
    assert int(info["publication_sequence_number"]) > 0  # which ROS 2's own recording did not say
    assert 0 < int(info["source_timestamp"]) <= int(info["received_timestamp"])


@in_the_lab
@pytest.mark.parametrize(
    ("arguments", "capture"),
    [
        ("--once /joint_states", "16_topic_echo_once_joint_states"),
        ("--once --flow-style /joint_states", "34_topic_echo_flow"),
        ("--once --no-arr /joint_states", "35_topic_echo_no_arr"),
    ],
)
def test_joint_states_print_as_ros2(capsys: Captured, ros2_said: Said, arguments: str, capture: str):
    """Compare up to the velocities, which our lab's joints do not have."""
    ours, theirs = (
        alike(text.partition("\nvelocity")[0].replace("frame_id: imu_link", "frame_id: ''"))
        for text in (printed(capsys, *arguments.split()), ros2_said(capture))
    )
    assert ours == theirs


@in_the_lab
def test_raw_is_the_bytes_of_ros2(capsys: Captured, ros2_said: Said):
    ours = printed(capsys, "--once", "--raw", "balance_state")
    theirs = ros2_said("37_topic_echo_raw")
    assert ours[:20] == theirs[:20]
    assert ours == "b'\\x00\\x01\\x00\\x00\\x00\\x00\\x00\\x00\\x00\\x00\\xd0?'\n"


@in_the_lab
def test_count_limits_json_lines(capsys: Captured):
    lines = [json.loads(line) for line in printed(capsys, "imu/data", "-n", "3", "--json").splitlines()]
    assert [line["version"] for line in lines] == [1, 1, 1]
    first = lines[0]["sequence"]
    assert [line["sequence"] for line in lines] == [first, first + 1, first + 2]
    assert lines[0]["message"]["header"]["frame_id"] == "imu_link"
    assert lines[0]["published_ns"] > 1e18


@with_odds
def test_a_filter_chooses(capsys: Captured):
    out = printed(capsys, "numbers", "-n", "2", "--filter", "m.data % 10 == 7", "--csv")
    first, second = map(int, out.splitlines())
    assert (first % 10, second - first) == (7, 10)
    text = printed(capsys, "talk", "--once", "--field", "data", "--filter", "len(m) > 3")
    assert text == "\\x1b[31mred\\u202e\n---\n"


@in_the_lab
@pytest.mark.parametrize(
    "arguments",
    [
        "--field linear_acceleration.q",
        "--filter 'm.data > 3'",
        "--filter 'header.frame_id >'",
        "std_msgs/msg/Float64",
        "--csv --json",
        "--raw --field header",
        "-n 0",
        "--timeout soon",
    ],
)
def test_mistake_is_reported_before_any_message(shell: Shell, arguments: str):
    assert shell(f"topic echo imu/data {arguments}") == 2
    assert shell.out == ""


@with_odds
class TestOdds:
    @pytest.mark.parametrize(
        ("line", "code"),
        [
            ("cmd --timeout 50ms", 1),
            ("talk --once", 0),
            ("talk --once --csv", 0),
            ("note --once", 0),
            ("note --once --csv", 0),
            ("note --once --field marks.x --filter 'm > 1'", 0),
            ("note --once --field marks.y", 4),
            ("map_name --once", 0),  # latched, and printed at once
        ],
    )
    def test_output(self, shell: Shell, line: str, code: int):
        assert shell(f"topic echo {line}", mask={"; known: .*|; did you mean.*": "; …"}) == code

    def test_an_image_is_a_few_lines(self, capsys: Captured):
        lines = printed(capsys, "camera/image", "--once").splitlines()
        assert lines[-4:] == ["- 0", "- 0", "- '...'", "---"]
        assert len(lines) == 10 + 1 + 129 + 1
        lines = printed(capsys, "camera/image", "--once", "-l", "2").splitlines()
        assert lines[-5:] == ["data:", "- 0", "- 0", "- '...'", "---"]
        assert "<sequence type: uint8, length: 6220800>" in printed(capsys, "camera/image", "--once", "--no-arr")
        assert printed(capsys, "camera/image", "--once", "--raw").endswith("... (6220848 bytes)\n")

    @pytest.mark.long
    def test_the_whole_image_is_there_on_request(self, capsys: Captured):
        assert len(printed(capsys, "camera/image", "--once", "--csv", "--full-length").split(",")) == 6_220_800 + 8
        (line,) = printed(capsys, "camera/image", "--once", "--json").splitlines()
        assert len(json.loads(line)["message"]["data"]) == 6_220_800

    def test_escape_sequences_are_shown_not_obeyed(self, capsys: Captured):
        assert "\x1b" not in printed(capsys, "talk", "--once", "--raw")
        assert "\x1b" not in printed(capsys, "talk", "--once", "--json")

    def test_the_last_messages_of_a_volatile_topic(self, capsys: Captured, shell: Shell):
        assert main(["topic", "echo", "numbers", "-n", "6"]) == 0  # there are six by now
        capsys.readouterr()
        assert len(printed(capsys, "numbers", "--last", "5", "--csv").splitlines()) == 5
        assert shell("topic echo numbers --last 6 --csv", mask={r"(?m)^\d+$": "#"}) == 0

    def test_missing_field_is_reported_once(self, shell: Shell):
        assert shell("topic echo note --field marks.y --timeout 1s --filter 'm > 1'") == 1

    def test_topic_of_two_types_is_an_error(self, capsys: Captured, shell: Shell):
        with join() as peer, peer.advertise("/talk", known_type(peer, "std_msgs/msg/Float64")):
            ends = {r"_busflow_cli_\w+": "COMMAND", r"(?m)^(\s+/\S+ .*|.*# .*)$": "…"}
            assert shell("topic echo talk --once", mask=ends) == 2
            assert printed(capsys, "talk", "std_msgs/msg/String", "--once").startswith("data: ")
            assert shell("topic info talk", mask=ends) == 0

    def test_one_command_receives_from_another(self):
        with join() as peer, peer.advertise("/new", known_type(peer, "std_msgs/msg/Int64")) as speaker:
            command = [*BUSFLOW, "topic", "echo", "new", "--once"]
            with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as it:
                assert speaker.wait_for_listener(60)
                speaker.publish({"data": 7})
                assert it.communicate(timeout=60) == ("data: 7\n---\n", "")

    def test_a_reader_that_leaves_ends_it_quietly(self):
        command = f"{sys.executable} -m busflow topic echo numbers | head -1; echo ${{PIPESTATUS[0]}}"
        done = subprocess.run(["bash", "-c", command], capture_output=True, text=True)
        assert re.fullmatch(r"data: [0-9]+\n0\n", done.stdout)
        assert done.stderr == ""

    def test_ctrl_c_exits_130_without_traceback(self):
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        with subprocess.Popen([*BUSFLOW, "topic", "echo", "numbers"], **pipes) as it:
            assert it.stdout is not None
            assert it.stdout.readline().startswith(b"data: ")
            it.send_signal(signal.SIGINT)
            _, err = it.communicate(timeout=60)
        assert (it.returncode, err) == (130, b"")
