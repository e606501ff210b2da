"""Accounts of actions: how the goals ended that a server received, or a client sent."""

from __future__ import annotations

from dataclasses import dataclass

from busflow.bus.statistics import ClientStatistics, ServerStatistics


@dataclass(frozen=True, slots=True)
class GoalServerStatistics(ServerStatistics):
    """One server's account of requests to `send_goal`, and of the goals that came of them.

    `received == rejected + succeeded + aborted + canceled + running + queued` at every moment.
    """

    rejected: int = 0
    """Goals that were not taken: refused, or without room in the queue of requests."""
    succeeded: int = 0
    aborted: int = 0
    """Goals that were given up, those of a node that ended among them."""
    canceled: int = 0
    running: int = 0
    """Goals whose handler runs."""
    queued: int = 0
    """Goals that wait for their turn, and requests that are not answered yet."""


@dataclass(frozen=True, slots=True)
class GoalClientStatistics(ClientStatistics):
    """One client's account of requests to `send_goal`, and of its goals.

    `called == rejected + succeeded + aborted + canceled + left + lost + running` at every moment.
    """

    rejected: int = 0
    succeeded: int = 0
    aborted: int = 0
    canceled: int = 0
    left: int = 0
    """Goals whose block was left before they ended, by a timeout too; each was canceled."""
    lost: int = 0
    """Goals without an answer: there was no server, or it has gone."""
    running: int = 0
    """Goals that are sent and have not ended."""
    feedback_dropped: int = 0
    """Feedback that a full queue of a goal discarded."""
