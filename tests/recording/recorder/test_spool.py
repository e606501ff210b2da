"""The queue before a recording's file: what it has no room for it refuses, and it never waits for the disk."""

import errno
import threading

import pytest

from busflow import timeouts
from busflow.recording.bag.bag import Bag
from busflow.recording.mcap.writer import McapWriter
from busflow.recording.player.player import Player
from busflow.recording.recorder.destination import Destination
from busflow.recording.recorder.recorder import record_graph
from busflow.recording.recorder.recording_file import RecordingFile
from busflow.recording.recorder.spool import Spool
from busflow.runner.graph import Graph

LONG_S = 30.0


class Disk(Destination):
    """A disk that can be held up, and that can fail."""

    def __init__(self, path):
        super().__init__(path)
        self.free = threading.Event()
        self.free.set()
        self.reached = threading.Event()
        self.closed = threading.Event()
        self.error = self.broken = None
        self.secured = None

    def secure(self):
        super().secure()
        if self.broken is not None:
            raise self.broken
        self.secured = self.path.stat().st_size

    def close(self):
        super().close()
        self.closed.set()

    def write(self, data):
        self.reached.set()
        self.free.wait(LONG_S)
        if self.error is not None:
            super().write(data[: len(data) // 2])
            raise self.error
        return super().write(data)


@pytest.fixture
def disk(tmp_path):
    return Disk(tmp_path / "run.mcap")


def spool_on(disk, *, threaded=True, most_bytes=1 << 20, on_failure=print):
    file = McapWriter(disk, library="test")
    file.add_channel(1, "/a", "", 0, {})
    disk.reached.clear()
    return Spool(
        RecordingFile(disk, file),
        threaded=threaded,
        on_failure=on_failure,
        most_bytes=most_bytes,
    )


def sequences(disk):
    with Bag(disk.path) as bag:
        return [entry.sequence for entry in bag.entries()]


def finish(spool):
    assert spool.do(lambda file: file.conclude({}, 0, 0))
    return spool.close()


@pytest.mark.parametrize("threaded", [True, False])
def test_everything_is_written_in_order(disk, threaded):
    spool = spool_on(disk, threaded=threaded)
    assert all(spool.put(1, n, n, b"x" * n) for n in range(1, 400))
    assert finish(spool)
    assert sequences(disk) == list(range(1, 400))


def test_blocked_disk_delays_no_publisher(disk):
    spool = spool_on(disk, most_bytes=100_000)
    disk.free.clear()
    taken = [spool.put(1, n, n, bytes(1000)) for n in range(1, 1000)]
    assert taken[:50] == [True] * 50
    refused = taken.count(False)
    assert refused > 0
    disk.free.set()
    assert finish(spool)
    assert sequences(disk) == [n for n, each in enumerate(taken, 1) if each]


def test_waiting_messages_are_written_within_half_a_second(disk):
    spool = spool_on(disk)
    spool.put(1, 1, 1, b"only")
    assert disk.reached.wait(LONG_S)  # this thread does nothing: the spool's own has to see to it
    assert finish(spool)


@pytest.mark.parametrize("threaded", [True, False])
def test_a_full_disk_leaves_a_readable_file(disk, threaded):
    heard = []
    spool = spool_on(disk, threaded=threaded, on_failure=heard.append)
    for n in range(1, 200):
        assert spool.put(1, n, n, bytes(1000))
    while not disk.reached.wait(0.01):
        spool.put(1, 1000, 1000, bytes(1000))
    size = disk.path.stat().st_size
    disk.error = OSError(errno.ENOSPC, "No space left on device")
    n = 2000
    while spool.put(1, n, n, bytes(10_000)) or (threaded and not heard):
        n += 1
    assert [each.errno for each in heard] == [errno.ENOSPC] * threaded  # else the answer says it
    assert spool.failure is disk.error
    assert not spool.do(lambda file: file.conclude({}, 0, 0))
    assert not spool.close()
    assert disk.path.stat().st_size >= size
    with Bag(disk.path) as bag:
        found = [entry.sequence for entry in bag.entries()]
        assert not bag.complete
    assert found[:100] == list(range(1, 101))


def test_without_a_thread_message_times_end_the_chunks(disk):
    spool = spool_on(disk, threaded=False)
    written = []
    for n in range(1, 30):
        spool.put(1, n, n * 100_000_000, b"x")
        written.append(disk.path.stat().st_size)
    assert len(set(written)) == 1 + 29 // 4
    finish(spool)


@pytest.mark.parametrize("error", [None, OSError(errno.EIO, "broken")])
def test_file_is_closed_after_close_timed_out(disk, limits, error):
    limits(recording_end=0.05)
    spool = spool_on(disk)
    disk.free.clear()
    spool.put(1, 1, 1, b"x")
    assert not spool.close()
    assert not disk.closed.is_set(), "the thread may still write it"
    disk.error = error
    disk.free.set()
    assert disk.closed.wait(LONG_S)


def test_close_waits_for_a_stalled_disk_until_timeout(disk, limits):
    limits(recording_end=0.05)
    spool = spool_on(disk)
    disk.free.clear()
    spool.put(1, 1, 1, b"x")
    assert not spool.close()
    limits(recording_end=LONG_S)
    disk.free.set()
    assert spool.close()


def test_a_recorded_runs_end_allows_the_spools_timeout(tmp_path):
    graph = Graph([Player(file=tmp_path / "none.mcap")])
    record_graph(graph, str(tmp_path / "run.mcap"))
    assert graph.course.end_s == timeouts.current.recording_end


@pytest.mark.parametrize("threaded", [True, False])
def test_close_syncs_a_real_time_recording_to_disk(disk, threaded):
    spool = spool_on(disk, threaded=threaded)
    spool.put(1, 1, 1, b"x")
    assert finish(spool)
    assert disk.secured == (disk.path.stat().st_size if threaded else None)


def test_disk_without_fsync_is_reported(disk):
    heard = []
    spool = spool_on(disk, on_failure=heard.append)
    disk.broken = OSError(errno.EIO, "Input/output error")
    assert not finish(spool)
    assert heard == [disk.broken]
