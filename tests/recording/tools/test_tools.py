"""Recordings in other forms, read by other programs: rosbags, mcap, pyarrow, csv.

Tests of `convert.py`, `flat.py`, `pairs.py`, `sink.py`, `to_csv.py`, `to_mcap.py` and `to_parquet.py`.
"""

import csv
import json
import sys
from pathlib import Path
from typing import NamedTuple

import pyarrow.parquet as pq
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader, StoragePlugin
from rosbags.rosbag2 import Writer as RosbagsWriter
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from busflow.errors import BagError
from busflow.recording.bag.bag import Bag
from busflow.recording.tools.convert import TargetFormat, convert
from busflow.recording.tools.pairs import LetGo, Pairs
from busflow.recording.tools.sink import FileNames
from busflow.recording.tools.verify import examine

BAGS = Path(__file__).parents[2] / "cases/rosbag2"
STORE = get_typestore(Stores.ROS2_JAZZY)


def converted(source, target, form, **how):
    with Bag(source) as bag:
        return convert(bag, target, TargetFormat(form), json.dumps, **how)


def everything(path):
    with Bag(path) as bag:
        return [(each.channel.topic, each.channel.type_name, *each[1:]) for each in bag.entries()]


@pytest.mark.parametrize("name", ["talker", "cdr_test", "cdr_test_sqlite3", "wbag", "service_events"])
@pytest.mark.parametrize("form", ["mcap", "ros2bag"])
def test_a_bag_stays_what_it_is(tmp_path, name, form):
    target = tmp_path / "made"
    done = converted(BAGS / name, target, form)
    assert everything(target) == everything(BAGS / name)
    assert done.left_out == 0
    with Bag(target) as made, Bag(BAGS / name) as given:
        assert made.complete
        assert [each.type.type_hash for each in made.channels] == [each.type.type_hash for each in given.channels]
        assert [each.count for each in made.channels] == [each.count for each in given.channels]


def test_rosbags_reads_what_is_written_for_ros_2(tmp_path):
    converted(BAGS / "talker", tmp_path / "bag", "ros2bag")
    with Reader(tmp_path / "bag") as reader:
        assert reader.message_count == 20
        said = [
            STORE.deserialize_cdr(data, connection.msgtype).data
            for connection, _, data in reader.messages()
            if connection.topic == "/topic"
        ]
        assert said == [f"Hello, world! {number}" for number in range(10)]
        assert {each.digest for each in reader.connections if each.topic == "/topic"} == {
            STORE.hash_rihs01("std_msgs/msg/String")
        }
    with AnyReader([tmp_path / "bag"]) as reader:
        assert sum(1 for _ in reader.messages()) == 20


def test_the_mcap_package_reads_what_is_written(tmp_path):
    converted(BAGS / "cdr_test_sqlite3", tmp_path / "made.mcap", "mcap")
    with (tmp_path / "made.mcap").open("rb") as stream:
        messages = list(make_reader(stream, validate_crcs=True).iter_messages())
    assert len(messages) == 7
    assert {schema.name for schema, _, _ in messages} == {"test_msgs/msg/Arrays", "test_msgs/msg/BasicTypes"}


