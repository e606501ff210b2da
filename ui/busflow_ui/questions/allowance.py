"""Allowance: how many questions a page may ask the assistant in a time. Pure."""

from __future__ import annotations

from collections import deque

from busflow.errors import NotAllowed

WINDOW_S = 60.0


class Allowance:
    """Number of questions within each minute.

    >>> allowance = Allowance(2)
    >>> [allowance.take(now_s) for now_s in (0.0, 30.0, 60.0)]
    [None, None, None]
    >>> allowance.take(61.0)
    Traceback (most recent call last):
    busflow.errors.NotAllowed: 2 questions a minute may be asked from here; ask again in 29 s
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._asked: deque[float] = deque()

    def take(self, now_s: float) -> None:
        """Count a question.

        Raises:
            NotAllowed: There were too many within the last minute.
        """
        while self._asked and now_s - self._asked[0] >= WINDOW_S:
            self._asked.popleft()
        if len(self._asked) >= self._most:
            wait_s = max(1, round(WINDOW_S - (now_s - self._asked[0])))
            raise NotAllowed(f"{self._most} questions a minute may be asked from here; ask again in {wait_s} s")
        self._asked.append(now_s)
