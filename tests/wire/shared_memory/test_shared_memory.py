"""Arenas, their writers and readers, here and in another process: `place.py`, `arena.py`, `writer.py`, `reader.py`."""

import errno
import math
import mmap
import os
import platform
import stat
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from busflow.errors import MalformedMessage
from busflow.wire.shared_memory.arena import HEADER_BYTES, MARKS, MOST_BYTES, Arena, Arenas
from busflow.wire.shared_memory.place import PLACE_BYTES, MemoryPlace
from busflow.wire.shared_memory.reader import MemoryReader
from busflow.wire.shared_memory.writer import MemoryWriter
from tests.wire.conftest import NODES

pytestmark = pytest.mark.skipif(
    not hasattr(os, "memfd_create") or platform.machine() != "x86_64", reason="memory is shared on Linux, x86-64, only"
)

PATIENCE_S = 60.0


def message(number, size=100):
    """Pieces as an encoder makes them: bytes, and an array."""
    return [bytes([number] * 4), np.full(size - 4, number, np.uint8)]


def test_what_is_written_is_read():
    arena = Arena(1000)
    place = MemoryPlace.decode(arena.write([b"head", np.arange(3, dtype="<u2")], 10).encode())
    assert MemoryReader("reader").read(place) == b"head\0\0\1\0\2\0"


def test_newest_messages_are_whole_and_older_gone():
    arena, reader = Arena(350), MemoryReader("reader")
    places = [arena.write(message(number), 100) for number in range(10)]
    found = [reader.read(place) for place in places]
    assert found == [None] * 7 + [bytes([number] * 100) for number in (7, 8, 9)]


def test_overwritten_while_copied_counts_as_gone(monkeypatch):
    arena = Arena(350)

    class Slow(mmap.mmap):
        """Mapped memory in which others write while a message is copied."""

        def __getitem__(self, where):
            if where.start:
                for number in range(2, 6):
                    arena.write(message(number), 100)
            return super().__getitem__(where)

    place = arena.write(message(1), 100)
    assert MemoryReader("reader").read(place) == bytes([1] * 100)
    monkeypatch.setattr("busflow.wire.shared_memory.reader.mmap.mmap", Slow)
    assert MemoryReader("reader").read(place) is None


def test_arena_is_private_and_of_fixed_size():
    fd = Arenas().make(100).write(message(1), 100).fd
    with pytest.raises(OSError, match=f"Errno {errno.EBADF}"):
        os.fstat(fd)  # the kernel has it back, since nothing holds the arena
    arena = Arena(1000)
    fd = arena.write(message(1), 100).fd
    assert stat.S_IMODE(os.fstat(fd).st_mode) == 0o600
    assert not os.get_inheritable(fd)
    for size in (0, 10 * HEADER_BYTES):
        with pytest.raises(PermissionError):
            os.ftruncate(fd, size)


def test_reader_opens_nothing_but_the_named_arena(tmp_path: Path):
    arena = Arena(1000)
    place = arena.write(message(1), 100)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    fds = [os.open(pipe, os.O_RDWR), os.memfd_create("other"), os.memfd_create("busflow")]
    os.ftruncate(fds[2], HEADER_BYTES + 1000)
    try:
        for other in [place._replace(fd=fd) for fd in fds]:
            assert MemoryReader("reader").read(other) is None
    finally:
        for fd in fds:
            os.close(fd)
    for other in (place._replace(key=bytes(16)), place._replace(pid=1 << 22), place._replace(fd=9999)):
        assert MemoryReader("reader").read(other) is None
    reader = MemoryReader("reader")
    for other in (place._replace(size=1 << 40), place._replace(position=1 << 50), place._replace(size=101)):
        assert reader.read(other) is None
    assert reader.read(place) == bytes([1] * 100)


@pytest.mark.parametrize("size", [0, PLACE_BYTES - 1, PLACE_BYTES + 1])
def test_bytes_that_are_no_place_are_malformed(size):
    with pytest.raises(MalformedMessage):
        MemoryPlace.decode(bytes(size))


