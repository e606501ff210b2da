"""Ticks: each call of a timer's handler, recorded in its place between the messages.

Nothing else in a recording says whether a tick came before or after a message of the same instant, and a replayed node
may act differently.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from busflow.msgs.std_msgs import String

if TYPE_CHECKING:
    from busflow.bus.timer import Timer
    from busflow.clock import Clock

TICKS = "/_ticks"
"""The channel of the ticks; `std_msgs/msg/String`, which every reader knows."""


@dataclass(frozen=True, slots=True)
class Tick:
    """A call of a timer's handler."""

    node: str
    timer: str
    period_s: float
    elapsed_ns: int
    """The run's age in nanoseconds: with the time of the record, it gives the run's start."""
    time_ns: int
    """The time of the record."""

    @classmethod
    def parse(cls, text: str, time_ns: int) -> Tick | None:
        """Parse a recorded tick; None for anything else.

        >>> Tick.parse("/processor tell_status 0.5 500000000", 7)
        Tick(node='/processor', timer='tell_status', period_s=0.5, elapsed_ns=500000000, time_ns=7)
        """
        try:
            node, rest = text.split(" ", 1)
            timer, period, elapsed = rest.rsplit(" ", 2)
            return cls(node, timer, float(period), int(elapsed), time_ns)
        except ValueError:
            return None


def tick_message(timer: Timer, clock: Clock) -> String:
    """Return a tick as it is recorded: the names of node and timer, the period now, and how long the run has lasted."""
    return String(data=f"{timer.node} {timer.name} {timer.period_s!r} {clock.elapsed_ns()}")
