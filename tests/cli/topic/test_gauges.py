"""`busflow topic hz`, `bw` and `delay`: their output beside that of ROS 2, and on a topic that drops messages."""

import json
import re
import signal
import subprocess
import sys
from collections.abc import Callable

import pytest

from busflow.cli import main
from tests.cli.conftest import Shell

Captured = pytest.CaptureFixture[str]
Said = Callable[[str], str]

_NUMBER = re.compile(r"[0-9]+(\.[0-9]+)?")


@pytest.mark.usefixtures("lab")
class TestLab:
    @pytest.mark.parametrize(
        ("verb", "capture"),
        [("hz", "11_topic_hz_imu_data"), ("bw", "12_topic_bw_imu_data"), ("delay", "13_topic_delay_imu_data")],
    )
    def test_output_is_that_of_ros2(self, capsys: Captured, ros2_said: Said, verb: str, capture: str):
        assert main(["topic", verb, "/imu/data", "-n", "2", "--every", "300ms"]) == 0
        out, err = capsys.readouterr()
        ours = [_NUMBER.sub("#", line) for line in out.splitlines()]
        theirs = [_NUMBER.sub("#", line) for line in ros2_said(capture).splitlines()]
        assert (ours, err) == (theirs[: len(ours)], "")
        assert len(ours) >= 4

    def test_the_rate_is_counted_at_the_source(self, capsys: Captured):
        assert main(["topic", "hz", "imu/data", "joint_states", "-n", "1", "--json"]) == 0
        lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
        assert [line["topic"] for line in lines] == ["/imu/data", "/joint_states"]
        for line in lines:
            assert line["version"] == 1
            assert line["window"] == line["count"] - 1
            assert (
                0 < line["rate_hz"] < 20
            )  # ten, on a machine that does nothing else; twice as many would be counted twice
            assert line["period_s"]["min"] <= line["period_s"]["mean"] <= line["period_s"]["max"]

    def test_a_topic_without_a_header_has_no_delay(self, shell: Shell):
        assert shell("topic delay balance_state") == 2
        assert shell.data("topic delay balance_state", code=2)["error"]["code"] == "header"

    def test_several_topics_are_named(self, shell: Shell):
        assert shell("topic hz imu/data joint_states -n 1", mask={r"\d+(\.\d+)?": "#"}) == 0

    def test_ctrl_c_prints_the_last_interval(self):
        command = [sys.executable, "-m", "busflow", "topic", "hz", "imu/data", "--every", "0.5"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as it:
            assert it.stdout is not None
            before = [it.stdout.readline() for _ in range(4)]
            it.send_signal(signal.SIGINT)
            out, err = it.communicate(timeout=60)
        assert (it.returncode, err) == (130, "")
        assert all(line.startswith(("average rate: ", "\tmin: ")) for line in [*before, *out.splitlines()])


@pytest.mark.usefixtures("odds")
class TestOdds:
    def test_drops_of_the_interval_are_printed(self, shell: Shell):
        assert shell("topic hz flood -n 1", mask={r"\d+(\.\d+)?": "#"}) == 0
        (flow,) = shell.data("topic hz flood -n 1")["subscriptions"]
        assert flow["drops"] == {"overflow": flow["dropped"]}
        assert 0 < flow["dropped"] < flow["published"]

    def test_an_image_is_measured_to_the_byte(self, shell: Shell):
        assert shell.data("topic bw camera/image -n 1")["size_bytes"]["mean"] == 6_220_800 + 48

    def test_unpublished_topic_is_warned_of(self, shell: Shell):
        assert shell("topic hz cmd -n 2 --every 10ms", mask={"; known: .*|; did you mean.*": "; …"}) == 0
