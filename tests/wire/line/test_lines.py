"""Lines: two of them in one process, on one event loop, over a folder, with real sockets and memory."""

from __future__ import annotations

import asyncio
import os
import random
import resource
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Coroutine, Iterator
from functools import wraps
from pathlib import Path
from typing import Any

import pytest

from busflow.bus.qos import Overflow
from busflow.log import Logger
from busflow.wire.line.arena import Piece, Pieces
from busflow.wire.line.lines import Lines
from busflow.wire.line.packets import Reason, Wanted
from busflow.wire.zenoh.keys import Attachment, attachment_bytes
from busflow.wire.zenoh.run_directory import RunDirectory
from busflow.wire.zenoh.sender import LARGE

NODES = Path(__file__).parents[2] / "nodes"
KEY = "0/chatter/std_msgs::msg::dds_::String_/RIHS01_00"
GID = bytes(range(16))
LARGE_KEY = "0/cloud/sensor_msgs::msg::dds_::PointCloud2_/RIHS01_00"
LARGE_DEPTH = 4
"""The topic of the processes that `tests/nodes/line_end.py` starts, and the depth there."""
SLOW_NS = 1_000_000_000
"""A time between two messages after which the second leaves at once."""


def on_a_loop(test: Callable[..., Coroutine[Any, Any, None]]) -> Callable[..., None]:
    """Run a test on a loop of its own."""

    async def whole(ends: Ends, **fixtures: Any) -> None:
        try:
            await asyncio.wait_for(test(ends, **fixtures), 120)  # all of them together, on however slow a machine
        finally:
            ends.close()

    @wraps(test)
    def run(ends: Ends, **fixtures: Any) -> None:
        asyncio.run(whole(ends, **fixtures))

    return run


