"""What a meter counted, over a window and between two readings."""

from dataclasses import asdict

from hypothesis import given
from hypothesis import strategies as st

from busflow.cli.topic.rates import BW, HZ, Flows, Reading, Window, bw_text, drop_lines
from busflow.wire.queries.meter import Spread


def spread(*values: float) -> Spread:
    found = Spread()
    for each in values:
        found.add(each)
    return found


def reading(*sizes: float, seconds: float = 1.0) -> Reading:
    return Reading(seconds, len(sizes), spread(*[0.1] * len(sizes)), spread(*sizes), Spread())


@given(st.lists(st.floats(-1e6, 1e6)), st.lists(st.floats(-1e6, 1e6)))
def test_two_spreads_together_are_that_of_all_values(some: list[float], others: list[float]):
    both, whole = spread(*some) + spread(*others), spread(*some, *others)
    assert (both.count, both.low, both.high) == (whole.count, whole.low, whole.high)
    assert abs(both.mean - whole.mean) <= 1e-6
    assert abs(both.deviation - whole.deviation) <= 1e-6


@given(st.lists(st.integers(0, 20), max_size=30), st.integers(1, 50))
def test_window_keeps_only_needed_readings(counts: list[int], size: int):
    window, total = Window(size), reading()
    for count in counts:
        total = window.add(reading(*[1.0] * count))
    assert total.count == sum(counts) or total.count >= size
    newest = counts[-1] if counts else 0
    assert newest <= total.count < size + max([*counts, 1])


def test_sizes_use_the_unit_of_the_rate(golden):
    golden(bw_text(reading(12.0, 12.0)))
    golden(bw_text(reading(6e6)))
    golden(bw_text(reading()))


def line(node: str, published: int, dropped: int, **drops: int) -> dict[str, object]:
    counts = {"published": published, "delivered": published - dropped, "dropped": dropped, "queued": 0}
    return {"node": node, **counts, "drops": drops}


def test_drops_are_those_since_the_last_time():
    flows = Flows()
    assert flows.since([line("/a", 10, 2, overflow=2)]) == []
    (flow,) = flows.since([line("/a", 15, 5, overflow=2, expired=3)])
    assert (flow.published, flow.delivered, flow.dropped, flow.drops) == (5, 2, 3, {"expired": 3})
    assert list(drop_lines([flow])) == ["\t/a dropped 3 of 5 (3 expired)"]
    (restarted,) = flows.since([line("/a", 4, 1, overflow=1)])
    assert (restarted.published, restarted.dropped) == (4, 1)


def test_subscriptions_of_one_node_are_distinguished():
    flows = Flows()
    flows.since([line("/a", 10, 0), line("/a", 10, 10, overflow=10)])
    first, second = flows.since([line("/a", 20, 0), line("/a", 20, 20, overflow=20)])
    assert (first.dropped, second.dropped) == (0, 10)


def test_json_names_its_units():
    answer = HZ.as_json("/x", reading(1.0), reading(1.0, 1.0), [])
    assert (answer["rate_hz"], answer["window"], answer["period_s"]["mean"]) == (10.0, 2, 0.1)
    assert BW.as_json("/x", reading(8.0), reading(8.0, seconds=2.0), [])["bytes_per_s"] == 4.0


def measured(
    count: int, *, publishers: tuple[str, ...] = (), arrived: dict[str, int] | None = None
) -> dict[str, object]:
    """Return the answer of a process that counted this many messages, ten a second."""

    def account(count: int) -> dict[str, object]:
        periods = spread(*[0.1] * (count - 1))
        return {
            "count": count,
            "periods_s": asdict(periods),
            "sizes": asdict(spread(*[8] * count)),
            "ages_s": asdict(spread()),
        }

    others = {node: account(number) for node, number in (arrived or {}).items()}
    return {"duration_s": 1.0, **account(count), "publishers": list(publishers), "arrived": others}


def test_parallel_publishers_add_up():
    read = Reading.of([measured(11, publishers=("/a",)), measured(11, publishers=("/b",)), measured(0)])
    assert (read.count, read.duration_s, read.sizes.total) == (22, 1.0, 176)
    assert abs(1 / read.periods.mean - 20) < 1e-9
    assert (read.periods.low, read.periods.high) == (0.1, 0.1)
    assert read.periods.deviation < 1e-6


def test_message_counts_once_for_many_processes():
    there = measured(11, publishers=("/a",))
    assert Reading.of([measured(0, arrived={"/a": 10}), there, measured(0, arrived={"/a": 11})]).count == 11


def test_outside_messages_count_once():
    outside = [measured(0, arrived={"/_busflow_cli_7": 5}), measured(0, arrived={"/_busflow_cli_7": 6}), measured(0)]
    assert Reading.of(outside).count == 6


@given(st.lists(st.integers(0, 20), max_size=5))
def test_rates_of_processes_beside_each_other_add_up(counts: list[int]):
    read = Reading.of([measured(count + 1, publishers=(f"/{n}",)) for n, count in enumerate(counts)] or [measured(0)])
    assert read.periods.count == sum(counts)
    if any(counts):
        longest = max(counts) * 0.1
        assert abs(read.periods.mean * sum(counts) - longest) < 1e-9
