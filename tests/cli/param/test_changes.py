"""`busflow param set|load|diff|save|watch`: sets parameters of a running node and writes them to its launch file."""

import json
import shutil
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
from tests.cli.conftest import LABS, Shell


@pytest.fixture(scope="module")
def sensors(stand: Callable[..., Any]) -> Any:
    """The place of a run whose node no test changes."""
    place, run = stand(LABS / "sensors.yaml")
    run.wait_for("works")
    return place


@pytest.fixture
def steady(sensors: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """That run, found by commands of this process."""
    sensors.look(monkeypatch)


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, start_run: Callable[..., Any]) -> Any:
    """A run of sensors.yaml in this folder, whose node a test may change, found by commands of this process."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plugins").mkdir()
    shutil.copy(LABS / "plugins/sensor.py", "plugins")
    shutil.copy(LABS / "sensors.yaml", "sensors.yaml")
    started = start_run(tmp_path, "sensors.yaml")
    started.wait_for("works")
    return started


def got(shell: Shell, name: str) -> object:
    return shell.data(f"param get sensor {name}")["value"]


@pytest.mark.usefixtures("run")
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


@pytest.mark.usefixtures("steady")
@pytest.mark.parametrize("text", ["0483", "1e3", "0x10", "+1", "1.", "true", "TRUE"])
def test_the_fix_for_a_number_shows_it_as_it_is_written(shell: Shell, text: str, tmp_path: Path):
    (tmp_path / "values.yaml").write_text(f"frame_id: {text}\n")
    for command, shown in ((f"set sensor frame_id {text}", f"'\"{text}\"'"), ("load sensor values.yaml", f'"{text}"')):
        data = shell.data(f"param {command.replace('values.yaml', str(tmp_path / 'values.yaml'))}", code=1)
        assert [(each["code"], each["fix"]) for each in data["faults"]] == [("type", f"quote it: {shown}")]


@pytest.mark.usefixtures("run")
def test_parameters_are_set_together_or_not_at_all(shell: Shell):
    assert shell("param set sensor rate_hz 20 noise.imu 99") == 1
    assert got(shell, "rate_hz") == 10.0
    assert shell("param set sensor rate_hz 20 noise.imu 2") == 0
    assert shell("param set sensor rate_hz 30") == 0
    assert got(shell, "rate_hz") == 30.0


@pytest.mark.usefixtures("steady")
@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("sensor rate_hz abc", 1),
        ("sensor rate_hzz 1", 1),
        ("sensor frame_id other", 1),
        ("sensor frame_id -- -link", 1),
        ("sensor noise.imu -1", 1),
        ("sensor noise.imu -.inf", 1),
        ("sensor noise.imu -- -1", 1),
        ("sensor noise.imu 1 --jsn", 2),
        ("sensor noise.imu -x", 2),
        ("sensor noise.imu=0.5", 2),
        ("sensor rate_hz", 2),
        ("sensr rate_hz 1", 4),
    ],
)
def test_refused_value_is_explained(shell: Shell, line: str, code: int):
    assert shell(f"param set {line}") == code


@pytest.mark.usefixtures("steady")
@pytest.mark.parametrize("value", ["99", "-.5e3"])
def test_a_refusal_is_data_too(shell: Shell, value: str):
    answer = shell.data(f"param set sensor noise.imu {value}", code=1)
    assert (answer["version"], answer["changed"], answer["faults"][0]["code"]) == (1, [], "range")


@pytest.mark.usefixtures("run")
def test_dumped_parameters_can_be_loaded(shell: Shell):
    dump = Path("dump.yaml")
    assert main(["param", "set", "sensor", "rate_hz", "20"]) == 0
    assert shell("param dump sensor --output dump.yaml") == 0
    assert main(["param", "set", "sensor", "rate_hz", "30"]) == 0
    assert shell("param load sensor dump.yaml") == 0
    assert got(shell, "rate_hz") == 20.0
    started = load("sensors.yaml", sets=["nodes.sensor.parameters_from=dump.yaml"]).nodes[0].parameters
    assert started.data == {"rate_hz": 20.0, "frame_id": "imu_link", "noise": {"imu": 0.1}}
    dump.write_text("noise: {imu: 3.0}\n")
    assert shell("param load sensor dump.yaml") == 0
    assert got(shell, "noise.imu") == 3.0
    both = "/**: {ros__parameters: {rate_hz: 40, noise: {imu: 1.0}}}\nsensor: {ros__parameters: {noise: {imu: 4.0}}}\n"
    dump.write_text(both)
    assert shell("param load sensor dump.yaml") == 0
    assert (got(shell, "rate_hz"), got(shell, "noise.imu")) == (40.0, 4.0)
    for text, code in (
        ("noise.imu: 99\nrate_h: 1\n", 1),
        ("/left/**: {ros__parameters: {rate_hz: 50}}\n", 2),
        ("[1, 2]\n", 2),
    ):
        dump.write_text(text)
        assert shell("param load sensor dump.yaml") == code


@pytest.mark.usefixtures("run")
def test_diff_and_save_work_on_the_launch_file(shell: Shell):
    assert shell("param diff sensor") == 0
    assert main(["param", "set", "sensor", "rate_hz", "20", "noise.imu", "2.5"]) == 0
    assert shell("param diff sensor") == 3
    assert shell("param save sensor") == 0
    text = Path("sensors.yaml").read_text()
    shell.note(text)
    assert shell("param diff sensor") == 0
    assert shell("param save sensor") == 0
    assert Path("sensors.yaml").read_text() == text
    assert shell("param save talker --into new.yaml") == 2


def test_watch_prints_changes_until_the_run_ends(run: Any, shell: Shell):
    command = [sys.executable, "-u", "-m", "busflow", "param", "watch", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as watch:
        line = ""
        for value in range(20, 200):  # until it has joined, no change is for it
            assert main(["param", "set", "sensor", "rate_hz", str(value)]) == 0
            if line := _line(watch):
                break
        run.stop()
        _, err = watch.communicate(timeout=60)
    answer = json.loads(line)
    assert (answer["version"], answer["node"], answer["name"]) == (1, "/sensor", "rate_hz")
    assert watch.returncode == 0
    shell.note(err)


def _line(process: "subprocess.Popen[str]") -> str:
    """Return a line of output, if one arrives within a moment."""
    import select

    assert process.stdout is not None
    ready, _, _ = select.select([process.stdout], [], [], 0.5)
    return process.stdout.readline() if ready else ""
