"""Recordings that are cut off, flipped or made to hurt: what comes before is served, and one line says why no more."""

import random
import struct
import subprocess
import sys
import zlib
from contextlib import suppress
from functools import cache

import lz4.frame
import pytest
import zstandard
from hypothesis import given
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.records import Channel, Chunk, Footer, Header, Metadata, Schema
from mcap.writer import CompressionType

from busflow.errors import BagError
from busflow.recording.bag.bag import Bag
from busflow.recording.mcap.contents import Contents
from busflow.recording.mcap.records import MAGIC
from tests.recording.conftest import write_numbers

FRAME = struct.Struct("<BQ")
STEPS = [7, pytest.param(2, marks=pytest.mark.long)]
"""How many places are passed over: all but every seventh, or all but every second."""


def served(path):
    """The messages of a recording, and why there are no more."""
    with Bag(path) as bag:
        entries = [(each.channel.topic, each.sequence, each.log_time_ns, each.payload) for each in bag.entries()]
        return entries, bag.damage


def refused(path):
    """What is said of a recording that cannot be opened."""
    with pytest.raises(BagError) as error:
        Bag(path)
    return str(error.value)


def file_of(path, *records, end=b""):
    """A file of these records, or bytes of them, that has no footer."""
    builder = RecordBuilder()
    Header("ros2", "a test").write(builder)
    for each in records:
        builder.write(each) if isinstance(each, bytes) else each.write(builder)
    path.write_bytes(MAGIC + builder.end() + end)
    return path


def chunk(data, packed, compression):
    return Chunk(compression, packed, 0, 0, zlib.crc32(data), len(data))


