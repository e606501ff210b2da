"""Garbage: how Python's cyclic collector is kept from holding up a graph that has started.

A full collection looks at every object there is: 35 ms for the 70,000 of a small graph, 120 ms for 600,000, in which
no handler runs. What is there when a graph has started is there to stay, so it is left out from then on (frozen), and
what comes later is looked at all together more seldom. Messages are no cycles: they go when nobody has them any more,
and that needs no collector.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Generator
from contextlib import contextmanager

THRESHOLDS = (1_000, 5, 200)
"""Steps of 1,000 objects hold a run up by 1 ms at most where steps of 5,000 took 3 to 5, and in all no longer."""
_PYTHONS_OWN = {(700, 10, 10), (2000, 10, 10), (2000, 10, 0)}
"""What the thresholds are until somebody sets them, in one version of Python or another."""


def is_frozen() -> bool:
    """Whether somebody has frozen the thousands of objects there were; Python 3.12 itself begins with 400 frozen."""
    return gc.get_freeze_count() > 1000


@contextmanager
def collected_in_steps() -> Generator[Callable[[], None]]:
    """Yields what is to be called once everything has started; at the end all is as it was.

    Who has set thresholds, frozen anything or turned the collector off has a policy, which stays.
    """
    before = gc.get_threshold()
    settled = False

    def settle() -> None:
        nonlocal settled
        if gc.isenabled() and gc.get_threshold() in _PYTHONS_OWN and not is_frozen():
            settled = True
            gc.freeze()
            gc.set_threshold(*THRESHOLDS)

    try:
        yield settle
    finally:
        if settled:
            gc.unfreeze()
            gc.set_threshold(*before)


def look_at_everything(_: object = None) -> None:
    """Something that was there from the start may be garbage now: leave nothing out any more."""
    gc.unfreeze()
