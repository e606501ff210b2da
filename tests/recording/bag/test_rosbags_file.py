"""Databases and compressed bags are read with rosbags, and what is damaged in them is found."""

import re
import sqlite3
import sys
from contextlib import closing, suppress

import pytest
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from busflow.errors import BagError
from busflow.recording.bag.bag import Bag
from busflow.recording.tools.recover import recover
from busflow.recording.tools.verify import examine
from tests.recording.bag.written_by_rosbags import STORAGES, messages, write_bag


@pytest.mark.parametrize("schema", [2, 3])
def test_an_old_database_is_read_with_busflows_types(tmp_path, schema):
    bag = write_bag(tmp_path / "bag", StoragePlugin.SQLITE3)
    with closing(sqlite3.connect(next(bag.glob("*.db3")), isolation_level=None)) as database:
        database.execute("DROP TABLE message_definitions")
        database.execute("ALTER TABLE topics DROP COLUMN type_description_hash")
        database.execute("UPDATE schema SET schema_version = ?", [schema])
    with Bag(bag) as opened:
        assert [each.channel.plain(each.payload)["data"] for each in opened.entries(["/talk"])] == ["Grüße"]


def test_a_database_that_is_none_is_refused(tmp_path, golden):
    bag = write_bag(tmp_path / "bag", StoragePlugin.SQLITE3)
    next(bag.glob("*.db3")).write_bytes(b"hello")
    with golden.raises(BagError):
        Bag(bag)


def test_a_truncated_database_is_damage_or_refused(tmp_path):
    bag = write_bag(tmp_path / "bag", StoragePlugin.SQLITE3)
    file = next(bag.glob("*.db3"))
    whole = file.read_bytes()
    for size in range(0, len(whole), 512):
        file.write_bytes(whole[:size])
        with suppress(BagError), Bag(bag) as opened:
            served = len(list(opened.entries()))
            assert opened.damage is not None or served == 3


@pytest.mark.parametrize(
    ("change", "what", "before"),
    [
        (
            "UPDATE messages SET data = 900000000 WHERE id = 2",
            "message 2 is int at",
            1,
        ),  # Python would make so many bytes
        ("UPDATE messages SET data = 'text' WHERE id = 2", "message 2 is str at", 1),
        ("UPDATE messages SET data = NULL WHERE id = 2", "message 2 is NoneType at", 1),
        ("UPDATE messages SET timestamp = 5.5 WHERE id = 2", r"message 1 is bytes at 5\.5", 0),
    ],
)
def test_a_value_of_another_type_is_damage(tmp_path, change, what, before):
    bag = write_bag(tmp_path / "bag", StoragePlugin.SQLITE3)
    with closing(sqlite3.connect(next(bag.glob("*.db3")), isolation_level=None)) as database:
        rows = database.execute("SELECT * FROM messages").fetchall()
        database.execute("DROP TABLE messages")
        database.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data)")
        database.executemany("INSERT INTO messages VALUES(?, ?, ?, ?)", rows)
        database.execute(change)
    with Bag(bag) as opened:
        assert len(list(opened.entries())) == before
        assert re.search(what, opened.damage.what)


def test_a_database_is_read_in_order_of_time(tmp_path):
    bag = write_bag(tmp_path / "bag", StoragePlugin.SQLITE3)
    with closing(sqlite3.connect(next(bag.glob("*.db3")), isolation_level=None)) as database:
        database.execute("UPDATE messages SET timestamp = 999 WHERE id = 3")
    with Bag(bag) as opened:
        found = [(each.channel.topic, each.log_time_ns, each.sequence) for each in opened.entries()]
        assert found == [("/talk", 999, 0), ("/imu/data", 1000, 0), ("/joint_states", 1001, 0)]
        assert [each.log_time_ns for each in opened.entries(start_ns=1000, end_ns=1000)] == [1000]
        assert list(opened.entries(["/nothing"])) == []


def test_a_database_is_verified_and_not_recovered(tmp_path, golden):
    with Bag(write_bag(tmp_path / "bag", StoragePlugin.SQLITE3)) as opened:
        assert examine(opened).findings == []
    with golden.raises(BagError):
        recover(tmp_path / "bag", tmp_path / "saved.mcap")


@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.MESSAGE])
@STORAGES
def test_a_compressed_bag_is_read(tmp_path, storage, mode):
    plain, packed = write_bag(tmp_path / "plain", storage), write_bag(tmp_path / "packed", storage, compression=mode)
    assert ("zstd" in "".join(each.suffix for each in packed.iterdir())) == (mode is CompressionMode.FILE)
    with Bag(plain) as one, Bag(packed) as other:
        assert other.complete, other.incomplete
        assert (other.messages, other.start_ns, other.end_ns) == (3, 1_000, 1_002)
        said = [
            [(each.channel.topic, each.log_time_ns, each.payload) for each in bag.entries()] for bag in (one, other)
        ]
        assert said[0] == said[1]
        assert [each.channel.type.name for each in other.entries()] == [name for _, name, _ in messages()]
        side_by_side = zip(other.entries(), other.entries(["/joint_states", "/talk"]), strict=False)
        assert [(one.channel.topic, two.channel.topic) for one, two in side_by_side] == [
            ("/imu/data", "/joint_states"),
            ("/joint_states", "/talk"),
        ]


def test_topic_with_contradicting_metadata_is_reported_missing(tmp_path, golden):
    bag = write_bag(tmp_path / "bag", compression=CompressionMode.FILE)
    metadata = bag / "metadata.yaml"
    metadata.write_text(metadata.read_text("utf-8").replace("name: /talk", "name: /walk"), "utf-8")
    with Bag(bag) as opened:
        assert len(list(opened.entries())) == 2
        golden(opened.damage.what)


@pytest.mark.parametrize("compression", [None, CompressionMode.FILE])
def test_without_rosbags_the_error_says_what_to_install(tmp_path, monkeypatch, compression, golden):
    storage = StoragePlugin.MCAP if compression else StoragePlugin.SQLITE3
    bag = write_bag(tmp_path / "bag", storage, compression=compression)
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    with golden.raises(BagError):
        Bag(bag)
