"""The sender's thread: order, bounds, and what happens to what does not fit or fails."""

import threading

import pytest

from busflow.wire.zenoh.sender import DEPTH, MOST_BYTES, SenderThread

PATIENCE_S = 60.0


@pytest.fixture
def errors():
    return []


@pytest.fixture
def sender(errors):
    made = SenderThread("busflow.test", on_error=errors.append)
    yield made
    made.close()


class Gate:
    """Work that waits until it is let go on."""

    def __init__(self):
        self.entered, self.open = threading.Event(), threading.Event()

    def __call__(self):
        self.entered.set()
        assert self.open.wait(PATIENCE_S)


def settle(sender):
    done = threading.Event()
    sender.hand(done.set)
    assert done.wait(PATIENCE_S)


def test_nothing_runs_until_something_is_to_be_done(sender):
    assert "busflow.test" not in [thread.name for thread in threading.enumerate()]
    settle(sender)
    assert "busflow.test" in [thread.name for thread in threading.enumerate()]


def test_work_is_done_in_order_on_another_thread(sender):
    done = []
    for number in range(50):
        sender.hand(lambda number=number: done.append((number, threading.get_ident())))
    settle(sender)
    assert [number for number, _ in done] == list(range(50))
    assert threading.get_ident() not in {thread for _, thread in done}


def test_a_full_sender_drops_and_counts_the_oldest(sender):
    gate, done = Gate(), []
    sender.hand(gate)
    assert gate.entered.wait(PATIENCE_S)
    for number in range(DEPTH + 2):
        sender.hand(lambda number=number: done.append(number))
    last = threading.Event()
    sender.hand(last.set)
    assert sender.dropped == 3
    gate.open.set()
    assert last.wait(PATIENCE_S)
    assert done == list(range(3, DEPTH + 2))


def test_the_senders_queue_is_bounded_in_bytes(sender):
    gate, done, last = Gate(), [], threading.Event()
    sender.hand(gate)
    assert gate.entered.wait(PATIENCE_S)
    for name, size in (("a", MOST_BYTES // 2), ("b", MOST_BYTES // 2), ("c", 1)):
        sender.hand(lambda name=name: done.append(name), size)
    assert sender.dropped == 1
    sender.hand(last.set, MOST_BYTES * 2)
    assert sender.dropped == 3
    gate.open.set()
    assert last.wait(PATIENCE_S)
    assert done == []


def test_failing_work_is_reported_and_the_next_done(sender, errors):
    sender.hand(lambda: 1 / 0)
    settle(sender)
    assert [type(error) for error in errors] == [ZeroDivisionError]


def test_finish_waits_for_what_was_queued(sender):
    gate, done = Gate(), []
    sender.hand(gate)
    sender.hand(lambda: done.append("last"))
    sender.finish(0)
    assert done == []
    gate.open.set()
    sender.finish(PATIENCE_S)
    assert done == ["last"]


def test_closing_drops_what_waits_and_ends_the_thread(sender):
    gate, done = Gate(), []
    sender.hand(gate)
    assert gate.entered.wait(PATIENCE_S)
    sender.hand(lambda: done.append("late"))
    threading.Timer(0.05, gate.open.set).start()
    sender.close()
    sender.hand(lambda: done.append("later still"))
    assert (done, sender.dropped) == ([], 2)
    assert "busflow.test" not in [thread.name for thread in threading.enumerate()]
