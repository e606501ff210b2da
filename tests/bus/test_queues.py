"""Tests of `queues.py`: the overflow policies, and the counts of drops."""

from collections import deque

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.bus.qos import Overflow
from busflow.bus.queues import Queue, create_queue
from busflow.errors import InvalidQoS

LOSSY = [Overflow.DROP_OLDEST, Overflow.DROP_NEWEST]


def filled(overflow: Overflow, depth: int, items: str) -> Queue[str]:
    queue: Queue[str] = create_queue(overflow, depth)
    for item in items:
        queue.push(item)
    return queue


@pytest.mark.parametrize(("overflow", "kept"), [(Overflow.DROP_OLDEST, "cde"), (Overflow.DROP_NEWEST, "abc")])
def test_full_queue_drops_as_its_policy_says(overflow, kept):
    queue = filled(overflow, 3, "abcde")
    assert "".join(queue.items) == kept
    assert queue.drops == {"overflow": 2}


def test_block_queue_reports_full_and_drops_nothing():
    queue = filled(Overflow.BLOCK, 2, "ab")
    assert queue.full
    assert (len(queue), queue.dropped) == (2, 0)


@pytest.mark.parametrize("depth", [0, -1])
def test_depth_below_one_is_refused(depth):
    with pytest.raises(InvalidQoS, match=f"got {depth}"):
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


@pytest.mark.parametrize("overflow", [Overflow.DROP_NEWEST, Overflow.BLOCK])
def test_no_other_queue_forgets(overflow):
    queue = create_queue(overflow, 2)
    for item in "ab":
        queue.fast_push(item)
    if overflow is Overflow.DROP_NEWEST:
        queue.fast_push("c")
    assert queue.counts_overflow
    assert (list(queue.items), queue.dropped) == (["a", "b"], int(overflow is Overflow.DROP_NEWEST))


def test_discarding_counts_under_its_own_reason():
    queue = filled(Overflow.DROP_OLDEST, 2, "abc")
    queue.discard("superseded")
    assert queue.drops == {"overflow": 1, "superseded": 1}
    assert list(queue.items) == ["c"]


@given(
    overflow=st.sampled_from(LOSSY),
    depth=st.integers(1, 5),
    steps=st.lists(st.one_of(st.integers(), st.just("take")), max_size=60),
)
def test_published_equals_delivered_dropped_and_queued(overflow, depth, steps):
    queue: Queue[int] = create_queue(overflow, depth)
    model: deque[int] = deque(maxlen=depth)
    published = delivered = 0
    for step in steps:
        if step == "take":
            if queue.items:
                assert queue.items.popleft() == model.popleft()
                delivered += 1
        else:
            queue.push(step)
            published += 1
            if overflow is Overflow.DROP_OLDEST or len(model) < depth:
                model.append(step)
        assert list(queue.items) == list(model)
        assert published == delivered + queue.dropped + len(queue)


def test_a_queue_shows_its_policy_and_counts():
    assert repr(filled(Overflow.DROP_OLDEST, 3, "abcde")) == "<DropOldest 3/3, 2 dropped>"
