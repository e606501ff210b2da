"""Bags of ROS 2: what rosbags writes is read, and so are payloads that real ROS 2 has recorded."""

import json

import pytest
from rosbags.rosbag2 import Writer

from busflow.errors import BagError
from busflow.msgs.rcl_interfaces import ParameterEvent
from busflow.msgs.sensor_msgs import Imu, JointState
from busflow.msgs.std_msgs import String
from busflow.recording.bag.bag import Bag
from tests.recording.bag.written_by_rosbags import STORAGES, STORE, write_bag
from tests.vectors import cases

VERSIONS = pytest.mark.parametrize("version", [8, 9])


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
    from busflow.definitions.recorded import parse
    from busflow.interfaces.encoding.description import rihs01

    return rihs01(parse(name, STORE.generate_msgdef(name, ros_version=2)[0])) == STORE.hash_rihs01(name)


@STORAGES
def test_what_real_ros_2_has_recorded_is_read(tmp_path, storage):
    recorded = cases("g_cdr_recorded")
    with Writer(tmp_path / "bag", version=9, storage_plugin=storage) as writer:
        topics = {}
        for case in recorded:
            if case["topic"] not in topics:
                topics[case["topic"]] = writer.add_connection(case["topic"], case["type"], typestore=STORE)
            writer.write(topics[case["topic"]], 1, bytes.fromhex(case["cdr"]))
    with Bag(tmp_path / "bag") as bag:
        entries = list(bag.entries())
    for entry, case in zip(entries, recorded, strict=True):
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


def test_a_bag_without_metadata_is_read(tmp_path, golden):
    bag = write_bag(tmp_path / "bag")
    (bag / "metadata.yaml").unlink()
    with Bag(bag) as opened:
        assert len(list(opened.entries())) == 3
        golden("\n".join(opened.incomplete))


@pytest.mark.parametrize("name", ["../../etc/passwd", "/etc/passwd", "sub/../../outside.mcap", ".", "", "a\0b"])
def test_a_file_that_lies_elsewhere_is_refused(tmp_path, name):
    bag = write_bag(tmp_path / "bag")
    (tmp_path / "outside.mcap").write_bytes(next(bag.glob("*.mcap")).read_bytes())
    metadata = bag / "metadata.yaml"
    metadata.write_text(metadata.read_text("utf-8").replace("  - bag.mcap", f"  - {json.dumps(name)}"), "utf-8")
    with pytest.raises(BagError, match=r"metadata\.yaml"):
        Bag(bag)


def test_a_link_that_leads_elsewhere_is_refused(tmp_path, golden):
    bag = write_bag(tmp_path / "bag")
    file = next(bag.glob("*.mcap"))
    file.rename(tmp_path / "outside.mcap")
    file.symlink_to(tmp_path / "outside.mcap")
    with golden.raises(BagError):
        Bag(bag)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{}", "has no rosbag2_bagfile_information"),
        ("a: &x 1\nb: *x", "line"),
        ("rosbag2_bagfile_information: {storage_identifier: lance}", "stored as 'lance'; mcap and sqlite3 are read"),
        ("rosbag2_bagfile_information: {storage_identifier: mcap}", "relative_file_paths names no files"),
        ("x" * (8 << 20) + "y", "larger than 8192 KiB"),
    ],
)
def test_invalid_metadata_is_refused_in_one_line(tmp_path, text, said):
    (tmp_path / "metadata.yaml").write_text(text)
    with pytest.raises(BagError) as error:
        Bag(tmp_path)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_a_directory_without_a_recording_is_refused(tmp_path, golden):
    with golden.raises(BagError):
        Bag(tmp_path)
