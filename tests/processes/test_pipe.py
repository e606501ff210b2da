"""What a process says to the main one: whole lines, in order, and never at the cost of who speaks."""

import json
import os
import threading
from contextlib import suppress

import pytest

from busflow.log import LogRecord
from busflow.processes import pipe as voice
from busflow.processes.pipe import PipeWriter, record_of


@pytest.fixture
def pipe():
    listening, speaking = os.pipe()
    yield listening, speaking
    with suppress(OSError):
        os.close(listening)
    for thread in threading.enumerate():  # one that still writes would write into whatever has this number next
        if thread.name == "busflow.pipe":
            thread.join(10)
    os.close(speaking)


def read(listening):
    return [json.loads(line) for line in os.read(listening, 1 << 20).splitlines()]


def test_what_is_said_arrives_in_order(pipe):
    said = PipeWriter(pipe[1])
    for number in range(100):
        said.send(report=number)
    said.close()
    assert [each["report"] for each in read(pipe[0])] == list(range(100))


def test_log_line_arrives_unchanged_within_the_limit(pipe):
    said = PipeWriter(pipe[1])
    said.log(LogRecord(7, "info", "/a", "says\x1b", {"x": 1, "far": float("inf"), "long": "y" * 10_000, "object": {1}}))
    said.close()
    ((line,),) = [each.values() for each in read(pipe[0])]
    record = record_of(line, "left")
    assert (record.stamp_ns, record.level, record.node, record.event) == (7, "info", "/a", "says\x1b")
    assert (record.values["x"], record.values["far"], record.values["object"]) == (1, "inf", "{1}")
    assert len(record.values["long"]) == 4096
    assert record.process == "left"


@pytest.mark.parametrize("line", [None, [], [1, "info", "/a", "text"], ["1", "info", "/a", "text", {}]])
def test_malformed_log_line_is_refused(line):
    with pytest.raises(ValueError, match="record"):
        record_of(line, "left")


def test_blocked_reader_costs_only_the_oldest_lines(pipe, monkeypatch):
    monkeypatch.setattr(voice, "_DEPTH", 10)
    said = PipeWriter(pipe[1])
    for number in range(5000):  # far more than a pipe holds
        said.send(report=[number, "x" * 1000])
    assert said.lost > 4000
    said.close()


def test_line_is_in_the_pipe_at_once(pipe):
    said = PipeWriter(pipe[1])
    said.send(report=1)
    os.set_blocking(pipe[0], False)
    assert read(pipe[0]) == [{"report": 1}]
    said.close()


def test_long_lines_arrive_whole(pipe):
    said = PipeWriter(pipe[1])
    for number in range(5):
        said.send(report=[number, "x" * 300_000])
    received = b""
    while received.count(b"\n") < 5:
        received += os.read(pipe[0], 1 << 16)
    said.close()
    assert [json.loads(line)["report"][0] for line in received.splitlines()] == [*range(5)]
    assert said.lost == 0


def test_a_listener_that_is_gone_is_no_fault(pipe):
    os.close(pipe[0])
    said = PipeWriter(pipe[1])
    said.send(report=1)
    said.close()


def test_children_of_nodes_do_not_inherit_the_pipe(pipe):
    os.set_inheritable(pipe[1], True)
    PipeWriter(pipe[1]).close()
    assert not os.get_inheritable(pipe[1])
