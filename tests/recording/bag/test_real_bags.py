"""Bags that ROS 2 recorded, read as rosbags reads them; their hashes are those of ROS 2's own generator."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from busflow.cli import main
from busflow.recording.bag.bag import Bag

BAGS = Path(__file__).parents[2] / "cases/rosbag2"
FILES = sorted(BAGS.glob("*/*.mcap"))

each_file = pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)


_ONLY_ROSBAGS = {"__msgtype__", "structure_needs_at_least_one_member"}
"""What rosbags tells beside a message's fields; the names of constants it has in upper case."""


def _unsigned(name: str, value: Any) -> Any:
    """ROS 2's `byte` is an octet, from 0 to 255, which rosbags takes for a signed number."""
    return value.astype(np.uint8) if name.startswith("byte_") and isinstance(value, np.ndarray) else value


def plain(value: Any) -> Any:
    """A message of rosbags, or what busflow made of one, as lists, dictionaries and scalars."""
    if isinstance(value, memoryview | np.ndarray | list | tuple):
        items = value.tolist() if isinstance(value, memoryview | np.ndarray) else value
        return [plain(each) for each in items]
    if isinstance(value, dict):
        return {name: plain(each) for name, each in value.items()}
    if hasattr(value, "__dataclass_fields__"):
        names = [name for name in value.__dataclass_fields__ if name not in _ONLY_ROSBAGS and not name.isupper()]
        return {name: plain(_unsigned(name, getattr(value, name))) for name in names}
    return value


def hashes() -> Iterator[Any]:
    """Every topic of which ROS 2 has written the type's hash."""
    for file in sorted(BAGS.glob("*/metadata.yaml")):
        told = yaml.safe_load(file.read_text("utf-8"))["rosbag2_bagfile_information"]
        for each in told["topics_with_message_count"]:
            topic = each["topic_metadata"]
            if topic.get("type_description_hash") and each["message_count"]:
                yield pytest.param(file.parent, topic["name"], topic["type_description_hash"], id=topic["name"])


@each_file
def test_the_messages_are_those_that_mcap_reads(path: Path):
    with path.open("rb") as stream:
        theirs = [
            (channel.topic, message.log_time, message.data)
            for _, channel, message in make_reader(stream).iter_messages()
        ]
    with Bag(path) as bag:
        ours = [(each.channel.topic, each.log_time_ns, each.payload) for each in bag.entries()]
        assert bag.damage is None
        assert bag.complete
    assert sorted(ours) == sorted(theirs)
    assert ours


@each_file
def test_every_message_is_read_as_rosbags_reads_it(path: Path):
    store = get_typestore(Stores.ROS2_JAZZY)
    with Bag(path) as bag:
        for each in bag.entries():
            name = each.channel.type.name
            if name.endswith("_Event"):
                continue  # of which rosbags knows no definition
            if name not in store.types:
                store.register(get_types_from_msg(each.channel.definition, name))
            theirs = store.deserialize_cdr(each.payload, name)
            assert plain(each.channel.plain(each.payload)) == plain(theirs)


@pytest.mark.parametrize(("folder", "topic", "type_hash"), list(hashes()))
def test_a_recorded_definition_hashes_as_in_ros2(folder: Path, topic: str, type_hash: str):
    (path,) = folder.glob("*.mcap")
    with Bag(path) as bag:
        (channel,) = [each for each in bag.channels if each.topic == topic]
        assert channel.type.type_hash == type_hash


def test_bag_info_lists_the_contents(capsys: pytest.CaptureFixture[str]):
    assert main(["bag", "info", str(BAGS / "talker/talker.mcap")]) == 0
    out = capsys.readouterr().out
    assert "complete" in out
    assert "rcl_interfaces/msg/Log" in out
