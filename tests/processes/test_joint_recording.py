"""Runs of several processes that are recorded, for real: each process its own file, and all of them read as one."""

import json
import signal
from pathlib import Path

import pytest
from rosbags.highlevel import AnyReader

from busflow.cli import main
from busflow.launchfile.load.load import load
from busflow.launchfile.model.description import RecordSpec
from busflow.launchfile.model.placement import placed
from busflow.msgs.std_msgs import Int64
from busflow.processes.joint_recording import JointRecording
from busflow.processes.shares import Shares
from busflow.recording.bag.bag import Bag
from busflow.runner.graph import Graph
from busflow.testing import replay
from tests.processes.conftest import NODES

LAB1 = Path(__file__).parents[2] / "configs/lab1_processes.yaml"

COUNTED = """
name: counted
processes:
  far: {restart: on-failure}
nodes:
  source: {plugin: source, process: far, parameters: {rate_hz: 100.0}}
  sink: {plugin: sink, parameters: {enough: 60}}
"""
CHOSEN = ("--record", "rec", "--record-topics", "numbers", "--record-topics", "/nomber*")


def payloads(bag, topic):
    return [entry.channel.decode(entry.payload, Int64).data for entry in bag.entries([topic])]


@pytest.mark.long
def test_each_process_splits_its_own_file(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("split.yaml").write_text(f"include: [{LAB1}]\nrecord:\n  to: run.mcap\n  split: {{duration: 300ms}}\n")
    assert main(["run", "split.yaml", "--for", "1s", "--report", "out.json"]) == 0
    report = json.loads(Path("out.json").read_text())
    assert report["recording"]["complete"], report["recording"]
    with Bag("run") as bag:
        names = [[file.path.name for file in each.files] for each in bag.series]
        assert [found[:2] for found in names] == [["main_0.mcap", "main_1.mcap"], ["sensors_0.mcap", "sensors_1.mcap"]]
        assert bag.survey().gaps == 0
        assert bag.complete, bag.incomplete
        assert bag.messages == report["recording"]["recorded"]
    for path in ("run", "run/main_1.mcap"):
        assert main(["bag", "verify", path]) == 0, capsys.readouterr().out
    with AnyReader([Path("run")]) as reader:
        assert reader.message_count >= bag.messages


ENDS_LATER = """
name: later
processes: {far: }
nodes:
  source: {plugin: source, process: far, parameters: {rate_hz: 100.0}}
  slow: {plugin: "echoing:Slow", process: far}
  echo: {plugin: "echoing:Echo"}
"""


@pytest.mark.long
def test_replay_leaves_out_messages_after_the_stop(start):
    run = start(ENDS_LATER, "--record", "rec")
    run.wait_for("received enough")
    assert run.end() == 130
    outcome = replay(run.folder / "rec", run.folder / "run.yaml", nodes="echo", time_tolerance_s=60.0)
    assert outcome.same, outcome.render()
    with Bag(run.folder / "rec") as bag:
        counts = {each.topic: each.count for each in bag.channels}
    assert counts["/numbers"] > counts["/echoes"] == outcome.compared["/echoes"] == len(outcome.outputs["/echoes"])


@pytest.mark.long
def test_killed_process_leaves_incomplete_file_restart_another(start, capsys):
    run = start(COUNTED, "-v", "--record", "rec")
    run.wait_for("received enough")
    run.kill("far")
    run.wait_for("begins anew")
    run.wait_for("is started", times=2)
    assert run.end() == 130
    told = run.report()["recording"]
    assert not told["complete"]
    assert told["why"].startswith("far.mcap: ")
    folder = run.folder / "rec"
    assert sorted(path.name for path in folder.iterdir()) == ["far-2.mcap", "far.mcap", "main.mcap", "metadata.yaml"]
    with Bag(folder) as bag:
        assert not bag.complete
        assert [each.facts.process for each in bag.series] == ["main", "far", "far"]
        assert [bool(list(each.incomplete())) for each in bag.series] == [False, True, False]
        assert all(reason.startswith("far.mcap: ") for reason in bag.incomplete)
        numbers = payloads(bag, "numbers")
        assert bag.messages == told["recorded"]
        lines = [(entry.channel.plain(entry.payload)["name"], number) for number, entry in bag.numbered(["rosout"])]
        assert [number for name, number in lines if name == "/source"] == [1, 2]
    second = numbers.index(1, 1)
    assert numbers[:second] == list(range(1, second + 1))
    assert numbers[second:] == list(range(1, len(numbers) - second + 1))
    assert second >= 10
    assert main(["bag", "verify", str(folder)]) == 5
    assert main(["bag", "convert", str(folder), str(run.folder / "one.mcap"), "--to", "mcap"]) == 5
    assert "far.mcap" in capsys.readouterr().err
    with Bag(run.folder / "one.mcap") as bag:
        assert payloads(bag, "numbers") == numbers
        assert not bag.complete


@pytest.mark.long
def test_killed_main_leaves_files_of_the_chosen_topics(start, have_ended):
    run = start(COUNTED, "-v", *CHOSEN)
    run.wait_for("received enough")
    pids = list(run.pids().values())
    run.process.send_signal(signal.SIGKILL)
    run.end(None)
    assert have_ended(pids, 60)
    with Bag(run.folder / "rec") as bag:
        numbers = payloads(bag, "numbers")
        assert numbers == list(range(1, len(numbers) + 1))
        assert "metadata.yaml" in bag.incomplete[0]
        assert [list(each.incomplete()) == [] for each in bag.series] == [True, False]
        assert {each.topic for each in bag.channels if each.count} == {"/numbers", "/parameter_events", "/_ticks"}


@pytest.mark.long
def test_on_drop_fail_ends_run_when_process_dies(start):
    run = start(f"{COUNTED}record: {{to: rec.mcap, on_drop: fail}}\n", "-v")
    run.wait_for("received enough")
    run.kill("far")
    assert run.end(None) == 5
    assert any(" rec " in line and "SIGKILL" in line for line in run.lines)


@pytest.mark.long
def test_file_not_yet_on_disk_is_incomplete(start):
    text = f"{COUNTED}  tardy: {{plugin: tardy}}\n"
    run = start(text, *CHOSEN)
    run.wait_for("received enough")
    assert run.end() == 130
    why = "its end could not be written in time"
    told = run.report()["recording"]
    assert (told["complete"], told["why"]) == (False, f"main.mcap: {why}")
    ends = [
        each["level"] for each in run.log() if each["event"].startswith("the recording rec is incomplete: main.mcap")
    ]
    assert ends == ["warning"]
    assert sum("/nomber*" in line for line in run.lines) == 1, "one process says that nothing matches"
    assert not [line for line in run.lines if "no topic numbers" in line]


def test_a_directory_that_is_there_is_left_alone(start, project):
    (project / "there").mkdir()
    run = start(COUNTED, "--record", "there.mcap")
    assert run.end(None) == 2
    assert run.lines[-1].startswith("error: there ")


FROM_OUTSIDE = """
name: outside
processes: {far: }
nodes:
  sink: {plugin: sink, parameters: {enough: 40}, subscriptions: {numbers: {depth: 100}}}
  other: {plugin: sink, process: far, parameters: {enough: 40}, subscriptions: {numbers: {depth: 100}}}
"""


@pytest.mark.long
def test_message_from_a_terminal_is_recorded_once(start, monkeypatch):
    run = start(FROM_OUTSIDE, "-v", "--record", "rec")
    run.wait_for("the process far runs")
    monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", str(run.runtime))
    assert main(["topic", "pub", "numbers", "std_msgs/msg/Int64", "{data: 7}", "--times", "40", "--rate", "20"]) == 0
    run.wait_for("received enough", times=2)
    run.end()
    with Bag(run.folder / "rec") as bag:
        assert bag.complete, bag.incomplete
        # A process hears of the publisher in its own time; the one that heard of it first has all, and the other none.
        assert [number for number, _ in bag.numbered(["numbers"])] == [0] * 40


def test_messages_missed_on_a_full_disk_are_counted(project, monkeypatch):
    """No file has an end with a ledger; what the processes reported is all that is known."""
    monkeypatch.chdir(project)
    (project / "run.yaml").write_text(f"plugins: [{NODES}]\n{COUNTED}")
    description = load(project / "run.yaml")
    graph = Graph([description])
    spec = RecordSpec("rec")
    shares = Shares(spec, placed(description), graph.plan())
    recording = JointRecording(spec, shares, graph.log.bind("x"), run="counted")
    recording.begin()
    recording.finish(graph.report(), [{"path": "rec/far.mcap", "missed": 7, "why": "the disk is full"}])
    assert (recording.outcome.missed, recording.outcome.complete) == (7, False)
