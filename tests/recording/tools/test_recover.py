"""What can be read of a damaged recording becomes a whole file, which says that it was recovered."""

import json
from dataclasses import replace

import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from busflow.errors import BagError
from busflow.recording.bag.bag import Bag
from busflow.recording.mcap.contents import Contents
from busflow.recording.tools.recover import recover
from busflow.recording.tools.verify import examine
from tests.recording.conftest import write_numbers


def write_run(path, *, finish=True, ledger=True):
    """A recording as busflow makes one, of 300 numbers on two topics."""
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=900)
        writer.start("ros2", "busflow 0; mcap 0")
        writer.add_metadata("busflow", {"format": "1", "run": "lab", "seed": "7", "clock": "sim", "started": "5"})
        writer.add_attachment(0, 0, "launch.yaml", "application/yaml", b"name: lab\n")
        schema = writer.register_schema("std_msgs/msg/Int8", "ros2msg", b"int8 data\n")
        topics = [writer.register_channel(name, "cdr", schema, {"k": "v"}) for name in ("/a", "/b")]
        for number in range(1, 301):
            writer.add_message(topics[number % 2], number * 10, b"\0\1\0\0" + bytes([number % 100]), number * 9, number)
        if ledger:
            report = json.dumps({"name": "lab"})
            writer.add_metadata(
                "busflow.ledger", {"report": report, "recorded": "300", "missed": "0", "complete": "true"}
            )
        if finish:
            writer.finish()
        else:
            writer.flush()
    return path


def entries(path):
    with Bag(path) as bag:
        return [(each.channel.topic, *each[1:]) for each in bag.entries()]


def chunks(path):
    with Contents(path) as contents:
        return [found.offset for found in contents if type(found.record).__name__ == "Chunk"]


def test_an_unfinished_file_is_completed_and_keeps_everything(tmp_path, golden):
    broken = write_run(tmp_path / "broken.mcap", finish=False, ledger=False)
    content = broken.read_bytes()
    found = recover(broken, tmp_path / "saved.mcap")
    assert (found.messages, found.missing, found.attachments, found.metadata) == (300, 0, 1, 1)
    assert broken.read_bytes() == content
    assert entries(tmp_path / "saved.mcap") == entries(broken)
    with Bag(tmp_path / "saved.mcap") as bag:
        golden("\n".join(bag.incomplete))
        assert (bag.facts.run, bag.facts.seed, bag.facts.launch_file) == ("lab", 7, "name: lab\n")
        assert all(each.count == 150 for each in bag.channels)
    with (tmp_path / "saved.mcap").open("rb") as stream:
        assert sum(1 for _ in make_reader(stream, validate_crcs=True).iter_messages()) == 300


def test_what_follows_a_damaged_chunk_is_kept(tmp_path):
    broken = write_run(tmp_path / "broken.mcap")
    truth = entries(broken)
    content = bytearray(broken.read_bytes())
    content[chunks(broken)[3] + 100] ^= 1
    broken.write_bytes(content)
    assert len(entries(broken)) < 100
    found = recover(broken, tmp_path / "saved.mcap")
    saved = entries(tmp_path / "saved.mcap")
    assert set(saved) < set(truth)
    assert found.messages == len(saved) > 250
    assert found.missing == 300 - len(saved)
    with Bag(tmp_path / "saved.mcap") as bag:
        assert any("a chunk is damaged" in each for each in bag.incomplete)
        assert any(each.startswith("300 ") and f" {len(saved)} " in each for each in bag.incomplete)


def test_the_summary_helps_past_a_lost_record_length(tmp_path):
    broken = write_run(tmp_path / "broken.mcap")
    content = bytearray(broken.read_bytes())
    first, second = chunks(broken)[:2]
    content[first + 4] ^= 0x40
    content[second + 60] ^= 1
    broken.write_bytes(content)
    found = recover(broken, tmp_path / "saved.mcap")
    assert len(found.damages) == 2
    assert 200 < found.messages < 300
    assert found.strays == 0
    assert {each[0] for each in entries(tmp_path / "saved.mcap")} == {"/a", "/b"}


def test_messages_of_a_lost_topic_are_only_counted(tmp_path):
    broken = write_run(tmp_path / "broken.mcap", finish=False)
    content = bytearray(broken.read_bytes())
    content[chunks_of_unfinished(broken)[0] + 60] ^= 1
    broken.write_bytes(content)
    found = recover(broken, tmp_path / "saved.mcap")
    assert (found.messages, entries(tmp_path / "saved.mcap")) == (0, [])
    assert found.strays > 200


def chunks_of_unfinished(path):
    with Contents(path) as contents:
        return [found.offset for found in contents.beyond_damage() if type(found.record).__name__ == "Chunk"]


@pytest.mark.parametrize("step", [485, pytest.param(97, marks=pytest.mark.long)])
def test_every_cut_is_recovered_correctly(tmp_path, step):
    whole = write_run(tmp_path / "whole.mcap")
    content, truth = whole.read_bytes(), entries(whole)
    for size in range(60, len(content), step):
        (tmp_path / "cut.mcap").write_bytes(content[:size])
        found = recover(tmp_path / "cut.mcap", tmp_path / "saved.mcap")
        assert entries(tmp_path / "saved.mcap") == truth[: found.messages]
        with Bag(tmp_path / "saved.mcap") as bag:
            assert {each.kind for each in examine(bag).findings} == {"incomplete"}
            assert not bag.complete
        (tmp_path / "saved.mcap").unlink()


def test_what_is_whole_is_copied_and_stays_complete(tmp_path):
    whole = write_run(tmp_path / "whole.mcap")
    assert recover(whole, tmp_path / "saved.mcap").damages == []
    with Bag(tmp_path / "saved.mcap") as bag, Bag(whole) as before:
        assert bag.complete
        assert bag.digest() == before.digest()
        assert replace(bag.ledger, report={}) == replace(before.ledger, report={})


def test_a_split_bag_becomes_one_file(tmp_path):
    bag = tmp_path / "split"
    bag.mkdir()
    for number in range(3):
        write_numbers(bag / f"split_{number}.mcap", 50, finish=number < 2, compression=CompressionType.LZ4)
    found = recover(bag, tmp_path / "saved.mcap")
    assert found.messages == 150
    assert len(Bag(tmp_path / "saved.mcap").channels) == 1


def test_a_failure_overwrites_and_leaves_no_file(tmp_path, golden):
    whole = write_run(tmp_path / "whole.mcap")
    for target in (whole, tmp_path):
        with golden.raises(BagError):
            recover(whole, target)
    with golden.raises(BagError):
        recover(whole, tmp_path / "none/saved.mcap")
    (tmp_path / "odd.mcap").write_bytes(b"hello")
    with golden.raises(BagError):
        recover(tmp_path / "odd.mcap", tmp_path / "saved.mcap")
    assert sorted(each.name for each in tmp_path.iterdir()) == ["odd.mcap", "whole.mcap"]
