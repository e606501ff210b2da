"""How many requests may go out: no more than some within any hour."""

from __future__ import annotations

from collections import deque

HOUR_S = 3600.0


class HourlyBudget:
    """A number of requests per hour.

    >>> budget = HourlyBudget(1)
    >>> budget.take(0.0), budget.take(10.0), budget.take(3601.0)
    (True, False, True)
    """

    def __init__(self, per_hour: int) -> None:
        self._taken: deque[float] = deque(maxlen=per_hour)
        self._per_hour = per_hour

    def take(self, now_s: float) -> bool:
        """Return whether one more request may go out now, and count it if so."""
        if len(self._taken) == self._per_hour and now_s - self._taken[0] < HOUR_S:
            return False
        self._taken.append(now_s)
        return True
