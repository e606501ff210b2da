"""What comes through Zenoh: its thread wakes the loop once, and keeps order and limits with what the loop takes."""

import threading
from contextlib import contextmanager

import pytest

from busflow.wire.mirror import zenoh_feed
from busflow.wire.mirror.zenoh_feed import ZenohFeed
from busflow.wire.zenoh.session import open_session

PATIENCE_S = 60.0


@contextmanager
def feeding(directory, woken, *, depth=16, latched=0, on_heavy=print):
    """A feed, and a publisher that reaches it."""
    with (
        open_session(directory, listen="here.sock", earlier=()) as here,
        open_session(directory, listen="there.sock", earlier=("here.sock",)) as there,
    ):
        feed = ZenohFeed(here, "x/y", depth=depth, latched=latched, on_sample=woken.release, on_heavy=on_heavy)
        publisher = there.declare_publisher("x/y")
        while not publisher.matching_status.matching:
            pass
        yield feed, publisher, here
        feed.close()


def numbers(feed):
    """The first bytes of the samples that it gives, and whether some were dropped."""
    samples, has_dropped = feed.take()
    return [each.payload.to_bytes()[0] for each in samples], has_dropped


@pytest.mark.parametrize("latched", [0, 3])
def test_the_loop_is_woken_for_the_first_message_and_takes_the_others(directory, latched):
    woken = threading.Semaphore(0)
    with feeding(directory, woken, latched=latched) as (feed, publisher, _):
        for sent in (range(3), range(3, 6)):
            for number in sent:
                publisher.put(bytes([number]))
            assert woken.acquire(timeout=PATIENCE_S)
            assert feed.waits
            taken = []
            while len(taken) < 3:
                taken += numbers(feed)[0]
            assert taken == [*sent]
            assert not woken.acquire(blocking=False), "once for all of them"
            feed.resume()


def test_no_thread_is_left_after_the_end(directory):
    woken = threading.Semaphore(0)
    with feeding(directory, woken) as (feed, _, _):
        pass
    assert [thread.name for thread in threading.enumerate() if "inlet" in thread.name] == []
    assert (feed.take(), woken.acquire(blocking=False)) == (([], False), False)


def test_a_full_ring_keeps_the_newest_and_says_so(directory):
    woken, arrived = threading.Semaphore(0), threading.Semaphore(0)
    with feeding(directory, woken, depth=4) as (feed, publisher, here):
        publisher.put(b"\0")
        assert woken.acquire(timeout=PATIENCE_S)
        assert numbers(feed) == ([0], False)
        beside = here.declare_subscriber("x/y", lambda _: arrived.release())
        for number in range(1, 10):  # after the ninth, both subscribers have got the eighth
            publisher.put(bytes([number]))
            assert arrived.acquire(timeout=PATIENCE_S)
        found, has_dropped = numbers(feed)
        assert (found[-2:], len(found), has_dropped) in (([7, 8], 4, True), ([8, 9], 4, True))
        assert numbers(feed)[1] is False
        beside.undeclare()


def test_a_busy_loop_does_not_let_bytes_pile_up(directory, limits, monkeypatch):
    limits(busy_loop=0.001)
    monkeypatch.setattr(zenoh_feed, "LARGEST", 4000)
    woken, heavy = threading.Semaphore(0), threading.Semaphore(0)
    with feeding(directory, woken, on_heavy=heavy.release) as (feed, publisher, _):
        for number in range(8):
            publisher.put(bytes([number]) * 1000)
        assert heavy.acquire(timeout=PATIENCE_S)
        publisher.put(b"\xff")
        found, dropped = numbers(feed)
        while 255 not in found:
            found += numbers(feed)[0]
        assert dropped
        assert found == sorted(found)
        assert not heavy.acquire(blocking=False), "it says so once"
