"""The files that are written are those that MCAP's own writer writes, byte for byte where that has a choice."""

import io
import random
import tracemalloc

import pytest
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from busflow.launchfile.model.description import Compression
from busflow.recording.bag.bag import Bag
from busflow.recording.mcap.writer import LARGE, McapWriter
from busflow.recording.tools.verify import examine

SCHEMA = ("std_msgs/msg/String", "ros2msg", b"string data\n")
WORDS = {"one": "1", "two": "zwei"}


def some_messages(count, *, large=0):
    randomness = random.Random(count)
    for n in range(count):
        size = large if large and n % 7 == 3 else randomness.randrange(200)
        yield 1 + n % 2, n + 1, 10**18 + n * 10**6, randomness.randbytes(size)


def ours(messages, compression=Compression.NONE, chunk_bytes=4096, cut_at=(), **options):
    file = io.BytesIO()
    writer = McapWriter(file, library="test", compression=compression, chunk_bytes=chunk_bytes, **options)
    writer.add_metadata("busflow", WORDS)
    writer.add_attachment("launch.yaml", "application/yaml", b"nodes: {}\n", time_ns=5)
    writer.add_schema(1, *SCHEMA)
    writer.add_channel(1, "/a", "cdr", 1, WORDS)
    writer.add_channel(2, "/b", "cdr", 1, {})
    for channel, sequence, time_ns, payload in messages:
        writer.add_message(channel, sequence, time_ns, payload)
        if sequence in cut_at:
            writer.cut()
    writer.finish()
    writer.close()
    return file.getvalue()


def theirs(messages, chunk_bytes=4096, cut_at=()):
    file = io.BytesIO()
    writer = Writer(file, chunk_size=chunk_bytes - 1, compression=CompressionType.NONE, enable_data_crcs=True)
    writer.start("ros2", "test")
    writer.add_metadata("busflow", WORDS)
    writer.add_attachment(5, 5, "launch.yaml", "application/yaml", b"nodes: {}\n")
    writer.register_schema(*SCHEMA)
    writer.register_channel("/a", "cdr", 1, WORDS)
    writer.register_channel("/b", "cdr", 1, {})
    for channel, sequence, time_ns, payload in messages:
        writer.add_message(channel, time_ns, payload, time_ns, sequence)
        if sequence in cut_at:
            writer.flush()
    writer.finish()
    return file.getvalue()


@pytest.mark.parametrize("cut_at", [(), (1, 2, 60, 199)])
@pytest.mark.parametrize("large", [0, LARGE, 3 * LARGE])
def test_a_file_is_the_one_that_mcap_writes(large, cut_at):
    messages = list(some_messages(200, large=large))
    assert ours(messages, cut_at=cut_at) == theirs(messages, cut_at=cut_at)


@pytest.mark.parametrize("compression", list(Compression))
@pytest.mark.parametrize("large", [0, 3 * LARGE])
def test_what_is_compressed_is_what_was_written(compression, large):
    messages = list(some_messages(300, large=large))
    file = io.BytesIO(ours(messages, compression))
    found = [
        (channel.id, message.sequence, message.log_time, message.data)
        for _, channel, message in make_reader(file, validate_crcs=True).iter_messages(log_time_order=False)
    ]
    assert found == messages
    file.seek(0)
    chunks = [each for each in StreamReader(file, emit_chunks=True).records if isinstance(each, Chunk)]
    assert {each.compression for each in chunks} == {"" if compression is Compression.NONE else compression.value}


def test_a_message_in_parts_is_written_as_joined():
    def in_parts(payload):
        return [payload[:7], memoryview(payload)[7:50], payload[50:]]

    messages = list(some_messages(100, large=3 * LARGE))
    split = [(*head, in_parts(payload)) for *head, payload in messages]
    for compression in (Compression.NONE, Compression.ZSTD, Compression.LZ4):
        assert ours(split, compression)[:200] == ours(messages, compression)[:200]
    assert ours(split) == ours(messages)