def message(number, data=b"", channel=1):
    return FRAME.pack(5, 22 + len(data)) + struct.pack("<HIQQ", channel, number, number, number) + data


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A small recording, and what it holds."""
    path = write_numbers(tmp_path_factory.mktemp("whole") / "whole.mcap", 60, chunk_size=300)
    return path.read_bytes(), served(path)[0]


def check_prefix(path, content, truth):
    """A recording that was damaged serves what comes before, or is refused, and never passes for whole."""
    path.write_bytes(content)
    found, damage = [], "refused"
    with suppress(BagError):
        found, damage = served(path)
    assert found == truth[: len(found)]
    assert damage is not None or found == truth
    return len(found)


@pytest.mark.parametrize("step", STEPS)
def test_cut_file_serves_every_whole_chunk(tmp_path, whole, step):
    content, truth = whole
    sizes = [*range(0, len(content), step), len(content) - 1]
    counts = [check_prefix(tmp_path / "cut.mcap", content[:size], truth) for size in sizes]
    assert counts == sorted(counts)
    assert counts[-1] == len(truth)


@pytest.mark.parametrize("cuts", [4, pytest.param(12, marks=pytest.mark.long)])
def test_cut_long_file_serves_the_part_before(tmp_path, cuts):
    path = write_numbers(tmp_path / "long.mcap", 60_000, chunk_size=64 << 10, compression=CompressionType.NONE)
    content = path.read_bytes()
    truth, _ = served(path)
    assert len(content) > 2 << 20
    picked = random.Random(7)
    for _ in range(cuts):
        size = len(content) - picked.randrange(1, 1 << 20)
        check_prefix(tmp_path / "cut.mcap", content[:size], truth)


@pytest.mark.parametrize(
    "how", [{}, {"finish": False}, {"compression": CompressionType.NONE}, {"compression": CompressionType.LZ4}], ids=str
)
@pytest.mark.parametrize("step", STEPS)
def test_flipped_bit_is_noticed_or_changes_nothing(tmp_path, how, step):
    """Flips every bit of a record's frame, which no CRC protects, and every eleventh of the rest, or a sample."""
    path = write_numbers(tmp_path / "flipped.mcap", 8, chunk_size=150, **how)
    content, truth = path.read_bytes(), served(path)[0]
    bits = set(range(0, len(content) * 8, 11))
    with suppress(BagError), Contents(path) as contents:
        for found in contents:
            bits |= set(range(found.offset * 8, (found.offset + FRAME.size) * 8))
    for bit in sorted(bits)[::step]:
        flipped = bytearray(content)
        flipped[bit // 8] ^= 1 << bit % 8
        check_prefix(path, bytes(flipped), truth)


@given(data=st.data())
def test_flipped_bits_are_noticed_or_change_nothing(tmp_path_factory, whole, data):
    content, truth = whole
    flipped = bytearray(content)
    for bit in data.draw(st.lists(st.integers(0, len(content) * 8 - 1), min_size=1, max_size=3)):
        flipped[bit // 8] ^= 1 << bit % 8
    check_prefix(tmp_path_factory.getbasetemp() / "flipped.mcap", bytes(flipped), truth)


@given(data=st.data())
def test_inserted_bytes_are_noticed_or_harmless(tmp_path_factory, whole, data):
    content, truth = whole
    at = data.draw(st.integers(8, len(content)))
    inserted = data.draw(st.binary(min_size=1, max_size=40))
    over = data.draw(st.sampled_from([0, len(inserted)]))
    check_prefix(tmp_path_factory.getbasetemp() / "put.mcap", content[:at] + inserted + content[at + over :], truth)


@cache
def packed_zeros(compression):
    """Many, packed small; how many, and their CRC."""
    zeros = bytes(400 << 20)
    packed = {"zstd": zstandard.compress, "lz4": lz4.frame.compress}[compression](zeros)
    return packed, len(zeros), zlib.crc32(zeros)


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
@pytest.mark.parametrize("size", [None, 10, 100 << 20, (1 << 64) - 1], ids=["true", "small", "large", "absurd"])
def test_an_oversized_chunk_is_refused_before_unpacking(tmp_path, compression, size, golden):
    packed, length, crc = packed_zeros(compression)
    path = file_of(tmp_path / "bomb.mcap", Chunk(compression, packed, 0, 0, crc, length if size is None else size))
    found, damage = in_little_memory(path)
    assert found == 0
    assert "a chunk is damaged" in damage
    if (compression, size) == ("lz4", 10):  # lz4 does not say beforehand how large it will be
        golden(damage)


@pytest.mark.parametrize("length", [1 << 30, (1 << 63) - 1, (1 << 64) - 1])
@pytest.mark.parametrize("opcode", [3, 4, 5, 6, 9, 12, 200])
def test_a_record_longer_than_the_file_is_damage(tmp_path, opcode, length, golden):
    path = file_of(tmp_path / "long.mcap", end=FRAME.pack(opcode, length) + b"x" * 100)
    found, damage = served(path)
    assert (found, damage.offset) == ([], path.read_bytes().rindex(FRAME.pack(opcode, length)))
    golden(damage.what)


@pytest.mark.parametrize(
    ("packed", "compression", "size", "crc", "said"),
    [
        (b"abc", "", 4, 0, "it holds 3 bytes where it announces 4"),
        (b"abc", "", 2, 0, "it holds 3 bytes where it announces 2"),
        (b"abc", "", 3, 1, "not what its CRC stands for"),
        (b"abc", "zstd", 3, 0, "zstd says"),
        (b"abcdefgh" * 4, "lz4", 3, 0, "lz4 says"),
        (b"abc", "lz4", 3, 0, "it holds 0 bytes where it announces 3"),
        (b"abc", "br\x1b[31m", 3, 0, "packed as 'br"),
        (b"", "zstd", 3, 0, "zstd says"),
        (zstandard.compress(b"abc"), "zstd", 2, 0, "would be 3 bytes when unpacked where it announces 2"),
        (lz4.frame.compress(b"abc"), "lz4", 2, 0, "it holds 3 bytes where it announces 2"),
        (lz4.frame.compress(b"abc")[:-6], "lz4", 3, 0, "chunk"),
        (b"\0" * 9, "", 9, 0, "no record with the opcode 0"),
        (b"\x05" + b"\xff" * 8, "", 9, 0, "announces 18446744073709551615 bytes, and 0 are left"),
        (message(1), "", 31, 0, "a message is of channel 1, which is not declared before it"),
        (FRAME.pack(5, 3) + b"abc", "", 12, 0, "a message is cut off"),
    ],
)
def test_a_chunk_with_false_claims_is_refused(tmp_path, packed, compression, size, crc, said):
    path = file_of(tmp_path / "lie.mcap", Chunk(compression, packed, 0, 0, crc, size))
    found, damage = served(path)
    assert found == []
    assert said in str(damage)
    assert "\x1b" not in str(BagError(damage.what))


def test_a_redeclared_channel_or_missing_schema_is_damage(tmp_path, golden):
    first = Channel(1, "/a", "cdr", {}, 0)
    other = Channel(1, "/b", "cdr", {}, 0)
    found, damage = served(file_of(tmp_path / "a.mcap", first, message(1), other, message(2)))
    assert len(found) == 1
    golden(damage.what)
    _, damage = served(file_of(tmp_path / "b.mcap", Channel(1, "/a", "cdr", {}, 7)))
    golden(damage.what)
    _, damage = served(file_of(tmp_path / "c.mcap", Schema(1, b"", "", "x"), Schema(1, b"y", "", "x")))
    golden(damage.what)


def test_metadata_with_a_false_length_is_damage(tmp_path, golden):
    builder = RecordBuilder()
    Metadata("busflow", {"seed": "1"}).write(builder)
    record = bytearray(builder.end())
    record[9 + 4 + 7 : 9 + 4 + 7 + 4] = b"\xff\xff\xff\xff"
    _, damage = served(file_of(tmp_path / "m.mcap", bytes(record)))
    golden(damage.what)


def test_a_false_summary_offset_is_ignored(tmp_path, golden):
    for start in (1, 1 << 40, (1 << 64) - 1):
        builder = RecordBuilder()
        Footer(start, 0, 0).write(builder)
        path = file_of(tmp_path / "s.mcap", end=builder.end() + MAGIC)
        with Bag(path) as bag:
            golden(bag.incomplete[0])
            assert list(bag.entries()) == []


def test_what_a_time_is_does_not_matter(tmp_path):
    times = [5, 1 << 63, 0, (1 << 64) - 1, 5]
    body = b"".join(
        FRAME.pack(5, 22) + struct.pack("<HIQQ", 1, number, time_ns, 0) for number, time_ns in enumerate(times)
    )
    path = file_of(tmp_path / "t.mcap", Channel(1, "/a", "cdr", {}, 0), body)
    with Bag(path) as bag:
        assert [each.log_time_ns for each in bag.entries()] == times
        assert (bag.start_ns, bag.end_ns) == (0, (1 << 64) - 1)


def in_little_memory(path):
    """How many messages a recording serves in a process that may have 384 MiB, and why no more."""
    program = (
        "import resource, sys; resource.setrlimit(resource.RLIMIT_AS, (384 << 20, 384 << 20))\n"
        "from busflow.recording.bag.bag import Bag\n"
        "bag = Bag(sys.argv[1]); print(sum(1 for _ in bag.entries()), bag.damage)"
    )
    done = subprocess.run([sys.executable, "-c", program, str(path)], capture_output=True, text=True, timeout=170)
    assert done.returncode == 0, done.stderr
    count, _, damage = done.stdout.partition(" ")
    return int(count), damage


@pytest.mark.long
def test_many_small_lies_take_little_memory(tmp_path, golden):
    """A chunk of nothing but channels, packed small: what is declared is bounded, too."""
    builder = RecordBuilder()
    for number in range(1, 1 << 16):
        Channel(number, "/" + "x" * 900, "cdr", {}, 0).write(builder)
    data = builder.end()
    path = file_of(tmp_path / "many.mcap", *[chunk(data, zstandard.compress(data), "zstd") for _ in range(8)])
    assert path.stat().st_size < 4 << 20
    count, damage = in_little_memory(path)
    assert count == 0
    golden(damage, mask={r"at byte \d+": "at byte N"})


def test_a_pipe_is_refused_and_not_waited_for(tmp_path, golden):
    import os

    os.mkfifo(tmp_path / "pipe.mcap")
    golden(refused(tmp_path / "pipe.mcap"))
    assert "No such file" in refused(tmp_path / "none.mcap")
    assert "null" in refused("a\0b")


def test_a_file_truncated_during_reading_is_damage(tmp_path, golden):
    path = write_numbers(tmp_path / "shrink.mcap", 60_000, compression=CompressionType.NONE)
    with Bag(path) as bag:
        entries = bag.entries()
        next(entries)
        path.write_bytes(path.read_bytes()[:4000])
        list(entries)
        assert bag.damage is not None
        golden(bag.damage.what)
