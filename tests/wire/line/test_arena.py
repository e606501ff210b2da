"""Arena: what is written is read by another mapping, and no place is given twice."""

import mmap
import os

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.wire.line.arena import Arena, ForeignArena, Piece, Pieces, Places

PAGE = mmap.PAGESIZE


@pytest.mark.hypothesis
@given(st.lists(st.one_of(st.integers(0, 9 * PAGE), st.floats(0, 1, exclude_max=True)), max_size=120))
def test_places_never_overlap_and_all_come_back(steps):
    """A number takes a place of this size; a fraction frees the place at this part of those that are taken."""
    places, taken = Places(32 * PAGE), list[tuple[int, int]]()
    for step in steps:
        if isinstance(step, int):
            offset = places.take(step)
            if offset is None:
                gaps = holes(places.capacity, taken)
                assert all(gap < pages(step) for gap in gaps)
                continue
            assert 0 <= offset <= places.capacity - pages(step)
            assert all(offset + pages(step) <= at or at + pages(size) <= offset for at, size in taken)
            taken.append((offset, step))
        elif taken:
            places.free(*taken.pop(int(step * len(taken))))
        assert places.taken == sum(pages(size) for _, size in taken)
    for offset, size in taken:
        places.free(offset, size)
    assert places.take(places.capacity) == 0


def pages(size: int) -> int:
    return max(-(-size // PAGE), 1) * PAGE


def holes(capacity: int, taken: list[tuple[int, int]]) -> list[int]:
    """Return the sizes of what is free."""
    found, end = list[int](), 0
    for offset, size in sorted(taken):
        found.append(offset - end)
        end = offset + pages(size)
    return [*found, capacity - end]


def test_the_lowest_place_is_taken_first():
    places = Places(8 * PAGE)
    assert [places.take(PAGE) for _ in range(3)] == [0, PAGE, 2 * PAGE]
    places.free(0, PAGE)
    assert places.take(1) == 0


def test_a_message_is_read_through_another_mapping():
    arena = Arena(1 << 20)
    foreign = ForeignArena(arena.fd, arena.capacity)
    first, second = arena.store(b"first"), arena.store(Pieces([b"sec", memoryview(b"ond")], 6))
    assert [Piece(foreign, each.offset, each.size).to_bytes() for each in (first, second)] == [b"first", b"second"]


def test_a_place_is_free_when_each_holder_has_released_it():
    arena = Arena(1 << 20)
    stored = arena.store(b"x")
    stored.hold()
    stored.release()
    assert arena.taken == PAGE
    stored.release()
    assert arena.taken == 0


def test_a_full_arena_takes_no_more():
    arena = Arena(1 << 20)
    assert arena.store(bytes(1 << 20)) is not None
    assert arena.store(b"x") is None


def test_the_memory_cannot_shrink():
    arena = Arena(1 << 20)
    with pytest.raises(PermissionError):
        os.ftruncate(arena.fd, 0)


def test_memory_that_could_shrink_is_not_read():
    fd = os.memfd_create("other", os.MFD_ALLOW_SEALING)
    os.ftruncate(fd, 1 << 20)
    with pytest.raises(OSError, match="shrink"):
        ForeignArena(fd, 1 << 20)
    os.close(fd)
    arena = Arena(1 << 20)
    with pytest.raises(OSError, match="smaller"):
        ForeignArena(arena.fd, (1 << 20) + 1)


def test_memory_that_no_message_has_needed_is_given_back():
    arena = Arena(1 << 20)
    first, second = arena.store(bytes(10 * PAGE)), arena.store(b"kept")
    arena.trim()
    assert (arena.written, memory_of(arena)) == (11 * PAGE, 11 * PAGE)
    second.release()
    arena.trim()  # it was needed since the last call
    assert memory_of(arena) == 11 * PAGE
    arena.trim()
    assert (arena.written, memory_of(arena)) == (10 * PAGE, 10 * PAGE)
    first.release()
    arena.trim()
    arena.trim()
    assert (arena.written, memory_of(arena)) == (0, 0)


def memory_of(arena: Arena) -> int:
    return os.fstat(arena.fd).st_blocks * 512


def test_the_descriptor_is_closed_with_the_arena():
    arena = Arena(1 << 20)
    fd = arena.fd
    del arena
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(fd)
