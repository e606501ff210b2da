"""What a recording says of itself is held against what is there."""

import os
import shutil
from pathlib import Path
from struct import pack

import pytest
from mcap.writer import CompressionType, Writer

from busflow import Node, publisher, timer
from busflow.msgs.std_msgs import Int64
from busflow.recording.bag.bag import Bag
from busflow.recording.mcap.chunks import Chunk
from busflow.recording.mcap.contents import Contents
from busflow.recording.tools.verify import examine
from busflow.testing import harness, virtual_time
from tests.recording.conftest import write_numbers


def found_in(path):
    """The findings of a recording, as kind and code, and what is said of them."""
    with Bag(path) as bag:
        findings = examine(bag).findings
    return [(each.kind.value, each.code) for each in findings], " / ".join(each.message for each in findings)


MINE = {"format": "1"}


def write(path, *messages, facts=MINE, ledger=None, definition=b"bool data\n", metadata=None, **settings):
    """A recording of messages that are given as their number and their bytes."""
    with path.open("wb") as stream:
        writer = Writer(stream, enable_data_crcs=True, **settings)
        writer.start("ros2", "a test")
        if facts:
            writer.add_metadata("busflow", facts)
        schema = writer.register_schema("std_msgs/msg/Bool", "ros2msg", definition)
        channel = writer.register_channel("/a", "cdr", schema, metadata or {})
        for number, data in messages:
            writer.add_message(channel, number, data, number, number)
        if ledger is not None:
            writer.add_metadata("busflow.ledger", ledger)
        writer.finish()
    return path


TRUE = b"\0\1\0\0\1"
RIGHT = {"recorded": "2", "missed": "0", "complete": "true", "report": "{}"}


def test_what_is_right_is_found_to_be_right(tmp_path, numbers):
    assert found_in(numbers) == ([], "")
    assert found_in(write(tmp_path / "a.mcap", (1, TRUE), (2, TRUE), ledger=RIGHT)) == ([], "")


@pytest.mark.parametrize(
    ("numbers_", "ledger", "codes", "said"),
    [
        ((1, 2), None, [("incomplete", "unfinished")], "did not finish it"),
        ((1, 3), RIGHT, [("incomplete", "sequence")], "message 2 is missing"),
        ((2, 9), RIGHT, [("incomplete", "sequence")] * 2, "message 1 is missing / messages 3 to 8 are missing"),
        ((1, 2), RIGHT | {"missed": "4"}, [("incomplete", "missed")], "could not keep up with 4 messages"),
        ((1, 2), RIGHT | {"recorded": "3"}, [("wrong", "ledger")], "3 messages were recorded, and 2 are there"),
        ((1, 2), RIGHT | {"complete": "false"}, [("incomplete", "unfinished")], "its recorder says so"),
        ((1, 2), RIGHT | {"missed": "1"}, [("incomplete", "missed")], "could not keep up with 1 message"),
        (
            (1, 2),
            RIGHT | {"report": '{"topics": [{"name": "/a", "published": 3}, {"name": "/b", "published": 9}, 5]}'},
            [("wrong", "ledger")],
            "says that 3 messages were published on /a, and 2 are there",
        ),
        ((1, 2), RIGHT | {"report": '{"topics": 7}'}, [], ""),
        ((2, 1), RIGHT, [("incomplete", "sequence"), ("wrong", "sequence")], "message 1 comes after message 2"),
    ],
)
def test_numbers_agree_with_the_ledger(tmp_path, numbers_, ledger, codes, said):
    found, text = found_in(write(tmp_path / "a.mcap", *((each, TRUE) for each in numbers_), ledger=ledger))
    assert found == codes
    assert said in text


def test_outside_recording_knows_only_the_published_counts(tmp_path):
    told = RIGHT | {"report": '{"topics": [{"name": "/a", "published": 300}]}'}
    path = write(tmp_path / "a.mcap", (1, TRUE), (2, TRUE), ledger=told, facts={"format": "1", "heard": "from outside"})
    assert found_in(path) == ([], "")


def test_a_message_that_its_type_cannot_read(tmp_path, golden):
    bad = [(number, b"\0\1\0\0\7") for number in range(2, 9)]
    found, text = found_in(write(tmp_path / "a.mcap", (1, TRUE), *bad, facts=None))
    assert found == [("wrong", "message")] * 4
    golden(text)


def test_an_invalid_definition_or_false_hash_is_wrong(tmp_path, golden):
    found, text = found_in(write(tmp_path / "a.mcap", (1, TRUE), facts=None, definition=b"bool\n"))
    assert found == [("wrong", "type")]
    golden(text)
    hashed = {"topic_type_hash": "RIHS01_" + "0" * 64}
    found, text = found_in(write(tmp_path / "b.mcap", (1, TRUE), facts=None, metadata=hashed))
    assert found == [("wrong", "type")]
    assert "not RIHS01_0000" in text


