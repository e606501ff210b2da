"""Bags of ROS 2: what rosbags writes is read, and so are payloads that real ROS 2 has recorded."""

import json
import re
import sqlite3
import sys
from contextlib import closing, suppress
from pathlib import Path

import numpy as np
import pytest
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from busflow.errors import BagError
from busflow.msgs.rcl_interfaces import ParameterEvent
from busflow.msgs.sensor_msgs import Imu, JointState
from busflow.msgs.std_msgs import String
from busflow.recording.bag.bag import Bag
from busflow.recording.tools.recover import recover
from busflow.recording.tools.verify import examine

STORE = get_typestore(Stores.ROS2_JAZZY)
CASES = Path(__file__).parents[2] / "cases"
STORAGES = pytest.mark.parametrize("storage", [StoragePlugin.MCAP, StoragePlugin.SQLITE3], ids=["mcap", "sqlite3"])
VERSIONS = pytest.mark.parametrize("version", [8, 9])
OFFERED = Qos(
    QosHistory.KEEP_LAST,
    5,
    QosReliability.RELIABLE,
    QosDurability.VOLATILE,
    QosTime(9223372036, 854775807),
    QosTime(9223372036, 854775807),
    QosLiveliness.AUTOMATIC,
    QosTime(9223372036, 854775807),
    False,
)


def messages():
    """Topic, type and value of a few messages with arrays, text and messages inside messages."""
    types = STORE.types
    stamp = types["builtin_interfaces/msg/Time"](sec=7, nanosec=8)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="imu_link")
    vector, quaternion = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    yield (
        "/imu/data",
        "sensor_msgs/msg/Imu",
        types["sensor_msgs/msg/Imu"](
            header=header,
            orientation=quaternion(x=0.0, y=0.5, z=0.0, w=1.0),
            orientation_covariance=np.arange(9, dtype=np.float64),
            angular_velocity=vector(x=1.0, y=2.0, z=3.0),
            angular_velocity_covariance=np.zeros(9),
            linear_acceleration=vector(x=0.0, y=0.0, z=9.81),
            linear_acceleration_covariance=np.zeros(9),
        ),
    )
    yield (
        "/joint_states",
        "sensor_msgs/msg/JointState",
        types["sensor_msgs/msg/JointState"](
            header=header,
            name=["hüfte", "", "knee"],
            position=np.array([0.1, 0.2, 0.3]),
            velocity=np.array([]),
            effort=np.array([1e300, -0.0, np.inf]),
        ),
    )
    yield "/talk", "std_msgs/msg/String", types["std_msgs/msg/String"](data="Grüße")


def write_bag(path, storage=StoragePlugin.MCAP, version=9, compression=None):
    to = Writer(path, version=version, storage_plugin=storage)
    if compression:
        to.set_compression(compression, CompressionFormat.ZSTD)
    with to as writer:
        for number, (topic, name, message) in enumerate(messages()):
            connection = writer.add_connection(topic, name, typestore=STORE, offered_qos_profiles=[OFFERED])
            writer.write(connection, 1_000 + number, STORE.serialize_cdr(message, name))
    return path


@VERSIONS
@STORAGES
def test_a_bag_written_by_rosbags_is_read(tmp_path, storage, version):
    with Bag(write_bag(tmp_path / "bag", storage, version)) as bag:
        assert bag.complete, bag.incomplete
        assert (bag.start_ns, bag.end_ns, bag.messages) == (1_000, 1_002, 3)
        assert [each.topic for each in bag.channels] == ["/imu/data", "/joint_states", "/talk"]
        for channel in bag.channels:
            assert channel.type_hash in (None, STORE.hash_rihs01(channel.type_name))
            assert channel.type.type_hash == STORE.hash_rihs01(channel.type_name)
            assert "depth: 5" in (channel.qos or "")
        imu, joints, talk = bag.entries()
    plain = imu.channel.plain(imu.payload)
    assert plain["orientation_covariance"].tolist() == list(range(9))
    assert plain["header"] == {"stamp": {"sec": 7, "nanosec": 8}, "frame_id": "imu_link"}
    assert imu.channel.decode(imu.payload, Imu).linear_acceleration.z == 9.81
    decoded = joints.channel.decode(joints.payload, JointState)
    assert (decoded.name, decoded.effort[0]) == (("hüfte", "", "knee"), 1e300)
    assert talk.channel.plain(talk.payload) == {"data": "Grüße"}


def test_every_ros_type_hashes_as_in_ros():
    wrong = [name for name in sorted(STORE.types) if "/msg/" in name and not agrees(name)]
    # rosbags hashes a char as it is in IDL, which is not how ROS 2 hashes it.
    assert [name for name in wrong if "char" not in STORE.generate_msgdef(name, ros_version=2)[0]] == []


def agrees(name):
    from busflow.interfaces.encoding.description import rihs01
    from busflow.interfaces.encoding.msg_text import parse

    return rihs01(parse(name, STORE.generate_msgdef(name, ros_version=2)[0])) == STORE.hash_rihs01(name)


def recorded():
    return json.loads((CASES / "g_cdr_recorded.json").read_text("utf-8"))["cases"]


