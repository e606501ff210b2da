"""Other ends of lines, in processes that a test may kill: `line_end.py FOLDER`, with orders on standard input.

`write SESSION SIZE` and `read SESSION` fork a process that publishes for ever, or that receives from this session for
ever; its id is the answer. `fork SESSION` forks one that forks in its turn, and whose child lives as long as this one.
The messages are numbered and have this size, and each consists of one repeated word.
"""

import asyncio
import os
import sys
from collections.abc import Sequence
from itertools import count
from pathlib import Path

from busflow.log import Logger
from busflow.wire.line.intake import Arrived, Intake
from busflow.wire.line.lines import Lines
from busflow.wire.line.packets import Wanted
from busflow.wire.zenoh.keys import attachment_bytes

KEY = "0/cloud/sensor_msgs::msg::dds_::PointCloud2_/RIHS01_00"
GID = bytes(range(16))
WANTED = Wanted(4)


def payload(number: int, size: int) -> bytes:
    """Return the message of a number."""
    return number.to_bytes(8, "little") * (size // 8)


def is_whole(data: bytes) -> bool:
    """Return whether these bytes are such a message."""
    return data == data[:8] * (len(data) // 8)


def lines_of(folder: Path, session: str, *, has_packets: bool = True) -> Lines:
    lines = Lines(
        folder,
        session,
        lambda _key: None,
        Logger(lambda *line: print(*line[:2], file=sys.stderr)),
        has_packets=has_packets,
    )
    lines.begin()
    return lines


async def write(lines: Lines, size: int) -> None:
    """Publish for ever."""
    number = 0
    while True:
        number += 1
        lines.send(KEY, payload(number, size), attachment_bytes(number, number, GID), number * 10**9)
        await asyncio.sleep(0)


async def read(lines: Lines, session: str) -> None:
    """Receive for ever, and end with an error if a message is not whole."""
    intake: Intake | None = None
    ended = asyncio.Event()

    def take(arrived: Sequence[Arrived]) -> None:
        for message, _ in arrived:
            if isinstance(message, bytes) or hasattr(message, "to_bytes"):
                data = message if isinstance(message, bytes) else message.to_bytes()
                if not is_whole(data):
                    os._exit(3)
        assert intake is not None
        intake.acknowledge(len(arrived))

    intake = lines.receive(session, KEY, WANTED, take, ended.set)
    await ended.wait()


async def fork(lines: Lines, alive: int) -> None:
    """Fork a child that publishes and then waits for the end of the main process, and publish for ever."""
    while not lines.routes(KEY):
        await asyncio.sleep(0)
    child = os.fork()
    for number in count(1):
        word = b"a parent" if child else b"an heir!"
        lines.send(KEY, word * (1 << 17), attachment_bytes(number, number, GID), number * 10**9)
        if child:
            await asyncio.sleep(0)
        elif number == 100:
            os.read(alive, 1)
            os._exit(0)


async def run(folder: Path, alive: int, order: str, session: str, size: str = "0") -> None:
    lines = lines_of(folder, f"{os.getpid():08x}" if order == "read" else session)
    match order:
        case "write":
            await write(lines, int(size))
        case "read":
            await read(lines, session)
        case "fork":
            await fork(lines, alive)


def main() -> None:
    folder = Path(sys.argv[1])
    alive, kept_open = os.pipe()
    for line in sys.stdin:
        pid = os.fork()
        if pid == 0:
            os.close(kept_open)
            asyncio.run(run(folder, alive, *line.split()))
            os._exit(0)
        print(pid, flush=True)
        os.waitpid(pid, 0)  # the test kills it
        print("ended", flush=True)


if __name__ == "__main__":
    main()