def test_csv_has_a_file_per_topic(tmp_path):
    converted(BAGS / "cdr_test", tmp_path / "tables", "csv")
    assert sorted(each.name for each in (tmp_path / "tables").iterdir()) == ["array_topic.csv", "test_topic.csv"]
    with (tmp_path / "tables/array_topic.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    with Bag(BAGS / "cdr_test") as bag:
        (first, *_) = bag.entries(["/array_topic"])
        plain = first.channel.plain(first.payload)
    assert len(rows) == 4
    assert rows[0]["log_time_ns"] == str(first.log_time_ns)
    assert [rows[0][f"float64_values[{index}]"] for index in range(3)] == [
        str(each) for each in plain["float64_values"]
    ]
    assert rows[0]["string_values[0]"] == plain["string_values"][0]


def test_parquet_has_the_types_of_ros_and_lists(tmp_path):
    converted(BAGS / "cdr_test", tmp_path / "tables", "parquet")
    table = pq.read_table(tmp_path / "tables/test_topic.parquet")
    assert table.num_rows == 3
    assert str(table.schema.field("float32_value").type) == "float"
    assert str(table.schema.field("uint8_value").type) == "uint8"
    arrays = pq.read_table(tmp_path / "tables/array_topic.parquet")
    with Bag(BAGS / "cdr_test") as bag:
        for entry, row in zip(bag.entries(["/array_topic"]), arrays.to_pylist(), strict=True):
            plain = entry.channel.plain(entry.payload)
            assert row["int32_values"] == plain["int32_values"].tolist()
            assert row["string_values"] == list(plain["string_values"])
            assert [each["uint8_value"] for each in row["basic_types_values"]] == [
                each["uint8_value"] for each in plain["basic_types_values"]
            ]


def test_parquet_says_what_to_install(tmp_path, monkeypatch, golden):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with golden.raises(BagError):
        converted(BAGS / "talker", tmp_path / "tables", "parquet")
    assert list(tmp_path.iterdir()) == []


def test_json_lines_are_the_messages_in_order(tmp_path):
    done = converted(BAGS / "talker", tmp_path / "made.jsonl", "jsonl")
    lines = [json.loads(line) for line in (tmp_path / "made.jsonl").read_text().splitlines()]
    assert done.messages == len(lines) == 20
    assert [each["log_time_ns"] for each in lines] == [each[3] for each in everything(BAGS / "talker")]
    assert next(each["message"]["data"] for each in lines if each["topic"] == "/topic") == "Hello, world! 0"


def odd_bag(path, *, foreign=False):
    """Topics whose names are none, one of JSON, and one with a message that cannot be read."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("", "a test")
        schema = writer.register_schema("std_msgs/msg/Bool", "ros2msg", b"bool data\n")
        loose = writer.register_schema("odd/msg/Note", "jsonschema", b"{}")
        for topic, data in (("/../../etc/x", b"\0\1\0\0\1"), ("/a/b", b"\0\1\0\0\1"), ("/A_b", b"\0\1\0\0\7")):
            writer.add_message(writer.register_channel(topic, "cdr", schema), 1, data, 1, 1)
        writer.add_message(writer.register_channel("/note", "json", loose), 2, b'{"text": "a,b"}', 2, 2)
        if foreign:
            writer.add_message(writer.register_channel("/foreign", "protobuf", 0), 3, b"abc", 3, 3)
        writer.finish()
    return path


def test_topic_names_become_safe_and_distinct_file_names(tmp_path, golden):
    done = converted(odd_bag(tmp_path / "odd.mcap"), tmp_path / "out", "csv")
    assert sorted(each.name for each in (tmp_path / "out").iterdir()) == [
        "A_b-2.csv",
        "a_b.csv",
        "etc_x.csv",
        "note.csv",
    ]
    assert sorted(each.name for each in tmp_path.iterdir()) == ["odd.mcap", "out"]
    assert (done.messages, done.left_out) == (3, 1)
    golden(next(iter(done.faults.values())))
    assert (tmp_path / "out/note.csv").read_text().splitlines() == [
        "log_time_ns,sequence,message",
        '2,2,"{""text"": ""a,b""}"',
    ]


@pytest.mark.parametrize("topic", ["", "/", "..", "-rf", "a\0b", "x" * 400, ".hidden", "con\x1b"])
def test_any_name_becomes_a_plain_one(topic):
    from busflow.recording.bag.channel import Channel

    name = FileNames(".csv").of(Channel(topic, "", "", "", ""))
    assert len(name) < 200
    assert not set(name) - set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.-")
    assert name[0] not in ".-"


def test_a_ros_2_bag_omits_unreadable_encodings(tmp_path, golden):
    done = converted(odd_bag(tmp_path / "odd.mcap"), tmp_path / "out", "ros2bag")
    assert (done.messages, done.left_out) == (3, 1)
    golden(next(iter(done.faults.values())))


@pytest.mark.parametrize(("form", "messages"), [("csv", 3), ("jsonl", 3), ("parquet", 2), ("mcap", 5), ("ros2bag", 3)])
def test_foreign_topics_are_left_out_of_conversion(tmp_path, form, messages):
    path = odd_bag(tmp_path / "odd.mcap", foreign=True)
    done = converted(path, tmp_path / "out", form)
    assert (done.messages, done.left_out) == (messages, 5 - messages)
    reasons = {each.topic: reason for each, reason in done.faults.items()}
    assert (form == "mcap") == ("/foreign" not in reasons)
    assert form in ("mcap", "ros2bag") or "'protobuf'" in reasons["/foreign"]


def test_topic_without_hash_is_left_out_for_ros(tmp_path):
    with (tmp_path / "odd.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start("", "a test")
        for topic, definition in (("/good", b"bool data\n"), ("/bad", b"float64[" + b"9" * 5000 + b"] x\n")):
            schema = writer.register_schema("a/msg/B", "ros2msg", definition)
            writer.add_message(writer.register_channel(topic, "cdr", schema), 1, b"\0\1\0\0\1", 1, 1)
        writer.finish()
    done = converted(tmp_path / "odd.mcap", tmp_path / "out", "ros2bag")
    assert [each.topic for each in done.faults] == ["/bad"]
    with AnyReader([tmp_path / "out"]) as reader:
        assert [each.topic for each in reader.connections] == ["/good"]


def test_no_readable_topic_is_an_error(tmp_path, golden):
    with Bag(odd_bag(tmp_path / "odd.mcap", foreign=True)) as bag:
        foreign = [each for each in bag.channels if each.topic == "/foreign"]
        with golden.raises(BagError):
            convert(bag, tmp_path / "out", TargetFormat.CSV, json.dumps, channels=foreign)
    assert not (tmp_path / "out").exists()


@pytest.fixture(params=[StoragePlugin.MCAP, StoragePlugin.SQLITE3], ids=["mcap", "sqlite3"])
def pings(tmp_path, request):
    """A bag of rosbags with two topics without fields: of a type that nobody else knows, and of ROS's own."""
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg("", "odd/msg/Ping"))
    with RosbagsWriter(tmp_path / "pings", version=9, storage_plugin=request.param) as writer:
        for time_ns, name in enumerate(("odd/msg/Ping", "std_msgs/msg/Empty"), start=1):
            connection = writer.add_connection(f"/{name.lower()}", name, typestore=store)
            writer.write(connection, time_ns, b"\0\1\0\0\0")
    return tmp_path / "pings"


