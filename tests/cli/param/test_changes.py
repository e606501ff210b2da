"""`busflow param set|load|diff|save|watch`: sets parameters of a running node and writes them to its launch file."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from busflow.cli import main
from busflow.cli.options.waiting import Waiting
from busflow.errors import NoSuchTarget
from busflow.launchfile.load.load import load
from busflow.wire.client.client import Peer, join
from busflow.wire.client.graph_view import TopicView

Captured = pytest.CaptureFixture[str]

PUBLISHER = """
from busflow import Node, Parameters, ReadOnly
from pydantic import BaseModel, Field


class Noise(BaseModel, frozen=True, extra="forbid"):
    imu: float = Field(default=0.1, ge=0, le=10)


class SensorParameters(Parameters):
    rate_hz: float = Field(default=10.0, gt=0)
    frame_id: ReadOnly[str] = "imu_link"
    noise: Noise = Noise()


class Sensor(Node):
    parameters: SensorParameters

    async def start(self) -> None:
        self.log.info("works")
"""

LAUNCH = """\
name: sensors
plugins: [plugins]
nodes:
  sensor:  # the only one
    plugin: sensor
    parameters:
      rate_hz: 10.0  # Hz
"""


@pytest.fixture(scope="module")
def sensors(stand: Callable[..., Any]) -> Any:
    """The place of a run whose node no test changes."""
    place, run = stand("sensors", LAUNCH, {"sensor": PUBLISHER})
    run.wait_for("works")
    return place


@pytest.fixture
def steady(sensors: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """That run, found by commands of this process."""
    sensors.look(monkeypatch)


@pytest.fixture
def launch_file(tmp_path: Path, start_run: Callable[..., Any]) -> Path:
    """The launch file of a run of one node, found by commands of this process."""
    (tmp_path / "plugins").mkdir()
    (tmp_path / "plugins/sensor.py").write_text(PUBLISHER)
    file = tmp_path / "sensors.yaml"
    file.write_text(LAUNCH)
    start_run(tmp_path, str(file)).wait_for("works")
    return file


def got(capsys: Captured, name: str) -> object:
    capsys.readouterr()
    assert main(["param", "get", "sensor", name, "--json"]) == 0
    return json.loads(capsys.readouterr().out)["value"]


@pytest.mark.usefixtures("launch_file")
def test_one_is_set_in_ros2_s_words(capsys: Captured):
    assert main(["param", "set", "sensor", "rate_hz", "20"]) == 0
    assert capsys.readouterr() == ("Set parameter successful\n", "")
    assert got(capsys, "rate_hz") == 20.0


@pytest.mark.usefixtures("launch_file")
def test_other_processes_find_and_receive_changes():
    def published(peer: Peer) -> TopicView:
        topic = peer.graph().topic("parameter_events")
        if [end.node for end in topic.publishers] != ["/sensor"]:
            raise NoSuchTarget("the node has not been opened")
        return topic

    with join() as peer:
        topic = Waiting(60.0).until(lambda: published(peer), NoSuchTarget)
        type_ = peer.type(topic.type)
        with peer.listen(topic, type_) as listener:
            assert main(["param", "set", "sensor", "noise.imu", "0.5"]) == 0
            received = listener.get(60)
    assert received is not None
    event = type_.decode(received.payload)
    assert event["node"] == "/sensor"
    assert [(each["name"], each["value"]["double_value"]) for each in event["changed_parameters"]] == [
        ("noise.imu", 0.5)
    ]


@pytest.mark.usefixtures("launch_file")
def test_several_are_set_together_or_not_at_all(capsys: Captured):
    assert main(["param", "set", "sensor", "rate_hz", "20", "noise.imu", "99"]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert "noise.imu must be at most 10, got 99" in err
    assert got(capsys, "rate_hz") == 10.0
    assert main(["param", "set", "sensor", "rate_hz", "20", "noise.imu", "2"]) == 0
    assert "rate_hz: 10.0 → 20.0\n  noise.imu: 0.1 → 2.0" in capsys.readouterr().out


@pytest.mark.usefixtures("steady")
def test_refused_value_is_explained(capsys: Captured):
    for name, value, reason in (
        ("rate_hz", "abc", "rate_hz must be a number, got text 'abc'"),
        ("rate_hzz", "1", "did you mean 'rate_hz'?"),
        ("frame_id", "other", "frame_id is read-only"),
    ):
        assert main(["param", "set", "sensor", name, value]) == 1
        assert reason in capsys.readouterr().err
    assert main(["param", "set", "sensr", "rate_hz", "1"]) == 4
    assert "did you mean '/sensor'?" in capsys.readouterr().err
    assert main(["param", "set", "sensor", "rate_hz"]) == 2
    assert "rate_hz has no value" in capsys.readouterr().err


@pytest.mark.usefixtures("steady")
def test_a_refusal_is_data_too(capsys: Captured):
    assert main(["param", "set", "sensor", "noise.imu", "99", "--json"]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert (answer["version"], answer["changed"], answer["faults"][0]["code"]) == (1, [], "range")


def test_dumped_parameters_can_be_loaded(launch_file: Path, capsys: Captured):
    dump = launch_file.with_name("dump.yaml")
    assert main(["param", "set", "sensor", "rate_hz", "20"]) == 0
    assert main(["param", "dump", "sensor", "--output", str(dump)]) == 0
    assert main(["param", "set", "sensor", "rate_hz", "30"]) == 0
    assert main(["param", "load", "sensor", str(dump)]) == 0
    assert got(capsys, "rate_hz") == 20.0
    started = load(launch_file, sets=[f"nodes.sensor.parameters_from={dump}"]).nodes[0].parameters
    assert started.data == {"rate_hz": 20.0, "frame_id": "imu_link", "noise": {"imu": 0.1}}
    dump.write_text("noise: {imu: 3.0}\n")
    assert main(["param", "load", "sensor", str(dump)]) == 0
    assert got(capsys, "noise.imu") == 3.0
    both = "/**: {ros__parameters: {rate_hz: 40, noise: {imu: 1.0}}}\nsensor: {ros__parameters: {noise: {imu: 4.0}}}\n"
    dump.write_text(both)
    assert main(["param", "load", "sensor", str(dump)]) == 0
    assert (got(capsys, "rate_hz"), got(capsys, "noise.imu")) == (40.0, 4.0)
    dump.write_text("noise.imu: 99\nrate_h: 1\n")
    assert main(["param", "load", "sensor", str(dump)]) == 1
    refusal = capsys.readouterr().err
    assert "dump.yaml:1:12: error: noise.imu must be at most 10, got 99\n" in refusal
    assert "dump.yaml:2:1: error: unknown parameter rate_h\n" in refusal
    dump.write_text("/left/**: {ros__parameters: {rate_hz: 50}}\n")
    assert main(["param", "load", "sensor", str(dump)]) == 2
    assert "dump.yaml has no parameters for /sensor\n" in capsys.readouterr().err
    dump.write_text("[1, 2]\n")
    assert main(["param", "load", "sensor", str(dump)]) == 2
    assert "a mapping is needed" in capsys.readouterr().err


def test_diff_and_save_work_on_the_launch_file(launch_file: Path, capsys: Captured):
    assert main(["param", "diff", "sensor"]) == 0
    assert main(["param", "set", "sensor", "rate_hz", "20", "noise.imu", "2.5"]) == 0
    capsys.readouterr()
    assert main(["param", "diff", "sensor"]) == 3
    assert [line.split()[:4] for line in capsys.readouterr().out.splitlines()] == [
        ["rate_hz", "10.0", "→", "20.0"],
        ["noise.imu", "0.1", "→", "2.5"],
    ]
    assert main(["param", "save", "sensor"]) == 0
    text = launch_file.read_text()
    assert "rate_hz: 20.0  # Hz" in text
    assert "sensor:  # the only one" in text
    assert main(["param", "diff", "sensor"]) == 0
    capsys.readouterr()
    assert main(["param", "save", "sensor"]) == 0
    assert "says so already" in capsys.readouterr().out
    assert launch_file.read_text() == text


@pytest.mark.usefixtures("steady")
@pytest.mark.parametrize(
    ("arguments", "code", "expected"),
    [
        (["noise.imu", "-1"], 1, "noise.imu must be at least 0, got -1\n"),
        (["noise.imu", "-.5e3", "--json"], 1, ""),
        (["noise.imu", "-.inf"], 1, "noise.imu must be "),
        (["noise.imu", "--", "-1"], 1, "got -1\n"),
        (["frame_id", "--", "-link"], 1, "frame_id is read-only"),
        (["noise.imu", "1", "--jsn"], 2, "there is no option --jsn: did you mean '--json'?"),
        (["noise.imu", "-x"], 2, "there is no option -x"),
        (["noise.imu=0.5"], 2, "noise.imu=0.5 has no value: write noise.imu 0.5\n"),
    ],
)
def test_negative_number_is_a_value(capsys: Captured, arguments: list[str], code: int, expected: str):
    assert main(["param", "set", "sensor", *arguments]) == code
    assert expected in capsys.readouterr().err


def test_a_watch_says_that_its_run_has_ended(tmp_path: Path, start_run: Callable[..., Any]):
    (tmp_path / "plugins").mkdir()
    (tmp_path / "plugins/sensor.py").write_text(PUBLISHER)
    (tmp_path / "sensors.yaml").write_text(LAUNCH)
    run = start_run(tmp_path, str(tmp_path / "sensors.yaml"))
    run.wait_for("works")
    command = [sys.executable, "-u", "-m", "busflow", "param", "watch", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as watch:
        for value in range(20, 200):  # until it has joined
            assert main(["param", "set", "sensor", "rate_hz", str(value)]) == 0
            if _line(watch):
                break
        run.stop()
        _, err = watch.communicate(timeout=60)
    assert (watch.returncode, err) == (0, "the run sensors has ended\n")


@pytest.mark.usefixtures("launch_file")
def test_watch_prints_changes_until_the_run_ends():
    command = [sys.executable, "-u", "-m", "busflow", "param", "watch", "sensor", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as watch:
        line = None
        for value in range(20, 200):  # until it has joined, what is set is not for it
            assert main(["param", "set", "sensor", "rate_hz", str(value)]) == 0
            line = _line(watch)
            if line:
                break
        answer = json.loads(line or "{}")
        assert (answer["version"], answer["node"], answer["name"]) == (1, "/sensor", "rate_hz")
        watch.terminate()


def _line(process: "subprocess.Popen[str]") -> str:
    """Return a line of output, if one arrives within a moment."""
    import select

    assert process.stdout is not None
    ready, _, _ = select.select([process.stdout], [], [], 0.5)
    return process.stdout.readline() if ready else ""


def test_save_needs_an_existing_launch_file(capsys: Captured):
    assert main(["param", "save", "talker", "--into", "new.yaml"]) == 2
    output = capsys.readouterr().err
    assert "there is no new.yaml; it has to be a launch file that has the node" in output
    assert "busflow param dump talker --output new.yaml" in output
