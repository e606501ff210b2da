"""Results: what came of the goals of one server, for those that ask later."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from busflow.clock import NS_PER_S, Clock

if TYPE_CHECKING:
    from collections.abc import Collection

    from busflow.actions.goal import RunningGoal
    from busflow.msgs.action_msgs import GoalStatus

RESULT_KEPT_S = 10
"""How long a result is kept, from the end of its goal on."""
RESULTS_KEPT = 64
"""How many results are kept at most; the oldest goes first."""


class Results:
    """The goals that ended lately."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._ended: dict[bytes, tuple[int, RunningGoal[Any]]] = {}

    def keep(self, goal: RunningGoal[Any]) -> None:
        """Keep a goal that has just ended."""
        now_ns = self._clock.monotonic_ns()
        self._ended[goal.key] = now_ns, goal
        self._forget(now_ns)

    def goal(self, key: bytes) -> RunningGoal[Any] | None:
        """Return a goal that ended lately, by `key_of` its identifier."""
        if key not in self._ended:
            return None
        self._forget(self._clock.monotonic_ns())
        return self._ended[key][1] if key in self._ended else None

    @property
    def statuses(self) -> Collection[GoalStatus]:
        """The states of the goals that ended lately, the oldest first."""
        return [goal.status for _, goal in self._ended.values()]

    def _forget(self, now_ns: int) -> None:
        """Drop what is too old or too much; entries stand in the order of their times."""
        kept, oldest_ns = self._ended, now_ns - RESULT_KEPT_S * NS_PER_S
        while kept:
            first = next(iter(kept))
            if len(kept) <= RESULTS_KEPT and kept[first][0] > oldest_ns:
                return
            del kept[first]