@pytest.mark.parametrize("form", TargetFormat)
def test_types_without_fields_are_converted(tmp_path, pings, form):
    done = converted(pings, tmp_path / "made", form)
    assert (done.messages, done.faults) == (2, {})
    with Bag(pings) as bag:
        assert examine(bag).findings == []
        hashes = [each.type.type_hash for each in bag.channels]
    if form in ("mcap", "ros2bag"):
        with Bag(tmp_path / "made") as made:
            assert examine(made).findings == []
            assert [each.type.type_hash for each in made.channels] == hashes


def test_a_missing_definition_stays_missing(tmp_path):
    with (tmp_path / "a.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "")
        writer.add_message(
            writer.register_channel("/p", "cdr", writer.register_schema("odd/msg/P", "", b"")), 0, b"", 0
        )
        writer.finish()
    converted(tmp_path / "a.mcap", tmp_path / "b.mcap", "mcap")
    with Bag(tmp_path / "b.mcap") as made:
        assert made.channels[0].fault is not None


def test_a_part_says_that_it_is_one(tmp_path):
    with Bag(BAGS / "talker") as bag:
        channels = [each for each in bag.channels if each.topic == "/topic"]
        convert(bag, tmp_path / "part.mcap", TargetFormat.MCAP, json.dumps, channels=channels)
    with Bag(tmp_path / "part.mcap") as part:
        assert [each.topic for each in part.channels] == ["/topic"]
        assert part.incomplete == ()
        assert str(part.series[0].cut) == "a part of talker, without /rosout"


@pytest.mark.parametrize("form", ["csv", "jsonl", "mcap", "ros2bag", "parquet"])
def test_a_failure_overwrites_and_leaves_no_file(tmp_path, form, golden):
    (tmp_path / "there").touch()
    with golden.raises(BagError):
        converted(BAGS / "talker", tmp_path / "there", form)
    with golden.raises(BagError):
        converted(BAGS / "talker", tmp_path / "none/there", form)
    assert [each.name for each in tmp_path.iterdir()] == ["there"]


class Sized(NamedTuple):
    payload: bytes


def test_messages_are_paired_in_order_by_topic():
    pairs: Pairs[Sized] = Pairs()
    first, second = Sized(b"1"), Sized(b"2")
    assert [pairs.take("/a", 0, first), pairs.take("/a", 0, second), pairs.take("/b", 1, second)] == [None] * 3
    assert pairs.take("/a", 1, Sized(b"x")) is first
    assert [(each.topic, each.side, list(each.waiting)) for each in pairs.left()] == [
        ("/a", 0, [second]),
        ("/b", 1, [second]),
    ]


def test_counterpart_that_was_let_go_is_an_error():
    pairs: Pairs[Sized] = Pairs(most_bytes=300)
    assert [pairs.take("/a", 0, Sized(b"1")), pairs.take("/a", 0, Sized(b"2"))] == [None, None]
    assert [each.let_go for each in pairs.left()] == [1]
    assert pairs.take("/a", 1, Sized(b"x")) == Sized(b"1")
    with pytest.raises(LetGo):
        pairs.take("/a", 1, Sized(b"y"))