class Process:
    """One end: its lines, and what happens to them."""

    def __init__(self, folder: Path, session: str, *, has_packets: bool = True) -> None:
        self.session, self.log = session, []
        self._folder = folder
        self.changes: list[str] = []
        self.arrived: list[tuple[Any, int]] = []
        self.ends: list[str] = []
        log = Logger(lambda *line: self.log.append(line[:2]))
        self.lines = Lines(folder, session, self.changes.append, log, has_packets=has_packets)
        self.lines.begin()
        self.number = 0
        self.now_ns = SLOW_NS

    def receive(self, other: Process, depth: int = 10, overflow: Overflow = Overflow.DROP_OLDEST, *, key: str = KEY):
        """Receive a topic of another process, and acknowledge nothing."""

        def take(messages: Any) -> None:
            for payload, attachment in messages:
                number = Attachment.decode(attachment).sequence
                self.arrived.append((payload.to_bytes() if isinstance(payload, Piece) else payload, number))

        return self.lines.receive(
            other.session, key, Wanted(depth, overflow), take, lambda: self.ends.append(other.session)
        )

    def send(self, payload: bytes | Pieces, *, after_ns: int = SLOW_NS, key: str = KEY) -> None:
        self.number += 1
        self.now_ns += after_ns
        self.lines.send(key, payload, attachment_bytes(self.number, self.now_ns, GID), self.now_ns)

    def read_large(self, session: str, arrived: list[bytes], ended: list[bool], key: str = LARGE_KEY) -> None:
        """Receive large messages, and acknowledge each."""

        def take(messages: Any) -> None:
            arrived.extend(payload.to_bytes() for payload, _ in messages)
            intake.acknowledge(len(messages))

        intake = self.lines.receive(session, key, Wanted(LARGE_DEPTH), take, lambda: ended.append(True))

    def can_reach(self, session: str) -> bool:
        """Whether a session listens."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as probe:
            return probe.connect_ex(str(self._folder / f"~{session}")) == 0

    @property
    def numbers(self) -> list[int]:
        return [number for _, number in self.arrived]


class Ends:
    """Processes that can reach each other."""

    def __init__(self, directory: Path) -> None:
        self._folder, self._made = directory, list[Process]()

    def __call__(self, session: str, *, folder: Path | None = None, has_packets: bool = True) -> Process:
        self._made.append(Process(folder or self._folder, session, has_packets=has_packets))
        return self._made[-1]

    def close(self) -> None:
        for each in self._made:
            each.lines.close()


@pytest.fixture
def ends(directory: Path) -> Ends:
    return Ends(directory)


async def turn(until: Callable[[], object]) -> None:
    """Let the loop turn until this is so."""
    while not until():  # noqa: ASYNC110  # nothing says when a socket has been read
        await asyncio.sleep(0)


@on_a_loop
async def test_a_message_arrives_as_it_was_sent(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    reader.receive(writer)
    writer.lines.read()
    writer.send(b"hello")
    await turn(lambda: reader.arrived)
    assert reader.arrived == [(b"hello", 1)]
    assert writer.changes == [KEY]
    writer.lines.close()
    await turn(lambda: reader.ends)
    assert reader.ends == [writer.session]


@on_a_loop
async def test_who_has_the_run_directory_open_is_reached_by_that(ends, monkeypatch, directory: Path):
    monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", str(directory / "runs"))
    run = RunDirectory.claim("a run with a long name, which leaves a socket little room" * 3)
    try:
        writer, reader = ends("aaaaaaaa01", folder=run.inside), ends("bbbbbbbb02", folder=run.path)
        reader.receive(writer)
        writer.lines.read()
        writer.send(b"hello")
        reader.lines.read()
        assert reader.numbers == [1]
        writer.lines.close()
        assert [path.name for path in run.path.iterdir() if path.is_socket()] == ["~bbbbbbbb"]
        reader.lines.close()
        assert not any(path.is_socket() for path in run.path.iterdir())
    finally:
        run.close()


@on_a_loop
async def test_a_session_without_a_socket_has_no_line(ends):
    reader = ends("bbbbbbbb02")
    assert reader.lines.receive("cccccccc", KEY, Wanted(1), print, print) is None


@on_a_loop
async def test_large_messages_arrive_whole(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    intake = reader.receive(writer)
    writer.lines.read()
    large = bytes(range(256)) * 8192
    writer.send(large)
    writer.send(Pieces([b"head", large], len(large) + 4))
    writer.send(Pieces([b"small", b"one"], 8))
    await turn(lambda: len(reader.arrived) == 3)
    assert reader.arrived == [(large, 1), (b"head" + large, 2), (b"smallone", 3)]
    taken = writer.lines.capacity
    intake.acknowledge(3)
    await turn(lambda: not any(route.unacknowledged for route in writer.lines.routes(KEY)))
    writer.send(large)
    assert writer.lines.capacity == taken  # the same memory again


@on_a_loop
async def test_a_reader_that_is_behind_gets_the_newest_messages(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    intake = reader.receive(writer, depth=2)
    writer.lines.read()
    for _ in range(100):
        writer.send(b"x")
    await turn(lambda: len(reader.arrived) == 32)
    intake.acknowledge(32)
    await turn(lambda: len(reader.arrived) == 34)
    assert reader.numbers == [*range(1, 33), 99, 100]
    assert [(route.sent, route.dropped) for route in writer.lines.routes(KEY)] == [(34, 66)]


@on_a_loop
async def test_a_mark_tells_of_the_newest_messages_that_were_dropped(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    intake = reader.receive(writer, depth=2, overflow=Overflow.DROP_NEWEST)
    writer.lines.read()
    for _ in range(100):
        writer.send(b"x")
    await turn(lambda: len(reader.arrived) == 32)
    intake.acknowledge(32)
    await turn(lambda: len(reader.arrived) == 35)
    assert reader.numbers == [*range(1, 35), 100]
    assert reader.arrived[-1] == (Reason.OVERFLOW, 100)


@on_a_loop
async def test_messages_that_follow_closely_leave_together(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    reader.receive(writer, depth=100)
    writer.lines.read()
    for _ in range(40):
        writer.send(b"x", after_ns=1)
    await turn(lambda: len(reader.arrived) == 40)
    assert reader.numbers == [*range(1, 41)]
    (route,) = writer.lines.routes(KEY)
    assert route.unacknowledged == 3  # the first, thirty-two, and the rest


@on_a_loop
async def test_a_message_travels_in_parts_where_memory_is_full(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    intake = reader.receive(writer)
    writer.lines.read()
    writer.send(bytes(240 << 20))
    large = bytes(range(256)) * 80_000  # more than there is room for
    writer.send(large)
    await turn(lambda: reader.arrived)
    intake.acknowledge(1)
    await turn(lambda: len(reader.arrived) == 2)
    assert reader.arrived[1] == (large, 2)
    assert len(large) > 32 * LARGE


@on_a_loop
async def test_what_waits_is_sent_before_the_end(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    reader.receive(writer, depth=100)
    writer.lines.read()
    for _ in range(5):
        writer.send(b"x", after_ns=1)
    writer.lines.finish(60)
    writer.lines.close()
    reader.lines.read()
    assert reader.numbers == [1, 2, 3, 4, 5]


def stopped_until_the_end(ends, **wanted):
    """Send a hundred messages to a reader that takes none before the writer has ended; return the reader."""
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    reader.receive(writer, depth=2, **wanted)
    writer.lines.read()
    for _ in range(100):
        writer.send(b"x")
    writer.lines.finish(0.01)
    writer.lines.close()
    reader.lines.read()
    return reader


@on_a_loop
async def test_what_a_stopped_reader_has_no_room_for_is_named_at_the_end(ends):
    reader = stopped_until_the_end(ends)
    assert reader.arrived[-2:] == [(Reason.OVERFLOW, 98), (Reason.END, 100)]
    assert reader.numbers == [*range(1, 33), 98, 100]


@on_a_loop
async def test_what_overflowed_behind_the_last_waiting_messages_is_none_of_the_end(ends):
    reader = stopped_until_the_end(ends, overflow=Overflow.DROP_NEWEST)
    assert reader.arrived[-3:] == [(Reason.OVERFLOW, 32), (Reason.END, 34), (Reason.OVERFLOW, 100)]


@on_a_loop
async def test_a_slow_topic_holds_up_no_other_one(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    reader.receive(writer, depth=1)
    fast = reader.receive(writer, depth=1, key="other")
    writer.lines.read()
    for _ in range(1000):
        writer.send(b"slow")
    for _ in range(10):
        for _ in range(20):
            writer.send(b"fast", key="other")
        await turn(lambda: not writer.lines.routes("other")[0].waiting)
        reader.lines.read()
        count = sum(payload == b"fast" for payload, _ in reader.arrived)
        fast.acknowledge(20)
        writer.lines.read()
    assert count == 200
    assert writer.lines.routes("other")[0].dropped == 0
    assert writer.lines.routes(KEY)[0].dropped > 900


@on_a_loop
async def test_one_line_serves_both_directions(ends):
    first, second = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    first.receive(second)
    second.lines.read()
    second.receive(first)
    first.lines.read()
    first.send(b"to second")
    second.send(b"to first")
    await turn(lambda: first.arrived and second.arrived)
    assert (first.arrived, second.arrived) == ([(b"to first", 1)], [(b"to second", 1)])
    assert first.lines.sessions == {second.session}


@on_a_loop
async def test_a_stream_carries_the_same(ends):
    writer = ends("aaaaaaaa01", has_packets=False)
    reader = ends("bbbbbbbb02", has_packets=False)
    intake = reader.receive(writer, depth=1000)
    writer.lines.read()
    sizes = [1, 300, 2000, LARGE, LARGE + 1, 1 << 20, 5 << 20]
    for size in sizes:
        writer.send(bytes(size))
    for _ in range(50):
        writer.send(b"x", after_ns=1)
    await turn(lambda: len(reader.arrived) == len(sizes) + 50)
    assert [len(payload) for payload, _ in reader.arrived] == sizes + [1] * 50
    assert reader.numbers == [*range(1, len(sizes) + 51)]
    assert writer.lines.capacity == 0
    intake.acknowledge(len(reader.arrived))
    await turn(lambda: not writer.lines.routes(KEY)[0].unacknowledged)
    writer.lines.close()
    await turn(lambda: reader.ends)


@on_a_loop
async def test_without_such_memory_messages_travel_in_parts(ends, monkeypatch):
    monkeypatch.delattr(os, "memfd_create")
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    reader.receive(writer)
    writer.lines.read()
    writer.send(bytes(1 << 20))
    await turn(lambda: reader.arrived)
    assert reader.arrived == [(bytes(1 << 20), 1)]
    assert writer.lines.capacity == 0


@on_a_loop
async def test_a_closed_intake_gives_back_the_memory(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    intake = reader.receive(writer)
    writer.lines.read()
    writer.send(bytes(1 << 20))
    intake.close()
    await turn(lambda: not writer.lines.routes(KEY))
    reader.receive(writer)
    writer.lines.read()
    writer.send(bytes(1 << 20))
    assert writer.lines.capacity == 1 << 20


@on_a_loop
async def test_memory_that_a_lost_reader_may_read_is_never_written_again(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    held: list[Piece] = []
    reader.lines.receive(writer.session, KEY, Wanted(10), lambda arrived: held.extend(each for each, _ in arrived), int)
    writer.lines.read()
    writer.send(b"1" * (1 << 20))
    await turn(lambda: held)
    reader.lines.close()
    await turn(lambda: not writer.lines.routes(KEY))
    other = ends("cccccccc03")
    other.receive(writer)
    writer.lines.read()
    writer.send(b"2" * (1 << 20))
    assert held[0].to_bytes() == b"1" * (1 << 20)
    await turn(lambda: other.arrived)
    assert other.arrived == [(b"2" * (1 << 20), 2)]


@on_a_loop
async def test_a_closed_descriptor_ends_the_line_at_both_ends(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    reader.receive(writer)
    writer.lines.read()
    os.close(descriptor_of(writer, reader))
    await turn(lambda: reader.ends)
    await turn(lambda: not writer.lines.routes(KEY))
    reader.receive(writer)
    writer.lines.read()
    writer.send(b"again")
    await turn(lambda: reader.arrived)
    assert reader.arrived == [(b"again", 1)]
    assert [level for level, _ in writer.log] == ["warning"]


@on_a_loop
async def test_a_file_with_the_number_of_a_lost_line_stays_open(ends, tmp_path: Path):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    reader.receive(writer)
    writer.lines.read()
    number = descriptor_of(writer, reader)
    with (tmp_path / "file").open("wb") as file:
        os.dup2(file.fileno(), number)  # as if the plugin had closed it and opened a file
        writer.send(b"x")
        await turn(lambda: not writer.lines.routes(KEY))
        await turn(lambda: reader.ends)
        os.close(number)
    assert (tmp_path / "file").read_bytes() == b""


@on_a_loop
async def test_who_has_lost_its_listening_socket_has_no_new_line_and_keeps_the_others(ends):
    writer, reader, late = ends("aaaaaaaa01"), ends("bbbbbbbb02"), ends("cccccccc03")
    reader.receive(writer)
    writer.lines.read()
    os.close(writer.lines._listener.fileno())
    assert late.receive(writer) is None
    assert "Connection refused" in late.lines.refusals[writer.session]
    writer.lines.read()
    writer.send(b"x")
    await turn(lambda: reader.arrived)
    assert writer.lines.routes(KEY)
    assert [level for level, _ in writer.log] == []


def descriptor_of(writer: Process, reader: Process) -> int:
    """Return the descriptor of the writer's end of the only line."""
    path = f"~{writer.session[:8]}"
    for name in os.listdir("/dev/fd"):  # noqa: PTH208  # names
        try:
            found = socket.socket(fileno=os.dup(int(name)))
        except OSError:
            continue
        with found:
            if str(found.getsockname()).endswith(path) and not found.getsockopt(
                socket.SOL_SOCKET, socket.SO_ACCEPTCONN
            ):
                return int(name)
    raise AssertionError(f"{reader.session} has no line")


