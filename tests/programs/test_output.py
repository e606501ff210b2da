"""What the log gets of a program's output, also of a flood."""

import pytest

from busflow.clock import SystemClock
from busflow.log import Log
from busflow.programs import output
from busflow.programs.output import LINES_PER_SECOND, Output


class Second:
    """The time that an output reads; it stands still until it is moved."""

    now_s = 100.0


@pytest.fixture
def second(monkeypatch):
    found = Second()
    monkeypatch.setattr(output, "perf_counter", lambda: found.now_s)
    return found


def written(ready=None, on_ready=lambda: None):
    lines = []
    log = Log(SystemClock(), sinks=(lambda record: lines.append((record.level, record.event)),))
    made = Output(log.bind("/driver"), ready, on_ready)
    made.begin()
    return made, lines


@pytest.mark.usefixtures("second")
def test_lines_are_logged_without_carriage_return():
    made, lines = written()
    for line in ("one", "two\r"):
        made.write(line)
    assert lines == [("info", "one"), ("info", "two")]
    assert (made.lines, made.left_out) == (2, 0)


def test_flood_is_cut_counted_and_named(second, golden):
    made, lines = written()
    for number in range(LINES_PER_SECOND + 7):
        made.write(str(number))
    assert len(lines) == LINES_PER_SECOND
    second.now_s += 1.0
    made.write("after it")
    (level, text), after = lines[LINES_PER_SECOND:]
    assert (level, after) == ("warning", ("info", "after it"))
    golden(text)
    assert (made.lines, made.left_out) == (LINES_PER_SECOND + 8, 7)


@pytest.mark.usefixtures("second")
def test_line_left_out_before_begin_is_looked_at():
    found = []
    made = Output(Log(SystemClock()).bind("/driver"), "ready", lambda: found.append(made.lines))
    for line in ["before"] * LINES_PER_SECOND + ["ready"]:
        made.write(line)
    made.begin()
    assert (found, made.left_out) == ([LINES_PER_SECOND + 1], 1)


@pytest.mark.usefixtures("second")
def test_last_flood_is_named_at_end(golden):
    made, lines = written()
    for number in range(LINES_PER_SECOND + 1):
        made.write(str(number))
    made.finish()
    made.finish()
    golden("\n".join(text for level, text in lines if level == "warning"))


def test_program_is_held_up_in_absurd_flood(second, monkeypatch):
    made, _ = written()
    waits = []
    monkeypatch.setattr(made._wait, "wait", waits.append)
    for _ in range(10 * LINES_PER_SECOND):
        made.write("y")
    assert waits == []
    second.now_s += 0.25
    made.write("y")
    assert waits == [0.75]


@pytest.mark.usefixtures("second")
def test_ready_text_is_seen_within_line():
    calls = []
    made, _ = written("is ready", lambda: calls.append(1))
    for line in ("starting", "camera is ready, 30 fps"):
        made.write(line)
    assert calls == [1]


@pytest.mark.usefixtures("second")
def test_early_lines_follow_the_start():
    lines = []
    log = Log(SystemClock(), sinks=(lambda record: lines.append(record.event),)).bind("/driver")
    made = Output(log, None, lambda: None)
    for life in ("first", "second"):
        made.write(f"{life} line")
        log.info("is started")
        made.begin()
        made.write("later")
        made.finish()
    assert lines == ["is started", "first line", "later", "is started", "second line", "later"]