@STORAGES
def test_what_real_ros_2_has_recorded_is_read(tmp_path, storage):
    cases = recorded()
    with Writer(tmp_path / "bag", version=9, storage_plugin=storage) as writer:
        topics = {}
        for case in cases:
            if case["topic"] not in topics:
                topics[case["topic"]] = writer.add_connection(case["topic"], case["type"], typestore=STORE)
            writer.write(topics[case["topic"]], 1, bytes.fromhex(case["cdr"]))
    with Bag(tmp_path / "bag") as bag:
        entries = list(bag.entries())
    for entry, case in zip(entries, cases, strict=True):
        told = entry.channel.plain(entry.payload)
        assert as_plain(told) == {name: value for name, value in case["value"].items() if name in told}
        assert told.keys() >= {name for name in case["value"] if not name.isupper()}, "constants are no fields"
    classes = {"rcl_interfaces/msg/ParameterEvent": ParameterEvent, "std_msgs/msg/String": String}
    for entry in entries:
        if entry.channel.type_name in classes:
            entry.channel.decode(entry.payload, classes[entry.channel.type_name])


def as_plain(value):
    match value:
        case dict():
            return {key: as_plain(each) for key, each in value.items()}
        case memoryview():
            return value.tolist()
        case tuple():
            return [as_plain(each) for each in value]
        case _:
            return value


@pytest.mark.parametrize("schema", [2, 3])
def test_an_old_database_is_read_with_busflows_types(tmp_path, schema):
    bag = write_bag(tmp_path / "bag", StoragePlugin.SQLITE3)
    with closing(sqlite3.connect(next(bag.glob("*.db3")), isolation_level=None)) as database:
        database.execute("DROP TABLE message_definitions")
        database.execute("ALTER TABLE topics DROP COLUMN type_description_hash")
        database.execute("UPDATE schema SET schema_version = ?", [schema])
    with Bag(bag) as opened:
        assert [each.channel.plain(each.payload)["data"] for each in opened.entries(["/talk"])] == ["Grüße"]


def test_a_bag_without_metadata_is_read(tmp_path):
    bag = write_bag(tmp_path / "bag")
    (bag / "metadata.yaml").unlink()
    with Bag(bag) as opened:
        assert len(list(opened.entries())) == 3
        assert opened.incomplete == ("it has no metadata.yaml: its recorder was killed, or still records",)


@pytest.mark.parametrize("name", ["../../etc/passwd", "/etc/passwd", "sub/../../outside.mcap", ".", "", "a\0b"])
def test_a_file_that_lies_elsewhere_is_refused(tmp_path, name):
    bag = write_bag(tmp_path / "bag")
    (tmp_path / "outside.mcap").write_bytes(next(bag.glob("*.mcap")).read_bytes())
    metadata = bag / "metadata.yaml"
    metadata.write_text(metadata.read_text("utf-8").replace("  - bag.mcap", f"  - {json.dumps(name)}"), "utf-8")
    with pytest.raises(BagError, match=r"metadata\.yaml"):
        Bag(bag)


def test_a_link_that_leads_elsewhere_is_refused(tmp_path):
    bag = write_bag(tmp_path / "bag")
    file = next(bag.glob("*.mcap"))
    file.rename(tmp_path / "outside.mcap")
    file.symlink_to(tmp_path / "outside.mcap")
    with pytest.raises(BagError, match="does not lie in the directory of the bag"):
        Bag(bag)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{}", "has no rosbag2_bagfile_information"),
        ("a: &x 1\nb: *x", "line"),
        ("rosbag2_bagfile_information: {storage_identifier: lance}", "stored as 'lance'; mcap and sqlite3 are read"),
        ("rosbag2_bagfile_information: {storage_identifier: mcap}", "relative_file_paths names no files"),
        ("x" * (1 << 20) + "y", "larger than 1024 KiB"),
    ],
)
def test_invalid_metadata_is_refused_in_one_line(tmp_path, text, said):
    (tmp_path / "metadata.yaml").write_text(text)
    with pytest.raises(BagError) as error:
        Bag(tmp_path)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_a_directory_without_a_recording_is_refused(tmp_path):
    with pytest.raises(BagError, match=r"no metadata\.yaml and no recording"):
        Bag(tmp_path)


def test_a_database_that_is_none_is_refused(tmp_path):
    bag = write_bag(tmp_path / "bag", StoragePlugin.SQLITE3)
    next(bag.glob("*.db3")).write_bytes(b"hello")
    with pytest.raises(BagError, match=r"file is not a database; sqlite3 has \.recover"):
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


def test_a_database_is_verified_and_not_recovered(tmp_path):
    with Bag(write_bag(tmp_path / "bag", StoragePlugin.SQLITE3)) as opened:
        assert examine(opened).findings == []
    with pytest.raises(BagError, match="a database, or a compressed bag, is not recovered"):
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


def test_topic_with_contradicting_metadata_is_reported_missing(tmp_path):
    bag = write_bag(tmp_path / "bag", compression=CompressionMode.FILE)
    metadata = bag / "metadata.yaml"
    metadata.write_text(metadata.read_text("utf-8").replace("name: /talk", "name: /walk"), "utf-8")
    with Bag(bag) as opened:
        assert len(list(opened.entries())) == 2
        assert "3 messages are announced, and 2 are there" in opened.damage.what


@pytest.mark.parametrize("compression", [None, CompressionMode.FILE])
def test_without_rosbags_the_error_says_what_to_install(tmp_path, monkeypatch, compression):
    storage = StoragePlugin.MCAP if compression else StoragePlugin.SQLITE3
    bag = write_bag(tmp_path / "bag", storage, compression=compression)
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    with pytest.raises(
        BagError, match=r"read with rosbags, which is not installed; in a clone of busflow: pip install '\.\[rosbags\]'"
    ):
        Bag(bag)
