"""The window of the last moments: it keeps no more bytes than it may, and the newest of what is latched."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow import QoS
from busflow.bus.endpoint import Endpoint
from busflow.msgs.std_msgs import String
from busflow.recording.recorder.channels import Tracks
from busflow.recording.recorder.last_moments import EACH_BYTES, Kept, LastMoments

TRACK = Tracks().add("/a", String)
SPAN_NS = 10


def latched(node, depth=1):
    return Endpoint(node, "/a", String, QoS(depth=depth, durability="transient_local"), "Node.end", "a")


def filled(most_bytes, *rows):
    """A window to which came: the time, the size and the transient_local publisher of each message."""
    window = LastMoments(most_bytes)
    for number, (now_ns, size, publisher) in enumerate(rows, 1):
        window.add(Kept(TRACK, number, now_ns, now_ns + SPAN_NS, b"x" * size, publisher), now_ns)
    return window


def numbers(messages):
    return [each.sequence for each in messages]


def test_messages_leave_when_their_time_is_over():
    window = filled(1 << 20, *((now_ns, 1, None) for now_ns in range(30)))
    assert numbers(window) == list(range(21, 31))
    window.forget(35)
    assert numbers(window) == list(range(27, 31))
    window.forget(100)
    assert (numbers(window), window.bytes) == ([], 0)


def test_the_newest_latched_messages_outlast_the_window():
    one, two = latched("/one"), latched("/two", depth=2)
    rows = [(0, 1, one), (1, 1, two), (2, 1, two), (3, 1, one), (4, 1, two), (100, 1, None), (101, 1, one)]
    window = filled(1 << 20, *rows)
    assert numbers(window) == [6, 7]
    assert numbers(window.latched()) == [3, 5]
    assert window.lost == 0


def test_latched_messages_leave_when_nothing_else_can():
    window = filled(3 * EACH_BYTES, (0, 100, latched("/one")), (1, 100, latched("/two")), (2, 100, None))
    assert numbers(window) == []
    assert numbers(window.latched()) == [1, 2]
    window = filled(3 * EACH_BYTES, *((now_ns, 600 - EACH_BYTES, latched(f"/{now_ns}")) for now_ns in range(2)))
    assert numbers(window.latched()) == [2]
    assert window.lost == 1


PUBLISHERS = st.sampled_from([None, None, latched("/one"), latched("/two", 3)])
ROWS = st.lists(st.tuples(st.integers(0, 6), st.integers(0, 3000), PUBLISHERS), max_size=60)


@pytest.mark.hypothesis
@given(ROWS, st.integers(1, 8000))
def test_bytes_are_those_of_what_is_kept(rows, most_bytes):
    now_ns, timed = 0, []
    for step, size, publisher in rows:
        now_ns += step
        timed.append((now_ns, size, publisher))
    window = filled(most_bytes, *timed)
    kept = [*window, *window.latched()]
    assert window.bytes == sum(each.size for each in kept) <= most_bytes
    assert numbers(window) == sorted(numbers(window))
    assert len(set(numbers(kept))) == len(kept)
