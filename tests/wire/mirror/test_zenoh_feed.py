"""What comes through Zenoh: its thread wakes the loop once, and keeps the order with what the loop takes itself."""

import threading
from math import inf

import pytest

from busflow.wire.mirror.arrival_buffer import ArrivalBuffer
from busflow.wire.mirror.zenoh_feed import ZenohFeed
from busflow.wire.zenoh.session import open_session

PATIENCE_S = 60.0


@pytest.mark.parametrize("latched", [0, 3])
def test_the_loop_is_woken_for_the_first_message_and_takes_the_others(directory, latched):
    with (
        open_session(directory, listen="here.sock", earlier=()) as here,
        open_session(directory, listen="there.sock", earlier=("here.sock",)) as there,
    ):
        woken = threading.Semaphore(0)
        buffer = ArrivalBuffer(16, inf, by_line=(), on_heavy=print)
        feed = ZenohFeed(here, "x/y", buffer, depth=16, latched=latched, on_sample=woken.release)
        publisher = there.declare_publisher("x/y")
        while not publisher.matching_status.matching:
            pass
        for numbers in (range(3), range(3, 6)):
            for number in numbers:
                publisher.put(bytes([number]))
            assert woken.acquire(timeout=PATIENCE_S)
            assert feed.waits
            taken = []
            while len(taken) < 3:
                buffer.fill()
                taken += [payload[0] for payload, _ in buffer.take()]
            assert taken == [*numbers]
            assert not woken.acquire(blocking=False), "once for all of them"
            feed.resume()
        feed.close()
        publisher.put(b"x")
        assert [thread.name for thread in threading.enumerate() if "inlet" in thread.name] == []
        assert (len(buffer), woken.acquire(blocking=False)) == (0, False)