def test_a_cut_is_incomplete_and_a_flip_wrong(numbers):
    content = numbers.read_bytes()
    numbers.write_bytes(content[: len(content) // 2])
    assert found_in(numbers)[0] == [("incomplete", "unfinished")]
    flipped = bytearray(content)
    flipped[len(content) // 2] ^= 1
    numbers.write_bytes(flipped)
    assert {kind for kind, _ in found_in(numbers)[0]} == {"wrong"}


def test_what_a_damage_has_taken_is_counted_once(tmp_path, golden):
    ledger = RIGHT | {"recorded": "400"}
    path = write(tmp_path / "a.mcap", *((number, TRUE) for number in range(1, 401)), ledger=ledger, chunk_size=1000)
    content = bytearray(path.read_bytes())
    with Contents(path) as contents:
        second = [found.offset for found in contents.beyond_damage() if isinstance(found.record, Chunk)][1]
    content[second + 60] ^= 0xFF
    path.write_bytes(content)
    with Bag(path) as bag:
        found = examine(bag)
    assert [each.code for each in found.findings] == ["damaged", "damaged", "ledger"]
    golden(found.findings[-1].message)
    assert 0 < found.messages < found.there < 400


@pytest.mark.parametrize("step", [31, pytest.param(11, marks=pytest.mark.long)])
def test_crc_of_all_finds_every_flipped_bit(tmp_path, step):
    path = write_numbers(tmp_path / "all.mcap", 10, chunk_size=200, enable_data_crcs=True)
    content = path.read_bytes()
    unnoticed = []
    for bit in range(0, len(content) * 8, step):
        flipped = bytearray(content)
        flipped[bit // 8] ^= 1 << bit % 8
        path.write_bytes(flipped)
        try:
            if not found_in(path)[0]:
                unnoticed.append(bit // 8)
        except ValueError:
            pass
    assert unnoticed == []


def test_a_false_count_in_the_summary_is_wrong(tmp_path):
    path = write_numbers(tmp_path / "a.mcap", 10, compression=CompressionType.NONE)
    content = bytearray(path.read_bytes())
    content[content.rindex(pack("<BQQ", 11, 56, 10)) + 9] ^= 1
    path.write_bytes(content)
    assert found_in(path)[0] == [("wrong", "statistics"), ("wrong", "damaged")]  # its checksum is wrong, too


def test_a_false_index_or_chunk_time_is_wrong(tmp_path):
    path = write_numbers(tmp_path / "a.mcap", 10, chunk_size=10_000, compression=CompressionType.NONE)
    content = bytearray(path.read_bytes())
    index = content.rindex(pack("<BQH", 7, 6 + 160, 1))
    content[index + 15 + 3] ^= 1
    path.write_bytes(content)
    assert found_in(path)[0] == [("wrong", "index")]
    content[index + 15 + 3] ^= 1
    path.write_bytes(content)
    with Contents(path) as contents:
        start = next(each.offset for each in contents if isinstance(each.record, Chunk))
    content[start + 9 + 8] ^= 1
    path.write_bytes(content)
    assert ("wrong", "chunk") in found_in(path)[0]


@pytest.mark.parametrize(
    "ledger", [None, RIGHT, *(RIGHT | each for each in ({"complete": "false"}, {"missed": "2"}, {"recorded": "7"}))]
)
def test_verify_agrees_with_info(tmp_path, ledger):
    path = write(tmp_path / "a.mcap", (1, TRUE), (2, TRUE), ledger=ledger)
    with Bag(path) as bag:
        assert "; ".join(bag.incomplete) == found_in(path)[1]


@pytest.fixture(scope="module")
def split(tmp_path_factory):
    """A recording in at least four parts, as its run has written it."""
    path = tmp_path_factory.mktemp("split") / "run"
    virtual_time(_record_parts)(path)
    assert len(list(path.glob("*.mcap"))) >= 4
    return path


class Counter(Node):
    numbers = publisher(Int64, "numbers")

    @timer(0.1)
    def count(self) -> None:
        self.numbers.publish(Int64(data=1))


async def _record_parts(path):
    async with harness(Counter, record={"to": f"{path}.mcap", "split": {"duration": "2s"}}) as lab:
        await lab.advance(8)


@pytest.mark.parametrize("described", [True, False], ids=["metadata", "no metadata"])
@pytest.mark.parametrize(
    "change", [Path.unlink, lambda part: os.truncate(part, 0), lambda part: os.truncate(part, 1500)]
)
@pytest.mark.parametrize("number", [0, 1, -1])
def test_recording_without_one_of_its_parts_is_incomplete(split, tmp_path, number, change, described):
    path = tmp_path / "run"
    shutil.copytree(split, path)
    change(sorted(path.glob("*.mcap"))[number])
    if not described:
        (path / "metadata.yaml").unlink()
    with Bag(path) as bag:
        kinds = {each.kind.value for each in examine(bag).findings}
        assert (kinds, bag.complete) == ({"incomplete"}, False)


def test_recording_without_its_metadata_is_incomplete(split, tmp_path):
    path = tmp_path / "run"
    shutil.copytree(split, path)
    assert found_in(path) == ([], "")
    (path / "metadata.yaml").unlink()
    codes, text = found_in(path)
    assert codes == [("incomplete", "unfinished")]
    assert "metadata.yaml" in text
