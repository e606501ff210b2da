"""Tests of `expiry.py`: expired items are found and removed, and silence is reported per period."""

from __future__ import annotations

import pytest

from busflow.bus.expiry import Perishable, SilenceTimer, message_of, next_expiry_ns
from busflow.clock import SimClock
from busflow.testing import virtual_time


def test_an_expired_item_still_gives_its_message():
    assert [message_of(item) for item in ("plain", Perishable("old", 0))] == ["plain", "old"]


def test_next_expiry_is_the_earliest():
    assert next_expiry_ns(["plain", Perishable("b", 20), Perishable("a", 10)]) == 10
    assert next_expiry_ns(["plain"]) is None


@pytest.mark.parametrize(("repeat", "count"), [(True, 3), (False, 1)])
@virtual_time
async def test_silence_is_reported_per_period_or_once(repeat, count):
    clock, silences = SimClock(), []
    timer = SilenceTimer(1.0, clock, lambda: silences.append(clock.seconds()), repeat=repeat)
    await clock.sleep(5)
    assert silences == [], "the first touch starts the timer"
    timer.touch()
    await clock.sleep(3.5)
    assert silences == [6.0, 7.0, 8.0][:count]
    timer.close()
    await clock.sleep(5)
    assert len(silences) == count


@virtual_time
async def test_touch_restarts_the_period():
    clock, silences = SimClock(), []
    timer = SilenceTimer(1.0, clock, lambda: silences.append(clock.seconds()), repeat=True)
    for _ in range(4):
        timer.touch()
        await clock.sleep(0.75)
    assert silences == []
    timer.close()