@on_a_loop
async def test_a_forked_process_keeps_no_line_open(ends, others: OtherEnds):
    reader, arrived, ended = ends("bbbbbbbb02"), list[bytes](), list[bool]()
    pid = others.start("fork 0000000a")
    await turn(lambda: reader.can_reach("0000000a"))
    reader.read_large("0000000a", arrived, ended)
    await turn(lambda: arrived)
    assert {data[:8] for data in arrived} == {b"a parent"}
    others.kill(pid)  # its child lives on
    reader.lines.read()
    assert ended == [True]


@on_a_loop
async def test_who_gets_no_descriptor_is_turned_away(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    reader.receive(writer)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(map(int, os.listdir("/dev/fd"))), hard))  # noqa: PTH208  # names
    try:
        taken = all_descriptors()
        writer.lines.read()
        reader.lines.read()
        assert reader.ends == [writer.session]
        assert reader.receive(writer) is None
        for each in taken:
            os.close(each)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    assert [level for level, _ in writer.log] == ["warning"]
    assert reader.receive(writer) is None  # it stays with Zenoh


def all_descriptors() -> list[int]:
    """Open files until no descriptor is left."""
    found: list[int] = []
    while True:
        try:
            found.append(os.open(os.devnull, os.O_RDONLY))
        except OSError:
            return found


