"""Rounds: asks every contender in turn, round after round, so that a noisy machine is noisy to all.

Each contender has a process of its own for as long as a question lasts: no peer's threads, imports or garbage weigh on
another, and one that crashes takes none with it.
"""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median, quantiles
from typing import IO, Any

from benchmarks.question import Contender, Effort, Question

ROOT = Path(__file__).parents[1]
PATIENCE_S = 120.0


@dataclass(frozen=True)
class Place:
    """A checkout of busflow, and the Python that runs it."""

    root: Path = ROOT
    python: str = sys.executable


@dataclass
class Figure:
    """One figure of one contender in one case, over all rounds."""

    contender: str
    case: str
    name: str
    values: list[float] = field(default_factory=list[float])
    calls: list[float] = field(default_factory=list[float])
    """Each value in bare calls of its own round, where it is a time."""

    @property
    def unit(self) -> str:
        """Seconds, bytes, per second or percent: the last word of its name."""
        return self.name.split()[-1]

    @property
    def median(self) -> float:
        """What it came to."""
        return median(self.values)

    @property
    def ratio(self) -> float | None:
        """What it came to, in bare calls; None where it is no time."""
        return median(self.calls) if self.calls else None

    @property
    def spread(self) -> float:
        """Half the distance between the quartiles, as a share of the median."""
        if len(self.values) < 2 or not self.median:  # one value has no spread
            return 0.0
        low, _, high = quantiles(self.values, n=4, method="inclusive")
        return (high - low) / 2 / abs(self.median)


@dataclass
class Outcome:
    """The answer to a question."""

    question: Question
    figures: dict[tuple[str, str, str], Figure] = field(default_factory=dict[tuple[str, str, str], Figure])
    missing: dict[str, str] = field(default_factory=dict[str, str])
    """Contenders that are not installed, and why."""
    failed: dict[str, str] = field(default_factory=dict[str, str])
    """Contenders that failed in a case, and how."""
    call_s: list[float] = field(default_factory=list[float])
    load: tuple[float, float] = (0.0, 0.0)
    """The machine's load before and after."""

    def take(self, contender: str, case: str, told: dict[str, Any]) -> None:
        """Note one sample, or why there is none."""
        if "failed" in told:
            self.failed[f"{contender}, {case}"] = told["failed"]
            return
        self.call_s.append(told["call_s"])
        for name, value in told["sample"].items():
            figure = self.figures.setdefault((contender, case, name), Figure(contender, case, name))
            figure.values.append(value)
            if figure.unit == "s":
                figure.calls.append(value / told["call_s"])

    def figure(self, contender: str, case: str, name: str) -> Figure | None:
        """What was found, if it was."""
        return self.figures.get((contender, case, name))

    def names(self, case: str) -> list[str]:
        """The figures of a case, in the order in which they were told."""
        return list(dict.fromkeys(name for _, other, name in self.figures if other == case))


class Worker:
    """The process of one contender."""

    def __init__(
        self, outcome: Outcome, contender: Contender, effort: Effort, complaints: IO[str], place: Place
    ) -> None:
        question = outcome.question
        command = [place.python, "-m", "benchmarks.worker", question.name, contender.name]
        self._process = subprocess.Popen(  # noqa: S603  # our own interpreter
            [*command, str(effort.sample_s), str(effort.rounds), str(effort.sizes)],
            cwd=place.root,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=complaints,
            text=True,
        )
        self.contender, self.outcome = contender, outcome

    def greet(self) -> str:
        """Wait until it is there; why it is not, otherwise."""
        told = self._hear()
        return told.get("missing") or told.get("failed") or ""

    def measure(self, case: str) -> dict[str, Any]:
        """Have a case measured."""
        assert self._process.stdin is not None  # noqa: S101  # it is a pipe
        try:
            self._process.stdin.write(json.dumps(case) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            return {"failed": "its process has ended"}
        return self._hear()

    def _hear(self) -> dict[str, Any]:
        assert self._process.stdout is not None  # noqa: S101  # it is a pipe
        ready, _, _ = select.select([self._process.stdout], [], [], PATIENCE_S)
        line = self._process.stdout.readline() if ready else ""
        if not line:
            self.close()
            return {"failed": "its process has ended" if ready else f"no answer within {PATIENCE_S:g} s"}
        return json.loads(line)

    def close(self) -> None:
        """End it."""
        self._process.kill()
        self._process.communicate()


def ask(question: Question, effort: Effort, tell: Callable[[str], None], *, peers: bool = True) -> Outcome:
    """Measure everything that a question asks for, in interleaved rounds."""
    left_out = [each for each in question.contenders if each.needs and not peers]
    kept = [each for each in question.contenders if each not in left_out]
    (outcome,) = ask_at([Place()], question, kept, effort, tell)
    outcome.missing |= {each.name: "left out" for each in left_out}
    return outcome


def ask_at(
    places: Sequence[Place],
    question: Question,
    contenders: Sequence[Contender],
    effort: Effort,
    tell: Callable[[str], None],
) -> list[Outcome]:
    """Measure these contenders at several places in turn; return the outcome of each place."""
    outcomes = [Outcome(question) for _ in places]
    workers: list[Worker] = []
    with tempfile.TemporaryFile("w+") as complaints:
        try:
            for contender in contenders:
                for place, outcome in zip(places, outcomes, strict=True):
                    worker = Worker(outcome, contender, effort, complaints, place)
                    workers.append(worker)
                    if why := worker.greet():
                        outcome.missing[contender.name] = why
                        workers.remove(worker)
                        worker.close()
            before = os.getloadavg()[0]
            for number in range(effort.rounds):
                tell(f"{question.name}: round {number + 1} of {effort.rounds}")
                for case in question.cases_for(effort):
                    for worker in workers:
                        if worker.contender.does(case.name):
                            worker.outcome.take(worker.contender.name, case.name, worker.measure(case.name))
            for outcome in outcomes:
                outcome.load = (before, os.getloadavg()[0])
        finally:
            for worker in workers:
                worker.close()
    return outcomes
