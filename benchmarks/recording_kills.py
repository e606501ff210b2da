"""Kills recorders at random moments, and looks at what is left.

    python benchmarks/recording_kills.py [KILLS [SECONDS [PROMISED]]]

Each recorder is a process that publishes and records on the system's time, and is ended with SIGKILL after SECONDS at
most. What it had published by then it has noted in memory that outlives it. The file it leaves has to open, to be whole
up to its end, and to lack no more than the last PROMISED seconds: one, unless the machine has too much else to do.
"""

from __future__ import annotations

import asyncio
import mmap
import os
import random
import signal
import statistics
import struct
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import busflow
from busflow import Node, Parameters, publisher, timer
from busflow.errors import BagError
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_msgs import Int64
from busflow.recording.bag.bag import Bag

PROMISED_S = 1.0
_NOTE = struct.Struct("<q")
_NOTES = 8192
"""Messages of which it is known when they were published; no kill loses so many."""
_LONGEST_S = 2.0
_EARLY = 0.05
_LOOK_S = 0.003


class TalkerParameters(Parameters):
    rate_hz: float = 500.0
    blocks_s: float = 0.0
    image_bytes: int = 0


class Talker(Node):
    """Counts, notes what it has published, and holds up the event loop now and then if told to."""

    parameters: TalkerParameters
    numbers = publisher(Int64, "number")
    images = publisher(Image, "image")
    note: mmap.mmap

    def declare(self) -> None:
        self._count = 0

    @timer(hz="rate_hz")
    def talk(self) -> None:
        self._count += 1
        self.numbers.publish(Int64(data=self._count))
        _NOTE.pack_into(self.note, 8 * (1 + self._count % _NOTES), time.time_ns())
        _NOTE.pack_into(self.note, 0, self._count)
        if self.parameters.image_bytes and self._count % 20 == 0:
            self.images.publish(Image(data=np.full(self.parameters.image_bytes, self._count % 251, np.uint8)))
        if self.parameters.blocks_s and self._count % 50 == 0:
            time.sleep(self.parameters.blocks_s)


LOADS = {
    "500 Hz": TalkerParameters(),
    "5 Hz": TalkerParameters(rate_hz=5.0),
    "2 kHz": TalkerParameters(rate_hz=2000.0),
    "500 Hz, a loop that is blocked for 0.6 s": TalkerParameters(blocks_s=0.6),
    "400 Hz with images of 1 MB at 20 Hz": TalkerParameters(rate_hz=400.0, image_bytes=1_000_000),
}


@dataclass(frozen=True)
class Fate:
    """What a kill left."""

    load: str
    published: int
    recorded: int
    lost_s: float
    """From the first message that is not there to the last one that was published."""
    problem: str = ""


class Victim:
    """A recorder, in a process of its own that is forked from this one, for which everything is imported."""

    def __init__(self, folder: Path, number: int, random_: random.Random, longest_s: float) -> None:
        self.path = folder / f"{number}.mcap"
        self.load = random_.choice(list(LOADS))
        self._note = mmap.mmap(-1, 8 * (1 + _NOTES))
        self._lives_s = random_.uniform(0, longest_s)
        # Most live so long from their first message on; a few are ended while they are starting.
        self._due = time.monotonic() + self._lives_s / 4 if random_.random() < _EARLY else None
        self._pid = os.fork()
        if self._pid == 0:
            try:
                self._record()
            finally:
                os._exit(1)

    def _record(self) -> None:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        Talker.note = self._note

        async def main() -> None:
            async with busflow.launch(Talker(LOADS[self.load]), record=self.path) as graph:
                await graph.wait()

        asyncio.run(main())

    @property
    def due(self) -> bool:
        """Whether it has lived for long enough."""
        if self._due is None and self._noted(0):
            self._due = time.monotonic() + self._lives_s
        return self._due is not None and time.monotonic() >= self._due

    def _noted(self, place: int) -> int:
        return int(_NOTE.unpack_from(self._note, 8 * place)[0])

    def kill(self, promised_s: float) -> Fate:
        """End it, and look."""
        os.kill(self._pid, signal.SIGKILL)
        os.waitpid(self._pid, 0)
        published = self._noted(0)
        if not published:
            return Fate(self.load, 0, 0, 0.0)
        try:
            with Bag(self.path) as bag:
                numbers = [entry for entry in bag.entries() if entry.channel.topic == "/number"]
                complete = bag.complete
        except BagError as error:
            return Fate(self.load, published, 0, 0.0, f"cannot be read: {error}")
        finally:
            self.path.unlink(missing_ok=True)
        found = [int.from_bytes(entry.payload[4:12], "little") for entry in numbers]
        problem = ""
        if found != list(range(1, len(found) + 1)):
            problem = "is not whole up to its end"
        elif complete:
            problem = "says that it is complete"
        first, last = (self._noted(1 + number % _NOTES) for number in (len(found) + 1, published))
        lost_s = 0.0 if len(found) >= published else (last - first) / 1e9
        if lost_s > promised_s:
            problem = f"lacks the last {lost_s:.2f} s"
        return Fate(self.load, published, len(found), lost_s, problem)


async def _warmed_up(path: Path) -> None:
    """Import here, once, all that a recorder needs."""
    Talker.note = mmap.mmap(-1, 8 * (1 + _NOTES))
    async with busflow.launch(Talker(rate_hz=50.0), record=path):
        await asyncio.sleep(0.1)


def kills(count: int, folder: Path, *, at_once: int, seed: int, longest_s: float, promised_s: float) -> Iterator[Fate]:
    """The fates of so many recorders, several of which run at a time, each for up to so long."""
    random_ = random.Random(seed)
    asyncio.run(_warmed_up(folder / "first.mcap"))
    running: list[Victim] = []
    started = 0
    while started < count or running:
        while started < count and len(running) < at_once:
            running.append(Victim(folder, started, random_, longest_s))
            started += 1
        for victim in [each for each in running if each.due]:
            running.remove(victim)
            yield victim.kill(promised_s)
        time.sleep(_LOOK_S)


def told(fates: Sequence[Fate]) -> str:
    """What came of them, for people."""
    lines = [f"{'load':45} kills  recorded of published   lost: median   longest"]
    for load in LOADS:
        of_load = [fate for fate in fates if fate.load == load]
        spoken = [fate.lost_s for fate in of_load if fate.published] or [0.0]
        lines.append(
            f"{load:45} {len(of_load):5} {sum(each.recorded for each in of_load):9} of"
            f" {sum(each.published for each in of_load):9}"
            f" {statistics.median(spoken):12.3f} s {max(spoken):7.3f} s"
        )
    lines += [f"{fate.load}: {fate.problem}" for fate in fates if fate.problem]
    bad = sum(bool(fate.problem) for fate in fates)
    lines.append(f"{len(fates)} kills, {bad} of which left less than is promised")
    return "\n".join(lines)


def main(count: int, longest_s: float = _LONGEST_S, promised_s: float = PROMISED_S) -> int:
    seed = int(os.environ.get("BUSFLOW_SEED", "0"))
    at_once = 4 * (os.cpu_count() or 1)
    with tempfile.TemporaryDirectory() as folder:
        fates = list(kills(count, Path(folder), at_once=at_once, seed=seed, longest_s=longest_s, promised_s=promised_s))
    print(told(fates))
    return int(any(fate.problem for fate in fates))


if __name__ == "__main__":
    arguments = sys.argv[1:] or ["1000"]
    sys.exit(main(int(arguments[0]), *map(float, arguments[1:])))
