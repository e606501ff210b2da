"""A run of several processes survives signals, slow readers, large messages and late starts."""

import os
import select
import signal

import pytest

from busflow.timeouts import VARIABLE

PATIENCE_S = 60.0
FROM_MAIN = """
processes:
  left: {restart: always}
  right: {restart: always}
nodes:
  source: {plugin: source, parameters: {rate_hz: 100.0}}
  departure: {plugin: departure, process: left}
  sink: {plugin: sink, process: right, parameters: {enough: 20}}
  later: {plugin: sink, process: right, parameters: {enough: 500}}
"""


def process_of(run, name):
    (found,) = [each for each in run.report()["processes"] if each["name"] == name]
    return found


@pytest.mark.long
def test_continued_main_kills_only_stopped_workers(start, have_ended):
    run = start(FROM_MAIN, "-v", grace="750ms")
    os.mkfifo(run.folder / "gone")
    pipe = os.open(run.folder / "gone", os.O_RDONLY | os.O_NONBLOCK)
    run.wait_for("received enough")
    run.process.send_signal(signal.SIGSTOP)
    try:
        ready, _, _ = select.select([pipe], [], [], PATIENCE_S)
        assert ready, "the others see that it does not answer"
    finally:
        run.process.send_signal(signal.SIGCONT)
        os.close(pipe)
    run.wait_for("received enough", times=2)
    assert not [line for line in run.lines if "hangs" in line or "restarts in" in line]
    stopped_process_is_killed_at_the_end(run, have_ended)
    assert [each["restarts"] for each in run.report()["processes"]] == [0, 0, 0]


def stopped_process_is_killed_at_the_end(run, have_ended):
    pids = [*run.pids().values()]
    run.kill("left", signal.SIGSTOP)
    assert run.end() == 130
    assert have_ended(pids, 0)
    left = process_of(run, "left")
    (fate,) = left["fates"]
    assert (left["state"], "SIGKILL" in fate) == ("failed", True)
    assert [each["level"] for each in run.log() if each["event"] == fate] == ["error"]
    assert f"error: {fate}\n" in run.lines


@pytest.mark.long
def test_process_ended_by_force_fails_the_run(start, monkeypatch):
    monkeypatch.setenv(VARIABLE, f"{os.environ[VARIABLE]},process_kill=inf")  # the process ends itself, however late
    text = "processes: {far: }\nnodes: {stuck: {plugin: 'faulty:HangsAtStop', process: far}}\n"
    run = start(text, "--for", "0.2s", grace="750ms")
    assert run.end(None) == 1
    far = process_of(run, "far")
    (fate,) = far["fates"]
    assert (run.report()["exit_code"], far["state"], "SIGKILL" in fate) == (1, "failed", False)
    assert [each["level"] for each in run.log() if each["event"] == fate] == ["error"]
    assert any("did not end" in line and "faulty.py" in line for line in run.lines)


@pytest.mark.long
def test_slow_readers_and_large_messages_delay_no_others(start):
    run = start("""
processes: {far: , slow: }
nodes:
  source: {plugin: "images:BusySource", process: far}
  slow: {plugin: "images:Slow", process: slow}
  stuck: {plugin: "images:Stuck"}
  counter: {plugin: "images:Counter"}
""")
    run.wait_for("is slow", '"bytes": 6000000')
    run.wait_for("is stuck")
    run.wait_for("counted")
    assert run.end() == 130
    numbers, images = run.topic("/numbers"), run.topic("/images")
    (line,) = numbers["subscriptions"]
    assert (numbers["losses"], line["published"], line["dropped"]) == ({}, 3000, 0)
    assert not [line for line in run.lines if "missing" in line]
    for line in images["subscriptions"]:
        assert line["published"] == line["delivered"] + line["dropped"] + line["queued"]
    (stuck,) = [line for line in images["subscriptions"] if line["node"] == "/stuck"]
    assert stuck["delivered"] == 1
    assert stuck["dropped"] > 0


@pytest.mark.long
def test_a_handler_that_hangs_is_restarted(start):
    run = start(
        "processes: {far: {restart: on-failure, hang: 1s}}\n"
        "nodes: {hanging: {plugin: 'faulty:Hanging', process: far}}\n"
    )
    run.wait_for("hangs: its event loop stands still", times=2)
    run.end()
    far = process_of(run, "far")
    assert far["restarts"] >= 1
    assert "SIGKILL" in far["fates"][0]
