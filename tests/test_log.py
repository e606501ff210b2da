"""Tests of `log.py`: lines bound to nodes, counted by level, shown safely."""

import io
import json

import pytest

from busflow.clock import SystemClock
from busflow.log import Log, LogRecord, console_sink, json_sink
from busflow.runner.rosout import line_text


def logged(level: str = "info") -> tuple[Log, list[LogRecord]]:
    records: list[LogRecord] = []
    return Log(SystemClock(), level=level, sinks=(records.append,)), records


def record(event: str = "hello", level: str = "info", **values: object) -> LogRecord:
    return LogRecord(1_767_225_661_002_003_004, level, "/talker", event, values)


def test_record_has_time_level_node_text_values():
    log, records = logged()
    log.bind("/talker").warning("too warm", celsius=81.5)
    assert [(each.node, each.level, each.event, each.values) for each in records] == [
        ("/talker", "warning", "too warm", {"celsius": 81.5})
    ]
    assert abs(records[0].stamp_ns - SystemClock().now().nanoseconds) < 60e9


def test_warn_and_fatal_are_names_of_rclpy():
    log, records = logged()
    node = log.bind("/talker")
    node.warn("too warm")
    node.fatal("on fire")
    assert [(each.level, each.event) for each in records] == [("warning", "too warm"), ("critical", "on fire")]


def test_bound_values_stay_in_their_logger():
    log, records = logged()
    left = log.bind("/left").bind(joint="knee")
    left.info("one")
    left.info("two")
    log.bind("/right").info("three")
    assert [each.values for each in records] == [{"joint": "knee"}, {"joint": "knee"}, {}]


def test_lines_below_the_level_are_not_counted():
    log, records = logged("warning")
    node = log.bind("/n")
    node.debug("a")
    node.info("b")
    node.warning("c")
    node.error("d")
    assert [each.event for each in records] == ["c", "d"]
    assert {level: count for level, count in log.counts.items() if count} == {"warning": 1, "error": 1}


def test_level_of_a_node_changes_its_loggers():
    log, records = logged()
    log.set_level("/later", "error")
    node, later = log.bind("/n"), log.bind("/later")
    log.set_level("/n", "debug")
    for logger in (node, later):
        logger.debug("a")
        logger.info("b")
    assert [(each.node, each.event) for each in records] == [("/n", "a"), ("/n", "b")]
    assert [log.level_of(name) for name in ("/n", "/later", "/other")] == ["debug", "error", "info"]


def test_an_exception_is_an_error_that_names_it():
    log, records = logged()
    try:
        int("unplugged")
    except ValueError:
        log.bind("/n").exception("cannot read")
    assert records[0].level == "error"
    assert str(records[0].values["error"]).startswith("ValueError: invalid literal")
    assert "test_log.py:" in str(records[0].values["at"])


def test_two_logs_do_not_share_sinks():
    (first, first_lines), (second, second_lines) = logged(), logged()
    first.bind("/a").info("x")
    second.bind("/b").info("y")
    assert [each.event for each in first_lines + second_lines] == ["x", "y"]


def test_console_shows_time_level_node_text_values():
    stream = io.StringIO()
    console_sink(stream, colour=False)(record(rate=10, name="x y"))
    assert stream.getvalue() == "00:01:01.002 info     /talker: hello rate=10 name=x y\n"


def test_colour_is_only_what_was_asked_for():
    plain, coloured = io.StringIO(), io.StringIO()
    console_sink(plain, colour=False)(record(level="error"))
    console_sink(coloured, colour=True)(record(level="error"))
    assert "\x1b" not in plain.getvalue()
    assert "\x1b[31merror" in coloured.getvalue()


def test_values_are_shown_without_the_quotes_of_code():
    stream, circle = io.StringIO(), []
    circle.append(circle)
    values = {"silent": ["left/arm", "right"], "gains": {"p": (1, 2.5)}, "name": "a b", "none": [], "circle": circle}
    console_sink(stream, colour=False)(record(**values, many=list(range(1000))))
    line = stream.getvalue()
    assert " silent=[left/arm, right] gains={p: [1, 2.5]} name=a b none=[] circle=[[[[[[...]]]]]] many=[0, 1, " in line
    assert line.endswith("…\n")
    assert line_text(record(**values)).startswith("hello silent=[left/arm, right] gains={p: [1, 2.5]} name=a b ")


@pytest.mark.parametrize(
    "sink", [lambda stream: console_sink(stream, colour=False), json_sink], ids=["console", "json"]
)
def test_console_escapes_control_characters_and_newlines(sink):
    stream = io.StringIO()
    sink(stream)(record("\x1b[2Jred\nforged", text="\x1b]0;title\x07\u202e"))
    shown = stream.getvalue()
    assert "\x1b" not in shown
    assert "\x07" not in shown
    assert "\u202e" not in shown
    assert shown.count("\n") == 1


def test_json_line_keys_override_values():
    stream = io.StringIO()
    json_sink(stream)(record(rate=10, level_="x", odd=object))
    line = json.loads(stream.getvalue())
    assert (line["level"], line["node"], line["event"], line["rate"]) == ("info", "/talker", "hello", 10)
    assert line["stamp_ns"] == 1_767_225_661_002_003_004


def test_json_sink_writes_values_json_cannot_express():
    stream, circle = io.StringIO(), []
    circle.append(circle)
    json_sink(stream)(record(table={(1, 2): 3}, circle=circle, rate=10))
    line = json.loads(stream.getvalue())
    assert (line["table"], line["circle"], line["event"]) == ("{(1, 2): 3}", "[[...]]", "hello")


class Gone(io.StringIO):
    def write(self, text: str) -> int:
        raise BrokenPipeError(text)


@pytest.mark.parametrize(
    "sink", [lambda stream: console_sink(stream, colour=False), json_sink], ids=["console", "json"]
)
def test_closed_stream_does_not_fail_the_node(sink):
    closed = io.StringIO()
    closed.close()
    log, records = logged()
    log.sinks[:0] = [sink(Gone()), sink(closed)]
    log.bind("/n").error("on fire")
    assert [each.event for each in records] == ["on fire"]


def test_failing_sink_is_counted_as_lost():
    stream = io.StringIO()
    log, records = logged()
    log.sinks.insert(0, console_sink(stream, colour=False))
    stream.close()
    log.bind("/talker").info("hello")
    assert (log.lost, len(records)) == (1, 1)