def test_a_finished_chunk_is_readable_before_the_end(tmp_path):
    path = tmp_path / "run.mcap"
    with path.open("wb", buffering=0) as file:
        writer = McapWriter(file, library="test")
        writer.add_schema(1, *SCHEMA)
        writer.add_channel(1, "/a", "cdr", 1, {})
        writer.add_message(1, 1, 10, b"first")
        assert (writer.open_chunk, writer.open_since) == (True, 10)
        writer.cut()
        assert not writer.open_chunk
        writer.add_message(1, 2, 20, b"second")
        assert writer.size == path.stat().st_size
        with Bag(path) as bag:
            assert [entry.payload for entry in bag.entries()] == [b"first"]
        writer.close()


def test_partial_writes_are_continued_to_the_end():
    class Slow(io.BytesIO):
        def write(self, data):
            return super().write(data[:100])

    messages = list(some_messages(50))
    slow = Slow()
    writer = McapWriter(slow, library="test")
    quick = io.BytesIO()
    other = McapWriter(quick, library="test")
    for each in (writer, other):
        each.add_channel(1, "/a", "", 0, {})
        each.add_channel(2, "/b", "", 0, {})
        for message in messages:
            each.add_message(*message)
        each.finish()
        each.close()
    assert slow.getvalue() == quick.getvalue()


MORE_THAN_A_MEBIBYTE = 13_000
"""So many chunks have an index that waits on the disk."""


def tiny(count):
    return ((1 + n % 2, n + 1, n, b"x") for n in range(count))


@pytest.mark.long
def test_an_index_that_waits_on_the_disk_is_written_as_any(tmp_path):
    def messages():
        for each in tiny(MORE_THAN_A_MEBIBYTE):
            yield each
            assert not list(tmp_path.iterdir())  # nothing is left behind, whenever the process ends

    found = ours(messages(), chunk_bytes=1, folder=tmp_path)
    assert found == theirs(messages(), chunk_bytes=1)


@pytest.mark.long
def test_memory_does_not_grow_with_the_number_of_chunks(tmp_path):
    class Nowhere:
        def write(self, data):
            return len(data)

    def peak(chunks):
        writer = McapWriter(Nowhere(), library="test", chunk_bytes=1, compression=Compression.NONE, folder=tmp_path)
        writer.add_channel(1, "/a", "", 0, {})
        writer.add_channel(2, "/b", "", 0, {})
        tracemalloc.start()
        for message in tiny(chunks):
            writer.add_message(*message)
        writer.finish()
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        writer.close()
        return most

    peak(1)
    assert peak(10 * MORE_THAN_A_MEBIBYTE) < 1.1 * peak(MORE_THAN_A_MEBIBYTE)


def test_only_messages_in_what_is_left_of_a_file_count():
    file = io.BytesIO()
    writer = McapWriter(file, library="test", chunk_bytes=1 << 20)
    for channel in (1, 2, 3):
        writer.add_channel(channel, f"/{channel}", "", 0, {})
    ends = []
    for n, message in enumerate(some_messages(60)):
        writer.add_message(*message)
        if n % 6 == 5:
            writer.cut()
            ends.append(writer.size)
    assert writer.written == 60
    writer.cut_off(writer.size)
    assert writer.written == 60
    writer.cut_off(ends[6])
    assert writer.written == 42
    writer.close()


def test_summary_that_readers_would_refuse_leaves_out_the_index_of_chunks(tmp_path):
    messages = list(some_messages(500))
    whole = ours(messages)
    size = len(whole) - make_reader(io.BytesIO(whole)).get_summary().chunk_indexes[-1].chunk_start_offset
    assert ours(messages, most_summary=size) == whole
    path = tmp_path / "run.mcap"
    path.write_bytes(ours(messages, most_summary=800))
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert (summary.chunk_indexes, summary.statistics.message_count) == ([], 500)
        assert [message.data for _, _, message in reader.iter_messages(["/b"])] == [each[3] for each in messages[1::2]]
    with Bag(path) as bag:
        assert [entry.payload for entry in bag.entries()] == [each[3] for each in messages]
        found = examine(bag)
        late = [entry.sequence for entry in bag.entries(start_ns=messages[400][2])]
    assert late == [each[1] for each in messages[400:]]
    indexed = tmp_path / "indexed.mcap"
    indexed.write_bytes(whole)
    with Bag(indexed) as bag:
        assert [each.message for each in examine(bag).findings] == [each.message for each in found.findings]
