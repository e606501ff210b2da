"""Snapshots of runs of several processes, for real: a directory with the last moments of each process."""

import json
import signal
import subprocess
import sys

import pytest

from busflow.cli import main
from busflow.msgs.std_msgs import Int64
from busflow.recording.bag.bag import Bag
from tests.processes.conftest import PATIENCE_S

RUN = """
name: shot
processes:
  far: {{restart: {restart}}}
nodes:
  source: {{plugin: source, process: {source}, parameters: {{rate_hz: 100.0, fail_at: {fail_at}}}}}
  sink: {{plugin: sink, process: {sink}, parameters: {{enough: 60}}}}
record: {{to: rec.mcap, snapshot: 60s, after: {after}}}
"""


def run_of(start, *arguments, source="far", sink="main", fail_at=0, restart="never", after="100ms"):
    text = RUN.format(source=source, sink=sink, fail_at=fail_at, restart=restart, after=after)
    return start(text, "-v", *arguments)


def numbers(bag):
    return [entry.channel.decode(entry.payload, Int64).data for entry in bag.entries(["numbers"])]


def files(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.long
def test_processes_write_asked_snapshots_and_moments_of_a_death(start, monkeypatch, capsys):
    run = run_of(start, restart="on-failure")
    run.wait_for("received enough")
    monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", str(run.runtime))
    reports = []
    for reason in ("one", "two"):
        assert main(["bag", "snapshot", "--run", "shot", "--reason", reason, "--json"]) == 0
        reports.append(json.loads(capsys.readouterr().out))
    run.kill("far")
    run.wait_for("rec-003 is incomplete")
    assert run.end() == 130
    *asked, killed = run.report()["snapshots"]
    assert asked == [{name: each[name] for name in each if name != "version"} for each in reports]
    for number, report in enumerate(reports, 1):
        folder = run.folder / f"rec-00{number}"
        assert report["path"] == str(folder)
        assert files(folder) == ["far.mcap", "main.mcap", "metadata.yaml"]
        assert main(["bag", "verify", str(folder)]) == 0, capsys.readouterr().out
        assert main(["bag", "convert", str(folder), str(run.folder / f"{number}.mcap"), "--to", "mcap"]) == 0
        assert main(["bag", "verify", str(run.folder / f"{number}.mcap")]) == 0, capsys.readouterr().out
        with Bag(folder) as bag:
            assert [each.facts.process for each in bag.series] == ["far", "main"]
            assert {each.reason for each in bag.series} == {report["reason"]}
            assert bag.complete
            assert bag.survey().gaps == 0
            assert bag.messages == report["recorded"]
            assert numbers(bag) == list(range(1, len(numbers(bag)) + 1))
            assert len(numbers(bag)) >= 60
    assert "SIGKILL" in killed["reason"]
    assert killed["why"].endswith(" far")
    with Bag(run.folder / "rec-003") as bag:
        assert [each.facts.process for each in bag.series] == ["main"], "the moments of the others"


LACKS = "there is nothing of the process far"


def state_of(path, capsys):
    """The exit code and codes of findings of `bag verify`, and the reasons of `bag info`."""
    code = main(["bag", "verify", str(path), "--json"])
    found = json.loads(capsys.readouterr().out)
    assert main(["bag", "info", str(path), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["complete"], found["complete"]) == (not told["incomplete_because"], not told["incomplete_because"])
    return code, [each["code"] for each in found["findings"]], told["incomplete_because"]


@pytest.mark.long
def test_snapshot_without_a_killed_process_is_incomplete(start, monkeypatch, capsys):
    run = run_of(start, restart="on-failure", after="1ms")
    run.wait_for("received enough")
    run.kill("far")
    run.wait_for("rec-001 is incomplete")
    run.wait_for("the process far runs", times=2)
    monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", str(run.runtime))
    assert main(["bag", "snapshot", "--run", "shot", "--json"]) == 5
    later = json.loads(capsys.readouterr().out)
    assert run.end() == 130
    folder, whole = run.folder / "rec-001", run.folder / "one.mcap"
    assert LACKS in (folder / "metadata.yaml").read_text()
    assert main(["bag", "convert", str(folder), str(whole), "--to", "mcap"]) == 0
    capsys.readouterr()
    for path, reason in ((folder, LACKS), (folder / "main.mcap", LACKS), (whole, f"it was recovered: {LACKS}")):
        assert state_of(path, capsys) == (5, ["unfinished"], [reason])
    # The process runs again, and its former life's moments are within the window.
    reason = "the moments of the process far before its restart are lost"
    assert later["why"] == reason
    code, codes, reasons = state_of(run.folder / "rec-002", capsys)
    assert (code, set(codes), reasons) == (5, {"unfinished"}, [reason])


@pytest.mark.long
def test_snapshot_of_a_process_killed_while_it_writes_is_incomplete(start, monkeypatch, capsys):
    run = run_of(start, restart="on-failure", after="1ms")
    run.wait_for("received enough")
    monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", str(run.runtime))
    run.kill("far", signal.SIGSTOP)
    with subprocess.Popen([sys.executable, "-m", "busflow", "bag", "snapshot", "--run", "shot"]) as asked:
        run.wait_for("the last moments are written to")
        run.kill("far")
        assert asked.wait(PATIENCE_S) == 5
    assert run.end() == 130
    code, codes, reasons = state_of(run.folder / "rec-001", capsys)
    assert (code, set(codes), reasons) == (5, {"unfinished"}, ["the process far ended before its file was whole"])


@pytest.mark.long
def test_a_failure_anywhere_has_files_of_all(start):
    run = run_of(start, source="main", sink="far", fail_at=100)
    assert run.end(None) == 1
    (report,) = run.report()["snapshots"]
    assert "lost count" in report["reason"]
    assert report["complete"], report
    with Bag(run.folder / "rec-001") as bag:
        assert files(bag.path) == ["far.mcap", "main.mcap", "metadata.yaml"]
        assert bag.complete
        assert numbers(bag) == list(range(1, 100))


@pytest.mark.long
def test_restarts_of_a_process_cause_so_many(start):
    run = run_of(start, restart="on-failure", fail_at=10, after="10ms")
    run.wait_for("/source", "lost count", "source.py")
    run.wait_for("the process far restarts in", times=2)
    assert run.end() == 130
    reasons = [each["reason"] for each in run.report()["snapshots"]]
    assert len(reasons) >= 2
    assert all("lost count" in each for each in reasons)
