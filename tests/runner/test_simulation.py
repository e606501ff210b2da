"""Whole runs on simulated time: from the command line, from a launch file, from Python."""

import json
from pathlib import Path

import pytest

import busflow
from busflow.cli import main
from busflow.clock import SIM_EPOCH_NS, perf_counter
from busflow.errors import NotRunning
from busflow.testing import harness, virtual_time

FOLDER = Path(__file__).parents[2]
LAB = str(FOLDER / "configs/lab1.yaml")


NODES = """
import asyncio

from busflow import Node, publisher, subscription, timer
from busflow.msgs.std_msgs import Float64


class A(Node):
    numbers = publisher(Float64, "numbers")
    count = 0

    @timer(0.1)
    def tick(self) -> None:
        self.count += 1
        self.numbers.publish(Float64(data=self.count))


class B(Node):
    @subscription("numbers")
    async def on_number(self, number: Float64) -> None:
        for _ in range(20):
            await asyncio.sleep(0)
        self.log.info(f"heard {number.data}")
"""


@pytest.fixture
def simulated(tmp_path):
    """A launch file that asks for simulated time."""

    def write(clock):
        path = tmp_path / "simulated.yaml"
        path.write_text(f"include: {LAB}\nclock: {clock}\n")
        return str(path)

    return write


@pytest.fixture
def ran(tmp_path, capsys):
    """What a run reports, logs and traces."""

    def run(*arguments):
        report, trace = tmp_path / "report.json", tmp_path / "trace.txt"
        assert main(["run", *arguments, "--report", str(report), "--trace", str(trace), "--log-format", "json"]) == 0
        lines = capsys.readouterr().err.splitlines()
        return json.loads(report.read_text()), list(map(json.loads, lines)), trace.read_text()

    return run


def published(report):
    return {topic["name"]: topic["published"] for topic in report["topics"]}


def test_ten_minutes_are_run_at_once_and_exactly(ran):
    report, log, trace = ran(LAB, "--sim", "--for", "10min", "--seed", "7")
    assert (report["clock"], report["seed"], report["duration_s"]) == ("sim", 7, 600)
    assert published(report)["/imu/data"] == published(report)["/stability_index"] == 6000
    assert [(line["event"], line["stamp_ns"] - SIM_EPOCH_NS) for line in log] == [
        ("All sensors operational", 500_000_000)
    ]
    assert trace.count(" publish /imu/data ") == 6000
    assert trace.splitlines()[-1].startswith("600.000000000 ")


def test_a_limited_run_ends_while_a_start_fails(ran, tmp_path):
    node = "class Camera(Node):\n    async def start(self):\n        raise OSError('no device')\n"
    (tmp_path / "camera.py").write_text(f"from busflow import Node\n\n\n{node}")
    file = tmp_path / "camera.yaml"
    file.write_text("plugins: [.]\nnodes: {camera: {plugin: camera, restart: on-failure}}\n")
    report, _, _ = ran(str(file), "--sim", "--for", "3s")
    assert report["duration_s"] == 3
    assert report["nodes"][0]["restarts"] > 1


def test_each_seed_is_one_run(ran):
    seven = [ran(LAB, "--sim", "--for", "3s", "--seed", "7")[2] for _ in range(2)]
    assert seven[0] == seven[1]
    assert ran(LAB, "--sim", "--for", "3s", "--seed", "8")[2] != seven[0]


def test_a_harness_traces_what_a_run_traces(ran):
    from busflow.testing.trace import Trace

    lines = []

    @virtual_time
    async def test():
        lab = harness(LAB, seed=7)
        Trace(lab.graph, lines.append)
        async with lab:
            await lab.advance(3)

    test()
    assert "".join(lines) == ran(LAB, "--sim", "--for", "3s", "--seed", "7")[2]


def test_a_launch_file_asks_for_simulated_time(ran, simulated):
    report, log, _ = ran(simulated("{mode: sim, start: 1000000000}"), "--for", "1min")
    assert (report["clock"], published(report)["/imu/data"]) == ("sim", 600)
    assert log[0]["stamp_ns"] == 1_000_000_000_500_000_000


def test_harness_clock_starts_where_the_file_says(simulated):
    @virtual_time
    async def test():
        async with harness(simulated("{mode: sim, start: 5}")) as lab:
            return lab.clock.now().nanoseconds

    assert test() == 5_000_000_000


def test_simulated_time_may_keep_a_rate(ran, simulated):
    began = perf_counter()
    report, _, _ = ran(simulated("{mode: sim, rate: 100}"), "--for", "40s")
    assert 0.4 <= perf_counter() - began < 40  # at the rate of the machine's time it would take 40 s
    assert published(report)["/imu/data"] == 400


def test_run_handles_what_is_due_at_its_end(tmp_path, ran):
    (tmp_path / "nodes.py").write_text(NODES)
    (tmp_path / "chain.yaml").write_text("plugins: [.]\nnodes: {a: {plugin: 'nodes:A'}, b: {plugin: 'nodes:B'}}\n")
    report, log, _ = ran(str(tmp_path / "chain.yaml"), "--sim", "--for", "0.3")
    assert report["timers"][0]["fired"] == 3
    assert [line["event"] for line in log] == ["heard 1.0", "heard 2.0", "heard 3.0"]


def test_trace_on_real_time_has_the_same_lines(ran):
    report, _, trace = ran(LAB, "--for", "0.35s")
    assert report["clock"] == "system"
    assert trace.count(" publish /imu/data ") == published(report)["/imu/data"] > 0


def test_simulated_time_file_is_refused_on_real_time(simulated, golden):
    import asyncio

    async def launch():
        async with busflow.launch(simulated("{mode: sim}")):
            pass

    with golden.raises(NotRunning):
        asyncio.run(launch())


def test_a_program_runs_such_a_file_too(capsys, simulated, tmp_path):
    (tmp_path / "ender.py").write_text(
        "from busflow import Node\n\n\n"
        "class Ender(Node):\n"
        "    async def run(self) -> None:\n"
        "        await self.clock.sleep(60)\n"
        '        raise TimeoutError("a minute is over")\n'
    )
    path = simulated("{mode: sim}")
    Path(path).write_text(Path(path).read_text() + "plugins: [.]\nnodes:\n  ender:\n    plugin: ender\n")
    assert busflow.run(path) == 1
    assert "error: node /ender failed" in capsys.readouterr().err


def test_stalled_run_ends_and_names_waiting_tasks(tmp_path, capsys):
    (tmp_path / "idle.py").write_text("from busflow import Node\n\n\nclass Idle(Node):\n    pass\n")
    (tmp_path / "idle.yaml").write_text("plugins: [.]\nnodes:\n  idle:\n    plugin: idle\n")
    assert main(["run", str(tmp_path / "idle.yaml"), "--sim"]) == 1
    assert capsys.readouterr().err.startswith("error: at 0 s ")
    assert main(["run", str(tmp_path / "idle.yaml"), "--sim", "--for", "1h"]) == 0


@pytest.mark.parametrize("option", ["--report", "--trace"])
def test_unwritable_file_is_reported_before_the_run(option, capsys):
    assert main(["run", LAB, "--sim", "--for", "1s", option, "/proc/none"]) == 2
    assert "cannot write /proc/none" in capsys.readouterr().err
