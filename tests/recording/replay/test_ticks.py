"""Recorded ticks that are still to come: as many are held as somebody has to know, however long the recording is."""

import pytest

from busflow.msgs.std_msgs import String
from busflow.recording.bag.bag import Bag
from busflow.recording.replay.history import past_of, tick_of
from busflow.recording.replay.ticks import ComingTicks
from tests.recording.conftest import write_messages

MS = 1_000_000
HOUR_MS = 3_600_000


def tick(timer, period_s, at_ms, node="/node"):
    text = f"{node} {timer} {period_s!r} {at_ms * MS}"
    return "/_ticks", String(data=text), at_ms * MS


@pytest.fixture
def coming(tmp_path):
    """The ticks of a recording, and all of them in its order."""

    def make(*ticks):
        bag = Bag(write_messages(tmp_path / "ticks.mcap", ticks))
        past = past_of(bag)
        found = ComingTicks(bag, {"/node"}, past.ticks, in_order=past.ticks_in_order)
        return found, [tick_of(each) for each in bag.entries()]

    return make


def test_held_ticks_are_bounded_by_the_slowest_timer(coming):
    times = sorted([(n, "fast") for n in range(5000)] + [(n, "slow") for n in range(0, 5000, 100)])
    ticks, whole = coming(*(tick(timer, 0.001 if timer == "fast" else 0.1, at_ms) for at_ms, timer in times))
    most = 0
    for each in whole:
        key = each.node, each.timer
        assert ticks.next(key, each.time_ns) == each
        ticks.come(each)
        step_ms = 1 if each.timer == "fast" else 100
        ticks.next(key, each.time_ns + step_ms * MS)
        most = max(most, ticks.held)
    assert len(whole) == 5050
    assert most <= 102
    assert ticks.held == 0


def test_stopped_timer_is_searched_only_until_due(coming):
    ticks, _ = coming(tick("a", 0.1, 0), *(tick("b", 0.001, n) for n in range(1000)), tick("a", 0.1, HOUR_MS))
    assert ticks.next(("/node", "a"), 0).time_ns == 0
    ticks.come(ticks.next(("/node", "a"), 0))
    assert ticks.next(("/node", "a"), 100 * MS) is None
    assert ticks.held <= 102
    assert ticks.next(("/node", "a"), HOUR_MS * MS).time_ns == HOUR_MS * MS


def test_a_clock_set_back_does_not_hide_ticks(coming):
    ticks, _ = coming(tick("b", 1.0, 9000), tick("a", 1.0, 500))
    assert ticks.next(("/node", "a"), 500 * MS).time_ns == 500 * MS


def test_others_nodes_ticks_are_not_held(coming):
    ticks, _ = coming(*(tick("a", 0.1, n, node="/other") for n in range(100)), tick("a", 0.1, 200))
    assert ticks.next(("/node", "a"), 200 * MS).time_ns == 200 * MS
    assert ticks.held == 1
