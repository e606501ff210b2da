"""Question: what is measured, on whom, and how. Each file of `questions/` asks one."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

QUESTIONS = (
    "delivery",
    "latency",
    "scale",
    "timers",
    "loops",
    "processes",
    "age",
    "beside",
    "messages",
    "startup",
    "shares",
    "collection",
)
"""In the order in which they are asked; each is a module of `questions/` with a `QUESTION`."""


@dataclass(frozen=True)
class Case:
    """One thing that is measured on every contender: a column of a table, or several."""

    name: str
    table: str = ""
    """The title of the table it stands in; cases of one title stand side by side."""
    column: str | None = None
    """What its column is called there, if not as the case."""

    @property
    def heading(self) -> str:
        """The head of its column."""
        return self.name if self.column is None else self.column


@dataclass(frozen=True)
class Contender:
    """One way to do the work: busflow, a peer, or the bare floor under both."""

    name: str
    way: Any = None
    """What the question's `measure` needs to know of it."""
    needs: tuple[str, ...] = ()
    """Modules that it cannot do without; where one is not installed, the contender is named as missing."""
    cases: frozenset[str] | None = None
    """The cases that it can do; None stands for all."""
    note: str = ""

    def missing(self) -> str:
        """The first module that it needs and that is not installed; empty where all are there."""
        return next((name for name in self.needs if importlib.util.find_spec(name) is None), "")

    def does(self, case: str) -> bool:
        """Whether it can do this case."""
        return self.cases is None or case in self.cases


MANY = 1000


@dataclass(frozen=True)
class Effort:
    """How much is measured: the seconds that one sample may take, and in how many rounds."""

    sample_s: float
    rounds: int
    sizes: int = MANY
    """The most topics, nodes or messages that are made to see what many of them cost."""

    @property
    def is_quick(self) -> bool:
        """Whether it is only to be seen that everything works."""
        return self.sizes < MANY


FULL = Effort(sample_s=0.12, rounds=5)
QUICK = Effort(sample_s=0.01, rounds=1, sizes=50)

Sample = dict[str, float]
"""Figures of one measurement by name. The name ends in its unit: `s` for seconds (`p50 s`), `B`, `/s`, `%`."""
Measure = Callable[[Contender, str, Effort], Sample]


@dataclass(frozen=True)
class Quoted:
    """Figures that were measured elsewhere, of what cannot be installed here."""

    name: str
    figures: Mapping[tuple[str, str], float]
    """By case and figure, in the unit of the figure."""


@dataclass(frozen=True)
class Question:
    """What is measured, on whom, and how."""

    name: str
    title: str
    explanation: str
    cases: Sequence[Case]
    contenders: Sequence[Contender]
    measure: Measure
    """Measures one case on one contender; runs in the contender's own process."""
    quick: frozenset[str] | None = None
    """The cases of a quick round; None stands for all."""
    quoted: Sequence[Quoted] = field(default=())
    quoted_from: str = ""

    def cases_for(self, effort: Effort) -> list[Case]:
        """The cases that are measured with this effort."""
        return [each for each in self.cases if not effort.is_quick or self.quick is None or each.name in self.quick]


def find(name: str) -> Question:
    """The question of that name."""
    question = importlib.import_module(f"benchmarks.questions.{name}").QUESTION
    assert isinstance(question, Question)  # noqa: S101  # each file there has one
    return question