def program(file):
    command = [sys.executable, NODES / file]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def test_reader_keeps_what_a_killed_writer_left():
    with program("write_memory.py") as writer:
        first, second = (MemoryPlace.decode(bytes.fromhex(writer.stdout.readline())) for _ in range(2))
        reader = MemoryReader("reader")
        assert reader.read(first) == bytes([7] * 50)
        writer.kill()
        writer.wait(PATIENCE_S)
    assert reader.read(second) == bytes([8] * 50)
    assert MemoryReader("later").read(second) is None


def test_another_process_reads_and_marks_its_progress():
    arenas = Arenas()
    writer = MemoryWriter(arenas)
    assert writer.write(message(0), 100) is None, "nobody is there who can read it"
    writer.share({"child"})
    with program("read_memory.py") as child:
        for number in range(40):
            place = writer.write(message(number, 200_000), 200_000)
            print(place.encode().hex(), file=child.stdin, flush=True)
            assert child.stdout.readline() == f"(200000, 1, {number})\n"
        assert writer.is_ready(200_000)
        child.stdin.close()
    assert arenas.capacity == 16 * 200_000
    for _ in range(16):
        writer.write(message(0, 200_000), 200_000)
    assert not writer.is_ready(200_000), "the child reads no more"


def test_reader_of_many_messages_loses_none(limits):
    limits(slow_reader=math.inf)
    writer, size, count = MemoryWriter(Arenas()), 50_000, 2000
    writer.share({"child"})
    pieces = [bytes(size)]
    with program("read_memory.py") as child:
        print(writer.write(pieces, size).encode().hex(), file=child.stdin, flush=True)
        answers = [child.stdout.readline()]
        thread = threading.Thread(target=lambda: answers.extend(child.stdout))
        thread.start()
        for _ in range(count - 1):
            print(writer.write(pieces, size).encode().hex(), file=child.stdin, flush=True)
        child.stdin.close()
        thread.join(PATIENCE_S)
    assert answers == ["(50000, 1, 0)\n"] * count


def test_slow_reader_is_waited_for_stopped_one_once():
    writer = MemoryWriter(Arenas())
    writer.share({"slow", "stopped"})
    slow, stopped = MemoryReader("slow"), MemoryReader("stopped")
    places = [writer.write(message(0, 100_000), 100_000)]
    assert None not in (slow.read(places[0]), stopped.read(places[0]))
    places += [writer.write(message(number, 100_000), 100_000) for number in range(1, 17)]
    assert not writer.is_ready(100_000)
    written = threading.Event()

    def go_on():
        writer.write(message(17, 100_000), 100_000)
        written.set()

    waiting = threading.Thread(target=go_on)
    waiting.start()
    assert [slow.read(place)[0] for place in places[1:]] == [*range(1, 17)], "nothing is overwritten meanwhile"
    assert written.wait(PATIENCE_S), "and the stopped one is given up"
    waiting.join(PATIENCE_S)
    assert writer.is_ready(100_000)
    assert stopped.read(places[1]) is None
    assert stopped.read(places[8])[0] == 8
    assert writer.is_ready(100_000)


def test_marks_of_departed_readers_are_free_again():
    writer = MemoryWriter(Arenas())
    for generation in range(3):
        names = {f"{generation}.{number}" for number in range(len(MARKS))}
        writer.share(names)
        place = writer.write(message(1, 100_000), 100_000)
        for name in names:
            assert MemoryReader(name).read(place)
        for _ in range(16):
            writer.write(message(1, 100_000), 100_000)
        assert not writer.is_ready(100_000), "each of them has its mark"


def test_arenas_of_a_process_have_a_limit():
    arenas = Arenas()
    kept = [arenas.make(8 << 20) for _ in range(4)]
    assert [each is not None for each in kept] == [True, True, True, True]
    assert arenas.capacity == MOST_BYTES
    assert arenas.make(1) is None
    kept.pop()
    assert arenas.make(1) is not None
    assert Arenas().make(MOST_BYTES) is None


def test_larger_messages_get_a_larger_arena():
    arenas = Arenas()
    writer = MemoryWriter(arenas)
    writer.share({"reader"})
    reader = MemoryReader("reader")
    for size in (100_000, 200_000, 5_000_000, 100_000, 60_000_000):
        place = writer.write(message(3, size), size)
        assert (place is None) == (size == 60_000_000)
        assert place is None or reader.read(place) == bytes([3] * size)
    assert arenas.capacity == 64 << 20
    assert writer.write(message(3), 100) is not None
