"""Rows, numbers and lines of `busflow top`, computed from two snapshots of a graph."""

import pytest

from busflow.cli.top.picture import (
    ACTION_COLUMNS,
    Look,
    action_rows,
    first_plotted,
    lines,
    node_rows,
    numbers,
    topic_rows,
)
from busflow.wire.client.graph_view import view
from busflow.wire.zenoh.keys import Token, TokenKind


def token(kind: TokenKind, number: int, node: str, topic: str = "", type_: str = "") -> Token:
    return Token("aa", number, number, kind, "/", node, topic, type_, "", "::,10:,:,:,,")


def graph(published: int, *, queued: int = 0, dropped: int = 0, state: str = "running"):
    """A camera with one node and one command line as subscribers."""
    line = {"node": "/watcher", "queued": queued, "depth": 4, "dropped": dropped, "published": published}
    image = "sensor_msgs/msg/Image"
    topic = {
        "name": "/image",
        "type": image,
        "published": published,
        "publishers": [{"node": "/camera", "published": published}],
        "subscriptions": [line],
    }
    nodes = [{"name": "/camera", "plugin": "camera", "state": state}]
    tokens = [
        token(TokenKind.NODE, 1, "camera"),
        token(TokenKind.PUBLISHER, 2, "camera", "/image", image),
        token(TokenKind.SUBSCRIPTION, 3, "watcher", "/image", image),
        token(TokenKind.SUBSCRIPTION, 4, "_busflow_cli_7", "/image", image),
        token(TokenKind.PUBLISHER, 5, "camera", "/_hidden", image),
    ]
    return view(tokens, [{"process": "main", "pid": 1, "nodes": nodes, "topics": [topic]}])


def process(*ends: tuple[str, str, dict[str, int]]):
    """The answer of a process with ends of the action `/arm/move`: their side, node and counts."""
    lines = {side: [{"node": node, **counts} for each, node, counts in ends if each == side] for side in _SIDES}
    services = [{"name": "/arm/move/_action/send_goal", "type": "my_robot/action/MoveTo_SendGoal", **lines}]
    return {"process": "", "pid": 1, "nodes": [], "topics": [], "services": services}


_SIDES = ("servers", "clients")


def test_each_end_of_an_action_is_a_row():
    server = {"received": 9, "rejected": 1, "succeeded": 2, "aborted": 3, "running": 1, "queued": 2}
    client = {"called": 8, "succeeded": 2, "left": 5, "lost": 1, "feedback_dropped": 4}
    answers = [process(("servers", "/a\x1b", server)), process(*[("clients", "/boss", client)] * 2)]
    columns = [column.title for column in ACTION_COLUMNS]
    rows = [dict(zip(columns, row, strict=True)) for row in action_rows(Look(view([], answers), 0.0))]
    assert [{word: cell for word, cell in row.items() if cell not in ("", "0")} for row in rows] == [
        {"action": "/arm/move ← /a\\x1b", "goals": "9", **_texts(server)},
        {"action": "/arm/move → /boss", "goals": "16", "succeeded": "4", "left": "10", "lost": "2", "dropped": "8"},
    ]
    assert (rows[0]["left"], rows[1]["queued"]) == ("", "")


def _texts(counts: dict[str, int]) -> dict[str, str]:
    return {word: str(count) for word, count in counts.items() if word != "received"}


def test_run_without_actions_has_no_rows():
    assert action_rows(Look(graph(1), 0.0)) == []


def test_rate_is_computed_between_two_snapshots():
    before, now = Look(graph(100), 10.0), Look(graph(160), 12.0)
    (row,) = topic_rows(now, before)
    assert row.rate_hz == pytest.approx(30.0)
    assert row.cells() == ("/image", "sensor_msgs/msg/Image", "30.0", "160", "1 → 2", "0", "0")


def test_the_first_look_knows_no_rate():
    look = Look(graph(100), 10.0)
    assert topic_rows(look, look)[0].rate_hz is None
    assert topic_rows(look, look)[0].cells()[2] == ""


def test_restarted_run_has_no_negative_rate():
    assert topic_rows(Look(graph(3), 12.0), Look(graph(100), 10.0))[0].rate_hz == 0


def test_drops_and_full_queues_are_shown():
    look = Look(graph(100, queued=3, dropped=7), 10.0)
    (row,) = topic_rows(look, look)
    assert row.cells()[-2:] == ("7", "3 (75%)")
    assert [each.dropped for each in node_rows(look)] == [0, 7]


def test_hidden_rows_are_left_out():
    look = Look(graph(1), 0.0)
    assert [row.name for row in topic_rows(look, look)] == ["/image"]
    assert [row.name for row in node_rows(look)] == ["/camera", "/watcher"]


def test_foreign_text_is_escaped():
    look = Look(graph(1, state="\x1b[2J"), 0.0)
    assert node_rows(look)[0].cells()[1] == "\\x1b[2J"
    assert list(lines({"frame\x07": "\x1b]0;x"})) == ["frame\\x07: \\x1b]0;x"]


def test_numbers_are_found_wherever_they_are():
    message = {"header": {"stamp": {"sec": 3}}, "data": memoryview(bytes([1, 2])), "poses": [{"x": 0.5}], "ok": True}
    assert dict(numbers(message)) == {"header.stamp.sec": 3, "data[0]": 1, "data[1]": 2, "poses[0].x": 0.5}


def test_first_plotted_number_is_no_stamp():
    imu = {"header": {"stamp": {"sec": 1}, "frame_id": "imu"}, "orientation": {"x": 0.5}}
    assert first_plotted(dict(numbers(imu))) == "orientation.x"
    assert first_plotted(dict(numbers({"transforms": [imu]}))) == "transforms[0].orientation.x"
    assert first_plotted([]) is None


def test_long_arrays_are_cut():
    assert list(lines({"data": list(range(10))}, limit=3)) == ["data: [0, 1, 2, … 7 more]"]
