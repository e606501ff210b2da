"""In which messages two recordings differ."""

from struct import pack

from mcap.writer import Writer

from busflow.errors import BagError
from busflow.recording.bag.bag import Bag
from busflow.recording.tools import pairs
from busflow.recording.tools.diff import diff
from busflow.recording.tools.message_diff import Comparison


def write(path, *messages, kind="Float64", start=0):
    """A recording of numbers, given as topic and value, 10 ms apart."""
    definitions = {"Float64": b"float64 data\n", "Int64": b"int64 data\n"}
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "a test")
        schema = writer.register_schema(f"std_msgs/msg/{kind}", "ros2msg", definitions[kind])
        channels = {}
        for number, (topic, value) in enumerate(messages):
            if topic not in channels:
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            data = value if isinstance(value, bytes) else b"\0\1\0\0" + pack("<d", value)
            writer.add_message(channels[topic], start + number * 10_000_000, data, 0, number + 1)
        writer.finish()
    return path


def compared(tmp_path, left, right, tolerance=0.0, **how):
    paths = [tmp_path / "a.mcap", tmp_path / "b.mcap"]
    for path, messages in zip(paths, (left, right), strict=True):
        if messages is not None:
            write(path, *messages)
    with Bag(paths[0]) as one, Bag(paths[1]) as other:
        return diff(one, other, Comparison(tolerance), **how)


A = [("/x", 1.0), ("/y", 5.0), ("/x", 2.0), ("/x", float("nan"))]


def test_the_order_between_topics_is_no_difference(tmp_path):
    found = compared(tmp_path, A, [("/y", 5.0), *(each for each in A if each[0] == "/x")])
    assert found.same
    assert found.messages == 4


def test_difference_shows_field_and_both_values(tmp_path):
    found = compared(tmp_path, A, [("/x", 1.0), ("/y", 5.0), ("/x", 2.5), ("/x", float("nan"))])
    (x, y) = found.topics
    assert (x.same, y.same, x.different) == (False, True, 1)
    (message,) = x.first
    assert (message.number, message.left_ns) == (2, 20_000_000)
    assert [str(each) for each in message.fields] == ["data: 2.0 -> 2.5"]


def test_numbers_may_be_a_little_apart(tmp_path):
    near = [(topic, value + 1e-9) for topic, value in A]
    assert not compared(tmp_path, A, near).same
    assert compared(tmp_path, A, near, 1e-6).same


def test_messages_and_topics_on_one_side_are_differences(tmp_path):
    x, y = compared(tmp_path, A, A[:1]).topics
    assert (x.left, x.right, x.different, x.same) == (3, 1, 0, False)
    assert (y.left_type, y.right_type, y.same) == ("std_msgs/msg/Float64", None, False)
    assert compared(tmp_path, A, A[:1] + A[2:], topics={"/x"}).same


def test_times_are_compared_where_that_is_wanted(tmp_path):
    write(tmp_path / "a.mcap", *A)
    write(tmp_path / "b.mcap", *A, start=5)
    assert compared(tmp_path, None, None).same
    found = compared(tmp_path, None, None, times=True)
    assert str(found.topics[0].first[0].fields[0]) == "log time: 0 -> 5"


def test_unreadable_messages_are_compared_as_bytes(tmp_path):
    write(tmp_path / "a.mcap", *A)
    write(tmp_path / "b.mcap", *A, kind="Int64")
    assert not compared(tmp_path, None, None).same
    broken = [("/x", b"abc"), ("/x", b"abc")]
    assert compared(tmp_path, broken, broken).same
    (topic,) = compared(tmp_path, broken, [("/x", b"abc"), ("/x", b"abd")]).topics
    assert str(topic.first[0].fields[0]) == ": 3 bytes -> 3 bytes, others"


def test_what_waits_for_its_counterpart_is_bounded(tmp_path, monkeypatch, golden):
    monkeypatch.setattr(pairs, "MOST_WAITING", 3000)
    with golden.raises(BagError):
        compared(tmp_path, [("/x", 1.0)] * 50 + [("/y", 1.0)] * 50, [("/y", 1.0)] * 50 + [("/x", 1.0)] * 50)


def test_a_topic_on_one_side_may_be_large(tmp_path, monkeypatch):
    monkeypatch.setattr(pairs, "MOST_WAITING", 3000)
    found = compared(tmp_path, [("/x", 1.0)] * 50 + [("/y", 1.0)] * 50, [("/x", 1.0)] * 50)
    assert [(each.topic, each.left, each.right, each.different) for each in found.topics] == [
        ("/x", 50, 50, 0),
        ("/y", 50, 0, 0),
    ]