@on_a_loop
async def test_who_has_no_descriptor_for_the_memory_loses_the_line_alone(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    reader.receive(writer)
    writer.lines.read()
    writer.send(bytes(1 << 20))
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(map(int, os.listdir("/dev/fd"))), hard))  # noqa: PTH208  # names
    try:
        taken = all_descriptors()
        reader.lines.read()
        assert reader.ends == [writer.session]
        assert [level for level, _ in reader.log] == ["warning"]
        for each in taken:
            os.close(each)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


OTHER_USER = """
import os, socket, sys

os.setuid(65534)
with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as other:
    other.connect(sys.argv[1])
    sys.exit(other.recv(100) != b"")
"""
"""A program that connects as another user, and expects to be turned away."""


def open_to_all(directory: Path) -> Path:
    """Let every user connect to the first socket, which the directory's permissions forbid otherwise."""
    directory.chmod(0o755)
    path = directory / "~aaaaaaaa"
    path.chmod(0o666)
    return path


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
@on_a_loop
async def test_a_process_of_another_user_gets_no_line(ends, directory: Path):
    writer = ends("aaaaaaaa01")
    path = open_to_all(directory)
    other = subprocess.Popen([sys.executable, "-c", OTHER_USER, path])  # noqa: ASYNC220  # no node runs here
    await turn(lambda: writer.log or None)
    assert other.wait() == 0  # its end follows
    assert writer.log == [("warning", "a process of another user (65534) gets no line to this one")]


