"""Tests of `queues.py`: the overflow policies, and the counts of drops."""

import pytest

from busflow.bus.qos import Overflow
from busflow.bus.queues import Queue, create_queue
from busflow.errors import InvalidDeclaration


def filled(overflow: Overflow, depth: int, items: str) -> Queue[str]:
    queue: Queue[str] = create_queue(overflow, depth)
    for item in items:
        queue.push(item)
    return queue


@pytest.mark.parametrize("depth", [0, -1])
def test_depth_below_one_is_refused(depth):
    with pytest.raises(InvalidDeclaration):
        create_queue(Overflow.DROP_OLDEST, depth)


def test_drops_are_counted_while_a_listener_observes():
    queue = create_queue(Overflow.DROP_OLDEST, 2)
    for item in "abc":
        queue.fast_push(item)
    assert (list(queue.items), queue.dropped, queue.counts_overflow) == (["b", "c"], 0, False)
    reasons: list[str] = []
    others: list[str] = []
    queue.observe_drops(reasons.append)
    queue.observe_drops(others.append)
    queue.fast_push("d")
    assert (list(queue.items), queue.dropped, reasons, others) == (["c", "d"], 1, ["overflow"], ["overflow"])
    queue.ignore_drops()
    queue.fast_push("e")
    assert (list(queue.items), queue.dropped, reasons) == (["d", "e"], 1, ["overflow"])


def test_a_queue_shows_its_policy_and_counts():
    assert repr(filled(Overflow.DROP_OLDEST, 3, "abcde")) == "<DropOldest 3/3, 2 dropped>"
