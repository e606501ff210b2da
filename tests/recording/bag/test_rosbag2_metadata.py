"""The metadata of a directory are such that ROS 2's readers find its files, topics and times."""

import shutil
from dataclasses import replace
from pathlib import Path

import yaml
from rosbags.rosbag2 import Reader

from busflow.errors import BagError
from busflow.recording.bag.bag import Bag
from busflow.recording.bag.bag_file import Survey
from busflow.recording.bag.channel import Channel
from busflow.recording.bag.rosbag2_metadata import FileCounts, write_metadata
from tests.golden import Golden
from tests.recording.bag.written_by_rosbags import STORE, write_bag

LAST_NS = (1 << 63) - 1


def qos(channel: Channel) -> str:
    return channel.qos or ""


def two_files(folder: Path) -> list[FileCounts]:
    """The recordings of two bags in one directory, and their counts."""
    folder.mkdir()
    found: list[FileCounts] = []
    for name in ("one", "two"):
        bag = write_bag(folder.parent / name)
        with Bag(bag) as opened:
            counts = dict.fromkeys(opened.channels, 1)
            found.append(FileCounts(f"{name}.mcap", Survey(counts, opened.start_ns, opened.end_ns)))
        shutil.copy(next(bag.glob("*.mcap")), folder / f"{name}.mcap")
    return found


def stated(folder: Path) -> dict[str, object]:
    return yaml.safe_load((folder / "metadata.yaml").read_text("utf-8"))["rosbag2_bagfile_information"]


def test_another_reader_finds_all_files(tmp_path: Path):
    folder = tmp_path / "bag"
    write_metadata(folder, two_files(folder), qos=qos)
    with Reader(folder) as reader:
        assert (reader.message_count, reader.start_time, reader.end_time) == (6, 1_000, 1_003)
        assert {each.topic: each.digest for each in reader.connections} == {
            "/imu/data": STORE.hash_rihs01("sensor_msgs/msg/Imu"),
            "/joint_states": STORE.hash_rihs01("sensor_msgs/msg/JointState"),
            "/talk": STORE.hash_rihs01("std_msgs/msg/String"),
        }
        assert {each.ext.offered_qos_profiles[0].depth for each in reader.connections} == {5}
        assert len(list(reader.messages())) == 6


def test_each_file_has_its_own_span(tmp_path: Path):
    folder = tmp_path / "bag"
    one, two = two_files(folder)
    write_metadata(folder, [one, replace(two, found=Survey({}, None, None))], qos=qos)
    assert stated(folder)["files"] == [
        {
            "path": "one.mcap",
            "duration": {"nanoseconds": 2},
            "starting_time": {"nanoseconds_since_epoch": 1_000},
            "message_count": 3,
        },
        {
            "path": "two.mcap",
            "duration": {"nanoseconds": 0},
            "starting_time": {"nanoseconds_since_epoch": LAST_NS},
            "message_count": 0,
        },
    ]


def test_service_events_state_no_hash(tmp_path: Path):
    event = Channel("/reset/_service_event", "std_srvs/srv/Trigger_Event", "cdr", "", "ros2msg", "RIHS01_" + "0" * 64)
    write_metadata(tmp_path, [FileCounts("a.mcap", Survey({event: 2}, 5, 6))], qos=qos)
    (topic,) = stated(tmp_path)["topics_with_message_count"]  # pyright: ignore[reportGeneralTypeIssues]  # plain YAML
    assert (topic["topic_metadata"]["type_description_hash"], topic["message_count"]) == ("", 2)


def test_custom_words_stand_beside_ros_words(tmp_path: Path):
    write_metadata(tmp_path, [FileCounts("a.mcap", Survey({}, None, None))], qos=qos, custom={"busflow.run": "lab1"})
    assert stated(tmp_path)["custom_data"] == {"busflow.run": "lab1"}
    assert [each.name for each in tmp_path.iterdir()] == ["metadata.yaml"]


def test_metadata_that_cannot_be_written_leaves_nothing(tmp_path: Path, golden: Golden):
    (tmp_path / "metadata.yaml").mkdir()
    with golden.raises(BagError):
        write_metadata(tmp_path, [], qos=qos)
    assert [each.name for each in tmp_path.iterdir()] == ["metadata.yaml"]
