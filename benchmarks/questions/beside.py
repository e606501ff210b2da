"""Beside: what a fast reader loses because another reader of the same topic is slow."""

from __future__ import annotations

import tempfile
from pathlib import Path

from benchmarks.question import Case, Contender, Effort, Question, Sample
from benchmarks.questions.age import WAYS, Way
from benchmarks.questions.processes import NODES, run_launch_file

IMAGE, IMAGES_HZ = 900_000, 30
SCAN, SCANS_HZ = 60_000, 40
SLOW = """\
  slow:
    plugin: "slow_readers:Blocking"
    process: late
    parameters: {{topic: images, size: {image}, blocks_s: 0.2, seconds: 1000, shares: {shares}}}
"""
LAUNCH_FILE = """\
name: beside
plugins: [{nodes}]
network: {{line: {line}}}
processes:
  far:
  late:
nodes:
  images:
    plugin: "slow_readers:Stamper"
    process: far
    parameters: {{topic: images, size: {image}, rate_hz: {images_hz}, most: {images}, shares: {shares}}}
  scans:
    plugin: "slow_readers:Stamper"
    process: far
    parameters: {{topic: scans, size: {scan}, rate_hz: {scans_hz}, most: {scans}}}
  fast:
    plugin: "slow_readers:Beside"
    parameters: {{seconds: {seconds}, shares: {shares}, folder: {folder}}}
"""
TOGETHER = "a reader of the images blocks for 200 ms"
ALONE = "no other reader"


def measure(contender: Contender, case: str, effort: Effort) -> Sample:
    """What arrives in time of two topics, and how late."""
    return read(contender.way, 0.5 if effort.is_quick else 5.0, slow=case == TOGETHER)


def read(way: Way, seconds: float, *, slow: bool = True) -> Sample:
    """Have a node read for so long, beside one that is slow."""
    # The path of a socket must be short, which not every system's own folder for such files lets it be.
    with tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as folder:
        text = (LAUNCH_FILE + SLOW * slow).format(
            nodes=NODES,
            image=IMAGE,
            images_hz=IMAGES_HZ,
            images=round(seconds * IMAGES_HZ),
            scan=SCAN,
            scans_hz=SCANS_HZ,
            scans=round(seconds * SCANS_HZ),
            seconds=seconds,
            folder=folder,
            **way.keys,
        )
        return run_launch_file(Path(folder), text)


QUESTION = Question(
    name="beside",
    title="A fast reader beside a slow one",
    explanation=(
        "A process publishes images of 0.9 MB at 30 Hz and scans of 60 kB at 40 Hz for 5 s. A node of another process "
        "reads both with `depth: 1`, and returns at once. A third process has a reader of the images, whose handler "
        "blocks for 200 ms. From publish to the entry of the fast reader's handler, and how many messages it got."
    ),
    cases=[Case(TOGETHER, "Beside a reader of the images that blocks for 200 ms", ""), Case(ALONE, "Alone", "")],
    contenders=WAYS,
    measure=measure,
    quick=frozenset({TOGETHER}),
)