class OtherEnds:
    """Processes at the other ends of lines, one at a time."""

    def __init__(self, directory: Path, *around: str) -> None:
        self._started = 0
        self._server = subprocess.Popen(
            [*around, sys.executable, NODES / "line_end.py", directory],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def start(self, order: str) -> int:
        self._server.stdin.write(f"{order}\n")
        self._server.stdin.flush()
        self._started = int(self._server.stdout.readline())
        return self._started

    def kill(self, pid: int) -> None:
        """Kill it, and wait until it has gone."""
        os.kill(pid, signal.SIGKILL)
        assert self._server.stdout.readline() == "ended\n"
        self._started = 0

    def kill_all(self) -> None:
        """Kill the main process, and so all in its namespace."""
        self._server.kill()
        self._started = 0

    def close(self) -> None:
        if self._started:
            self.kill(self._started)
        self._server.communicate()


@pytest.fixture
def others(directory: Path) -> Iterator[OtherEnds]:
    made = OtherEnds(directory)
    yield made
    made.close()


def is_whole(data: bytes) -> bool:
    """Return whether this is a message of such a process, which consists of one word."""
    return data == data[:8] * (len(data) // 8)


KILLS = [3, pytest.param(50, marks=pytest.mark.long)]


@pytest.mark.parametrize("kills", KILLS)
@on_a_loop
async def test_of_a_killed_sender_come_whole_messages_and_its_end(ends, others: OtherEnds, kills: int):
    reader, chance = ends("bbbbbbbb02"), random.Random(kills)
    for at in range(kills):
        session, arrived, ended = f"{at:08x}", list[bytes](), list[bool]()

        pid = others.start(f"write {session} {1 << 20}")
        await turn(lambda session=session: reader.can_reach(session))
        reader.read_large(session, arrived, ended)
        wanted = chance.randrange(1, 20)
        await turn(lambda arrived=arrived, wanted=wanted: len(arrived) >= wanted)
        others.kill(pid)
        reader.lines.read()
        assert ended == [True]  # known as soon as the process has gone
        numbers = [int.from_bytes(data[:8], "little") for data in arrived]
        assert numbers == sorted(set(numbers))
        assert all(map(is_whole, arrived))
    assert reader.lines.sessions == set()


@pytest.mark.parametrize("kills", KILLS)
@on_a_loop
async def test_a_killed_reader_takes_nothing_with_it(ends, others: OtherEnds, kills: int):
    writer, chance = ends("aaaaaaaa01"), random.Random(kills)
    witness = ends("bbbbbbbb02")
    arrived: list[bytes] = []
    witness.read_large(writer.session, arrived, [], KEY)
    writer.lines.read()
    for _ in range(kills):
        pid = others.start(f"read {writer.session}")
        await turn(lambda: len(writer.lines.routes(LARGE_KEY)) == 1)
        for _ in range(chance.randrange(1, 20)):
            number = writer.number + 1
            writer.send(number.to_bytes(8, "little") * (1 << 17), key=LARGE_KEY)
            writer.send(number.to_bytes(8, "little") * (1 << 17))
            await asyncio.sleep(0)
        others.kill(pid)
        writer.lines.read()
        assert not writer.lines.routes(LARGE_KEY)
    await turn(lambda: not writer.lines.routes(KEY)[0].waiting)
    witness.lines.read()
    assert all(map(is_whole, arrived))
    assert len(arrived) == writer.number // 2 - writer.lines.routes(KEY)[0].dropped


@pytest.mark.long
@on_a_loop
async def test_ten_thousand_messages_in_memory_are_whole_and_in_order(ends, others: OtherEnds):
    """`benchmarks/line_attacks.py payloads` sends a hundred thousand, between nodes."""
    reader, arrived, last = ends("bbbbbbbb02"), list[bytes](), 0
    pid = others.start(f"write 0000000a {1 << 16}")
    await turn(lambda: reader.can_reach("0000000a"))
    reader.read_large("0000000a", arrived, [])
    count = 0
    while count < 10_000:
        await turn(lambda: arrived)
        for data in arrived:
            number = int.from_bytes(data[:8], "little")
            assert is_whole(data)
            assert number > last
            last = number
        count += len(arrived)
        arrived.clear()
    others.kill(pid)


ELSEWHERE = ("unshare", "--map-root-user", "--pid", "--mount", "--fork", "--kill-child")
"""Runs a program in other namespaces of processes, users and mounts."""


@pytest.fixture
def contained(directory: Path) -> Iterator[OtherEnds]:
    if shutil.which("unshare") is None or subprocess.run([*ELSEWHERE, "true"], capture_output=True).returncode:
        pytest.skip("this system gives a user no namespaces")
    made = OtherEnds(directory, *ELSEWHERE)
    yield made
    made.close()


@on_a_loop
async def test_a_container_that_shares_the_directory_has_a_line(ends, contained: OtherEnds):
    reader, arrived, ended = ends("bbbbbbbb02"), list[bytes](), list[bool]()
    contained.start(f"write 0000000a {1 << 20}")
    await turn(lambda: reader.can_reach("0000000a"))
    reader.read_large("0000000a", arrived, ended)
    await turn(lambda: len(arrived) >= 5)
    assert all(map(is_whole, arrived))
    contained.kill_all()
    await turn(lambda: ended)
    assert reader.log == []


@on_a_loop
async def test_a_stopped_reader_goes_on_with_the_newest(ends, others: OtherEnds):
    writer = ends("aaaaaaaa01")
    pid = others.start(f"read {writer.session}")
    await turn(lambda: writer.lines.routes(LARGE_KEY))
    (route,) = writer.lines.routes(LARGE_KEY)
    os.kill(pid, signal.SIGSTOP)
    for number in range(1, 101):
        writer.send(number.to_bytes(8, "little") * (1 << 17), key=LARGE_KEY)
    assert route.dropped == 100 - 2 * LARGE_DEPTH
    assert writer.lines.capacity <= (2 * LARGE_DEPTH + 1) << 20
    os.kill(pid, signal.SIGCONT)
    await turn(lambda: not route.unacknowledged and not route.waiting)
    assert route.sent == 2 * LARGE_DEPTH
    others.kill(pid)
