"""`matching.py`: what belongs together is a matter of stamps, whatever the order of arrival."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from busflow.pairing.matching import Alone, Match, Matcher

MS = 1_000_000


def matched(streams, order, within):
    """The matches and the drops when the streams arrive in this order of topics; what waits at the end."""
    matcher, queues, left = Matcher(len(streams), within), [[] for _ in streams], [list(each) for each in streams]
    matches, drops = [], []
    for topic in order:
        queues[topic].append(left[topic].pop(0))
        while (found := matcher.decide(queues)) is not None:
            if isinstance(found, Match):
                matches.append(tuple(queue[0] for queue in queues))
                for number, queue in enumerate(queues):
                    matcher.leave(number, [queue.pop(0)])
            else:
                assert isinstance(found, Alone)
                for _ in range(found.count):
                    drops.append((found.topic, queues[found.topic][0]))
                    matcher.leave(found.topic, [queues[found.topic].pop(0)])
    return matches, drops, queues


def in_turn(streams):
    """Arrival by stamp."""
    return [topic for _, topic in sorted((stamp, topic) for topic, each in enumerate(streams) for stamp in each)]


streams = st.integers(2, 3).flatmap(
    lambda topics: st.tuples(*[st.lists(st.integers(0, 400), max_size=12).map(sorted)] * topics)
)


@given(streams, st.integers(0, 60), st.randoms(use_true_random=False))
def test_no_match_depends_on_the_order_of_arrival(streams, within, random):
    order = in_turn(streams)
    shuffled = list(order)
    random.shuffle(shuffled)
    expected, dropped, _ = matched(streams, order, within)
    found, others, _ = matched(streams, shuffled, within)
    assert found == expected
    assert sorted(others) == sorted(dropped)


@given(streams, st.integers(0, 60))
def test_each_message_is_used_once_within_the_limit(streams, within):
    matches, drops, waiting = matched(streams, in_turn(streams), within)
    assert all(max(match) - min(match) <= within for match in matches)
    for topic, stream in enumerate(streams):
        used = [match[topic] for match in matches]
        gone = [stamp for number, stamp in drops if number == topic]
        assert sorted([*used, *gone, *waiting[topic]]) == stream
        assert used == sorted(used)


@given(
    st.integers(2, 4).flatmap(
        lambda topics: st.lists(st.tuples(*[st.integers(-12, 12)] * topics), min_size=1, max_size=10)
    )
)
def test_streams_with_jitter_are_matched_completely(jitters):
    """Each topic at 10 Hz, each stamp up to 12 ms off: one match for each period but what still waits at the end."""
    topics = len(jitters[0])
    streams = [[100 * number + jitter[topic] for number, jitter in enumerate(jitters)] for topic in range(topics)]
    matches, drops, _ = matched(streams, in_turn(streams), 24)
    assert drops == []
    assert matches == list(zip(*streams, strict=True))[: len(matches)]
    assert len(matches) >= len(jitters) - 1


@given(st.tuples(*[st.lists(st.integers(0, 40), max_size=20, unique=True).map(sorted)] * 3))
def test_without_tolerance_only_equal_stamps_match(streams):
    matches, _, _ = matched(streams, in_turn(streams), 0)
    assert matches == [(stamp,) * 3 for stamp in sorted(set.intersection(*map(set, streams)))]


def test_nearest_of_several_is_taken():
    left, right = [0, 100, 200, 300], [91, 108, 195, 305]
    matches, drops, _ = matched([left, right], in_turn([left, right]), 20)
    assert matches[:2] == [(100, 108), (200, 195)]
    assert drops == [(0, 0), (1, 91)]


def test_match_need_not_wait_for_a_period():
    """From the third pair on the gap is known, and the second message of a pair completes it."""
    left, right = [0, 100, 200], [10, 110, 210]
    matches, _, waiting = matched([left, right], in_turn([left, right]), 20)
    assert matches == [(0, 10), (100, 110), (200, 210)]
    assert waiting == [[], []]


def test_time_set_back_drops_what_came_before():
    old, new = [100_000 * MS, 100_100 * MS], [0, 100 * MS, 200 * MS]
    streams = [[*old, *new], [*old, *new]]
    order = [0, 0, 1, 0, 0, 0, 1, 1, 1, 1]
    matches, drops, _ = matched(streams, order, 0)
    assert matches[-3:] == [(stamp, stamp) for stamp in new]
    assert len(matches) * 2 + len(drops) == 10


class Counted(list):
    """A queue that counts how many of its stamps are looked at."""

    looked = 0

    def __iter__(self):
        for each in super().__iter__():
            Counted.looked += 1
            yield each

    def __getitem__(self, at):
        found = super().__getitem__(at)
        Counted.looked += len(found) if isinstance(at, slice) else 1
        return found


def looks(waiting):
    """How many stamps are looked at for one decision: the partner of a message is behind so many others."""
    matcher, Counted.looked = Matcher(2, 10 * waiting), 0
    found = matcher.decide([Counted([10 * waiting]), Counted(range(0, 20 * waiting, 10))])
    assert found == Alone(1, waiting, 10)
    return Counted.looked


def test_decision_is_linear_in_the_queue():
    assert looks(200) < 2.1 * looks(100)
