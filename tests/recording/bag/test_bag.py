"""A bag gives its messages in order, whole or damaged.

Tests of `bag.py`, `bag_file.py`, `completeness.py`, `facts.py`, `kept.py` and `series.py`.
"""

import pytest

from busflow.errors import BagError
from busflow.msgs.std_msgs import Float64
from busflow.recording.bag.bag import Bag
from busflow.recording.bag.completeness import shortfalls
from busflow.recording.bag.facts import RunOutcome, facts_of, ledger_of, summed
from busflow.recording.bag.series import Damage


def test_contents_are_known_without_reading_all(numbers):
    with Bag(numbers) as bag:
        (channel,) = bag.channels
        assert (channel.topic, channel.type_name, channel.count) == ("/number", "std_msgs/msg/Float64", 1000)
        assert (bag.start_ns, bag.end_ns) == (0, 9_990_000_000)
        assert bag.complete
        assert bag.damage is None


def test_entries_come_in_order_and_decode_both_ways(numbers):
    with Bag(numbers) as bag:
        entries = list(bag.entries())
    assert [entry.sequence for entry in entries] == list(range(1, 1001))
    entry = entries[500]
    assert entry.channel.plain(entry.payload) == {"data": 500.0}
    assert entry.channel.decode(entry.payload, Float64) == Float64(data=500.0)


def test_topics_and_a_stretch_of_time_are_picked(numbers):
    with Bag(numbers) as bag:
        assert [each.sequence for each in bag.entries(["number"], 5_000_000_000, 5_020_000_000)] == [501, 502, 503]
        assert list(bag.entries(["/other"])) == []


def test_a_truncated_file_serves_what_is_whole(numbers):
    whole = numbers.read_bytes()
    numbers.write_bytes(whole[: len(whole) // 2])
    with Bag(numbers) as bag:
        served = list(bag.entries())
        assert [each.sequence for each in served] == list(range(1, len(served) + 1))
        assert len(served) > 400
        assert bag.damage is not None
        assert bag.damage.served == len(served)
        assert not bag.complete
        assert bag.channels[0].count == len(served)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "the file is empty"),
        (b"hello, world", "it is no MCAP: it begins with 68 65 6c 6c"),
        (b"#ROSBAG V2.0\n", "it is a bag of ROS 1"),
        (b"\x89MCAP0\r\n", "the file ends without its footer"),
        (b"\x89MCA", "the file ends within its first eight bytes"),
    ],
)
def test_a_foreign_file_is_refused_in_one_line(tmp_path, content, said):
    path = tmp_path / "odd.mcap"
    path.write_bytes(content)
    with pytest.raises(BagError) as error:
        Bag(path)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_damage_counts_the_messages_before_it(count, golden):
    golden(str(Damage("a.mcap", 7, "it is cut off", count)))


@pytest.mark.parametrize(
    ("outcome", "gaps", "there", "codes"),
    [
        (RunOutcome({}, 5, 0, True), 0, 5, []),
        (None, 0, 5, ["unfinished"]),
        (RunOutcome({}, 5, 2, False), 0, 5, ["missed"]),
        (RunOutcome({}, 5, 0, False), 0, 5, ["unfinished"]),
        (RunOutcome({}, 5, 0, True), 1, 4, ["sequence", "ledger"]),
        (RunOutcome({}, 5, 0, False, "it was cut off"), 0, 4, ["unfinished", "unfinished"]),
    ],
)
def test_each_shortfall_has_its_code(outcome, gaps, there, codes):
    assert [each.code for each in shortfalls(outcome, unfinished=False, gaps=gaps, there=there)] == codes


def test_missing_ledger_makes_the_sum_incomplete():
    whole = RunOutcome({}, 5, 0, True)
    assert summed([whole, whole], {}) == RunOutcome({}, 10, 0, True)
    assert summed([whole, None], {}) == RunOutcome({}, None, 0, False)
    assert summed([None], {}) is None


@pytest.mark.parametrize("number", ["--1", "1-2", "-", "9" * 5000, "\u0663"])
def test_a_number_that_is_none_is_unknown(number):
    assert ledger_of({"recorded": number, "missed": number}).recorded is None
    assert facts_of({"seed": number}, None).seed is None
