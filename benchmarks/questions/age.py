"""Age: how old the message is that a reader with `depth: 1` gets, where its handler takes longer than a period."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

from benchmarks.question import Case, Contender, Effort, Question, Sample
from benchmarks.questions.processes import NODES, run_launch_file

LAUNCH_FILE = """\
name: age
plugins: [{nodes}]
network: {{line: {line}}}
processes:
  far:
nodes:
  stamper:
    plugin: "slow_readers:Stamper"
    process: far
    parameters: {{size: {size}, rate_hz: {rate_hz}, shares: {shares}}}
  reader:
    plugin: "slow_readers:Blocking"
    parameters: {{size: {size}, blocks_s: {blocks_s}, seconds: {seconds}, folder: {folder}}}
"""


@dataclass(frozen=True)
class Pace:
    """How fast messages of a size come, and how slowly they are handled."""

    size: int
    rate_hz: float
    blocks_s: float
    seconds: float
    """How long the reader reads; its second half counts."""


@dataclass(frozen=True)
class Way:
    """How messages go from process to process."""

    line: bool = True
    shares: bool = True

    @property
    def keys(self) -> dict[str, str]:
        """Both as a launch file has them."""
        return {"line": str(self.line).lower(), "shares": str(self.shares).lower()}


PACES = {
    "8 B, 30 Hz, 45 ms": Pace(8, 30, 0.045, 12.0),
    "8 B, 1 kHz, 20 ms": Pace(8, 1000, 0.02, 3.0),
    "8 B, 10 kHz, 200 ms": Pace(8, 10_000, 0.2, 3.0),
    "2 kB, 40 Hz, 200 ms": Pace(2048, 40, 0.2, 4.0),
    "0.9 MB, 30 Hz, 45 ms": Pace(900_000, 30, 0.045, 4.0),
}
WAYS = [
    Contender("busflow", Way()),
    Contender("busflow, whole", Way(shares=False), note="without shared memory"),
    Contender("busflow, Zenoh", Way(line=False), note="without a line"),
]


def measure(contender: Contender, case: str, effort: Effort) -> Sample:
    """The age of what the handler gets, in the second half of some seconds."""
    pace, way = PACES[case], contender.way
    return read(pace, way, 0.3 if effort.is_quick else pace.seconds)


def read(pace: Pace, way: Way, seconds: float) -> Sample:
    """Have a node read for so long."""
    # The path of a socket must be short, which not every system's own folder for such files lets it be.
    with tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as folder:
        return run_launch_file(Path(folder), launch_file(pace, way, seconds, Path(folder)))


def launch_file(pace: Pace, way: Way, seconds: float, folder: Path) -> str:
    """Two nodes in two processes; one writes into the folder what it has read for so long."""
    paced = {"size": pace.size, "rate_hz": pace.rate_hz, "blocks_s": pace.blocks_s}
    return LAUNCH_FILE.format(nodes=NODES, seconds=seconds, folder=folder, **paced, **way.keys)


QUESTION = Question(
    name="age",
    title="The age of the message that a slow reader gets",
    explanation=(
        "A node publishes the time, another one in another process reads it with `depth: 1`, and its handler blocks "
        "for longer than a period. From publish to the entry of the handler, in the second half of 3 to 12 s. The "
        "newest message is at most a period old. A line has up to 32 messages under way to a reader; where more came "
        "while the handler blocked, the reader drops them, and waits up to 0.5 ms for newer ones."
    ),
    cases=[Case(name, name, "") for name in PACES],
    contenders=WAYS,
    measure=measure,
    quick=frozenset({"8 B, 1 kHz, 20 ms"}),
)
