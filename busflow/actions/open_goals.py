"""OpenGoals: the goals that a server runs and those that wait, and what it does with one more."""

from __future__ import annotations

from collections import deque
from enum import StrEnum
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from busflow.actions.goal import RunningGoal

AT_MOST = 10
"""The default number of goals that may wait with `queue`, or run with `parallel`."""


class WhenBusy(StrEnum):
    """What a server does with a goal while another one runs."""

    REJECT = "reject"
    QUEUE = "queue"
    REPLACE = "replace"
    PARALLEL = "parallel"


class OpenGoals:
    """The goals of one server that have not ended."""

    def __init__(self, when_busy: WhenBusy, at_most: int) -> None:
        """Create the account of a server without goals.

        Args:
            when_busy: What is done with a goal while another one runs.
            at_most: With `queue`, how many may wait; with `parallel`, how many may run.
        """
        self.when_busy = when_busy
        self.running: list[RunningGoal[Any]] = []
        self.waiting: deque[RunningGoal[Any]] = deque()
        self._at_most = at_most

    def refusal(self) -> str | None:
        """Return the reason why there is no room for one more goal, or None."""
        match self.when_busy:
            case WhenBusy.REJECT if self.running:
                return f"it is busy with the goal {self.running[0].id}"
            case WhenBusy.QUEUE if self.running and len(self.waiting) >= self._at_most:
                return f"{len(self.waiting)} goals wait already"
            case WhenBusy.PARALLEL if len(self.running) >= self._at_most:
                return f"{len(self.running)} goals run already"
            case _:
                return None

    def replaced(self) -> list[RunningGoal[Any]]:
        """Return the goals that one more would replace, those that wait before those that run."""
        return [*self.waiting, *self.running] if self.when_busy is WhenBusy.REPLACE else []

    def next(self) -> RunningGoal[Any] | None:
        """Let the first goal that waits run, and return it; None if none waits, or there is no room."""
        if not self.waiting or len(self.running) >= (self._at_most if self.when_busy is WhenBusy.PARALLEL else 1):
            return None
        goal = self.waiting.popleft()
        self.running.append(goal)
        return goal

    def remove(self, goal: RunningGoal[Any]) -> None:
        """Take a goal out that has ended."""
        (self.running if goal in self.running else self.waiting).remove(goal)

    def ahead_of(self, goal: RunningGoal[Any]) -> RunningGoal[Any] | None:
        """Return the goal that must end before this one can; itself where it runs, None where one is to be replaced."""
        if goal in self.running:
            return goal
        return self.running[0] if self.running and self.when_busy is WhenBusy.QUEUE else None
