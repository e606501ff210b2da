"""What a process is told on its standard input arrives as it was; anything else is refused with what to do."""

import io
from dataclasses import replace
from pathlib import Path

import pytest

from busflow.errors import ProcessFailed
from busflow.processes.assignment import Assignment, Memory
from busflow.runner.source import Source
from busflow.wire.zenoh.run_directory import RunCard

SOURCE = Source(
    Path("/robot.yaml"),
    ("a:=1",),
    ("name=é\x1b",),
    ("fast",),
    args={"rate_hz": 50.0},
    remaps=("a:=b",),
    folder=Path("/p"),
)
WHOLE = Assignment(
    process="left",
    socket="1.sock",
    earlier=("main.sock",),
    directory="/run/robot",
    card=RunCard("robot", 7, 8, "/robot.yaml", "1.0"),
    nodes=("/a", "/ns/b"),
    others=("main", "right"),
    seed=7,
    log_level="debug",
    ros2_listens="tcp/127.0.0.1:7450",
    ros2_dials=("tcp/127.0.0.1:7447",),
    restarts=2,
    nice=5,
    env={"A": "1"},
    outer={"B": None, "C": "two\nlines"},
    watchdog_s=None,
    prints_failures=True,
    path=("", "/plugins"),
    event_loop="uvloop",
    timeouts={"grace": 20.0},
    source=SOURCE,
    memory=Memory({"/a": {"values": {"x": float("inf")}, "set": ["x"], "times": 1}}, {"/a": 2}),
)


def test_assignment_survives_the_pipe_as_one_line():
    line = WHOLE.line()
    assert line.count(b"\n") == 1
    assert Assignment.read(io.StringIO(f"{line.decode()}more")) == WHOLE


def test_argument_without_plain_value_becomes_text(tmp_path):
    line = replace(WHOLE, source=Source(tmp_path, args={"file": tmp_path})).line()
    assert Assignment.read(io.StringIO(line.decode())).source == Source(tmp_path, args={"file": str(tmp_path)})


@pytest.mark.parametrize(
    "text", ["", "nonsense", "[]", "{}", '{"card": {}}', WHOLE.line().decode().replace('"seed"', '"sead"')]
)
def test_anything_else_is_refused_with_what_to_do(text):
    with pytest.raises(ProcessFailed):
        Assignment.read(io.StringIO(text))


def test_a_process_without_standard_input_is_refused():
    with pytest.raises(ProcessFailed):
        Assignment.read(None)
