"""What was published then and now, held against each other: also where one side is silent."""

import json

import pytest

from busflow.msgs.std_msgs import Float64
from busflow.recording.bag.bag import Bag
from busflow.recording.replay.comparison import Check, Published
from busflow.recording.replay.history import loss_notes
from busflow.recording.tools import pairs
from busflow.recording.tools.message_diff import Comparison
from tests.recording.conftest import write_messages

MS = 1_000_000


def of(number, at_ms=0):
    return Published(at_ms * MS, json.dumps(number).encode() + b" " * 743)  # with what it costs, 1000 bytes and more


def check_of(*topics, **more):
    check = Check(Comparison(), started_ns=0, **more)
    for topic in topics:
        check.watch(topic, json.loads)
    return check


def told(check):
    return [(each.kind, each.topic, each.number, each.time_s) for each in check.differences]


@pytest.fixture(autouse=True)
def small(monkeypatch):
    monkeypatch.setattr(pairs, "MOST_WAITING", 10_500)


def test_silent_topic_lists_first_and_counts_all():
    check = check_of("/silent")
    for number in range(5000):
        check.recorded("/silent", of(number, at_ms=number))
    check.finish()
    assert check.count == 5000
    assert check.compared == {"/silent": 0}
    assert told(check) == [("missing", "/silent", n + 1, n / 1000) for n in range(10)]


def test_a_silent_topic_does_not_crowd_out_others():
    check = check_of("/silent", "/spoken")
    for number in range(200):
        check.recorded("/silent", of(number))
        check.recorded("/spoken", of(number))
        check.replayed("/spoken", of(number))
    assert check.compared["/spoken"] == 200
    assert check.count == 0
    check.finish()
    assert check.count == 200


def test_a_message_too_late_to_compare_is_different():
    check = check_of("/late")
    for number in range(30):
        check.recorded("/late", of(number))
    for number in range(30):
        check.replayed("/late", of(number))
    check.finish()
    assert check.compared["/late"] == 10
    assert check.count == 20
    assert {each.kind for each in check.differences} == {"uncompared"}
    assert check.differences[0].number == 11


def test_extra_messages_count_until_the_recorded_end():
    check = check_of("/extra", forgiven_from_ns=60 * MS)
    for number in range(100):
        check.replayed("/extra", of(number, at_ms=number))
    check.finish()
    assert check.count == 60
    assert told(check) == [("extra", "/extra", n + 1, n / 1000) for n in range(10)]


def test_inbox_losses_are_not_given_in_replay(tmp_path, golden):
    report = {"topics": [{"name": "/a", "published": 1, "losses": {"inbox_dropped": 3, "lost": 2}}]}
    path = write_messages(tmp_path / "run.mcap", [("/a", Float64(data=1.0), 1)], ledger={"report": json.dumps(report)})
    with Bag(path) as bag:
        golden("\n".join([*loss_notes(bag, {"/a"}, set())]))
