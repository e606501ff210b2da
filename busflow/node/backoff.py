"""Backoff: when a node that ended is started anew, and when it is given up.

Pure: the time comes from outside, in seconds of the run's clock.

>>> backoff = Backoff(RestartPolicy(most=3, first_s=1, longest_s=3, window_s=60))
>>> [backoff.next_s(lived_s=0, now_s=at) for at in (0, 2, 5, 9)]
[1, 2, 3, None]
"""

from __future__ import annotations

from busflow.node.supervision import RestartPolicy


class Backoff:
    """The restarts of one node: how many, and how long the pause before the next one."""

    __slots__ = ("_policy", "_recent", "_row", "restarts")

    def __init__(self, policy: RestartPolicy) -> None:
        self.restarts = 0
        """How often the node was started anew, or is about to be."""
        self._policy = policy
        self._recent: list[float] = []
        self._row = 0

    def next_s(self, *, lived_s: float, now_s: float) -> float | None:
        """The pause before the next restart, counted as one; None when the limit is reached.

        Args:
            lived_s: How long the node has run since its start returned.
            now_s: The run's time.
        """
        policy, recent = self._policy, self._recent
        while recent and now_s - recent[0] >= policy.window_s:
            del recent[0]
        if len(recent) >= policy.most:
            return None
        recent.append(now_s)
        self.restarts += 1
        self._row = 0 if lived_s >= policy.window_s else self._row
        pause_s = min(policy.longest_s, policy.first_s * 2 ** min(self._row, 64))
        self._row += 1
        return pause_s
