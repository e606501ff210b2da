"""Who waits for whom: circles are found, and nobody is stopped before those who need him."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from busflow.node.supervision import cycle, stop_order

NAMES = [f"/n{index}" for index in range(6)]
NEEDS = st.dictionaries(st.sampled_from(NAMES), st.lists(st.sampled_from(NAMES), max_size=4), max_size=6)


def in_a_circle(needs):
    """The same by brute force: whoever reaches himself."""

    def reached(name, seen):
        for other in needs.get(name, ()):
            if other not in seen:
                seen.add(other)
                reached(other, seen)
        return seen

    return {name for name in needs if name in reached(name, set())}


@given(NEEDS)
def test_each_circle_is_found_and_is_one(needs):
    found = cycle(needs)
    assert bool(found) == bool(in_a_circle(needs))
    if found:
        assert found[0] == found[-1]
        assert all(later in needs[earlier] for earlier, later in pairwise(found))


@given(NEEDS)
def test_each_node_stops_once_after_its_dependants(needs):
    order = stop_order(NAMES, needs)
    assert sorted(order) == NAMES
    if not cycle(needs):
        for name, others in needs.items():
            assert all(order.index(name) < order.index(other) for other in others if other != name)


def test_without_needs_the_last_one_stops_first():
    assert stop_order(["/a", "/b", "/c"], {}) == ["/c", "/b", "/a"]
