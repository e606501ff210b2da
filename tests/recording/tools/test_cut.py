"""A part of a recording: what comes first, and what it says of itself.

Tests of `cut.py`, and of kept messages.
"""

import json
from itertools import product

import pytest

from busflow import Node, QoS, subscription, timer
from busflow.errors import IncompleteRecording
from busflow.msgs.std_msgs import Int64, String
from busflow.recording.bag.bag import Bag
from busflow.recording.mcap.contents import Contents
from busflow.recording.player.player import Player
from busflow.recording.tools.convert import TargetFormat, convert
from busflow.recording.tools.recover import recover
from busflow.recording.tools.verify import FindingKind, examine
from busflow.testing import harness, replay, virtual_time

LATCHED = QoS(depth=2, durability="transient_local")
S = 1_000_000_000


class Left(Node):
    """Publishes a description, a state every second and a count."""

    def declare(self):
        self.kept = self.create_publisher(String, "/static", qos=LATCHED)
        self.state = self.create_publisher(Int64, "/state", qos=LATCHED)
        self.count = self.create_publisher(Int64, "/count")
        self.n = 0

    async def start(self):
        self.kept.publish(String(data="left"))

    @timer(0.1)
    def tick(self):
        self.n += 1
        self.count.publish(Int64(data=self.n))
        if self.n % 10 == 0:
            self.state.publish(Int64(data=self.n))


class Right(Node):
    """Publishes its description over and over."""

    def declare(self):
        self.kept = self.create_publisher(String, "/static", qos=LATCHED)

    @timer(0.25)
    def tick(self):
        self.kept.publish(String(data="right"))


class Doubler(Node):
    """Keeps no state."""

    def declare(self):
        self.out = self.create_publisher(Int64, "/double")

    @subscription("/count")
    def hear(self, number: Int64) -> None:
        self.out.publish(Int64(data=2 * number.data))


@pytest.fixture
def run(tmp_path):
    """A recording of five seconds."""

    @virtual_time
    async def main():
        async with harness(Left, Right, Doubler, record=str(tmp_path / "run.mcap")) as lab:
            await lab.advance(5)

    main()
    return tmp_path / "run.mcap"


def cut(source, target, form="mcap", *, start=None, end=None, topics=None):
    """A part of a recording, by times in seconds; what it holds at its beginning."""
    with Bag(source) as bag:
        first = bag.start_ns
        times = tuple(None if at is None else first + round(at * S) for at in (start, end))
        channels = None if topics is None else [each for each in bag.channels if each.topic in topics]
        convert(bag, target, TargetFormat(form), json.dumps, channels=channels, times=times)
    return target


def head(path):
    with Bag(path) as bag:
        begin = bag.start_ns
        return [
            (each.channel.topic, each.channel.plain(each.payload)["data"])
            for each in bag.entries()
            if not each.sequence and each.log_time_ns == begin and each.publish_time_ns < begin
        ]


def test_kept_messages_come_first(run, tmp_path):
    """Of one publisher as many as its depth, of several each different one."""
    made = cut(run, tmp_path / "part.mcap", start=3.55)
    assert head(made) == [("/static", "left"), ("/state", 20), ("/state", 30), ("/static", "right")]
    again = cut(made, tmp_path / "again.mcap", start=1)
    assert head(again) == [("/static", "left"), ("/state", 30), ("/state", 40), ("/static", "right")]
    for path in (made, again):
        with Bag(path) as bag:
            assert examine(bag).findings == []
            assert bag.complete


@pytest.mark.parametrize("form", TargetFormat)
def test_every_form_begins_with_kept_messages(run, tmp_path, form):
    with Bag(run) as bag:
        later = sum(1 for _ in bag.entries(start_ns=bag.start_ns + round(3.55 * S)))
        done = convert(bag, tmp_path / "part", form, json.dumps, times=(bag.start_ns + round(3.55 * S), None))
        assert done.messages == later + 4


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"start": 2}, "a part of run.mcap, from 2 s"),
        ({"end": 4}, "a part of run.mcap, to 4 s"),
        ({"start": 2, "end": 2.5}, "a part of run.mcap, from 2 s to 2.5 s"),
        (
            {"start": 1, "topics": ["/count", "/static"]},
            "a part of run.mcap, from 1 s, without /_ticks, /double, /state",
        ),
        ({"topics": ["/double"]}, "a part of run.mcap, without /_ticks, /count, /state, /static"),
        ({"start": 0, "end": 60}, None),
    ],
)
@pytest.mark.parametrize("form", ["mcap", "ros2bag"])
def test_a_part_is_complete_and_says_of_which(run, tmp_path, form, how, said):
    made = cut(run, tmp_path / "part", form, **how)
    with Bag(made) as part:
        assert (part.complete, part.incomplete) == (True, ())
        assert examine(part).findings == []
        cuts = [each.cut for each in part.series]
        assert [None if each is None else str(each) for each in cuts] == [said]
    if form == "mcap":
        recover(made, tmp_path / "saved.mcap", lambda: None)
        with Bag(tmp_path / "saved.mcap") as saved:
            assert (saved.complete, [each.cut for each in saved.series]) == (True, cuts)


def test_a_part_of_a_damaged_recording_is_incomplete(run, tmp_path):
    run.write_bytes(run.read_bytes()[: run.stat().st_size // 2])
    with Bag(cut(run, tmp_path / "part.mcap", start=1)) as part:
        assert not part.complete


def ends_of(path):
    """The file without its footer, without its summary, and without its ledger either."""
    data = path.read_bytes()
    with Contents(path) as contents:
        found = [each for each in contents if each.within is None]
    at = {type(each.record).__name__: each.offset for each in found}
    ledger = next(each.offset for each in found if getattr(each.record, "name", "") == "busflow.ledger")
    summary = next(each.offset for each in found if each.offset > at["DataEnd"])
    return [data[:end] for end in (at["Footer"], summary, at["DataEnd"], ledger)]


@pytest.mark.parametrize("form", ["mcap", "ros2bag"])
def test_a_recording_without_its_end_is_incomplete_in_each_conversion(run, tmp_path, form):
    hows = ({}, {"start": 2}, {"end": 2}, {"start": 1, "end": 2}, {"topics": ["/count"]})
    for number, (content, how) in enumerate(product(ends_of(run), hows)):
        run.write_bytes(content)
        with Bag(cut(run, tmp_path / str(number), form, **how)) as made:
            assert not made.complete
            assert {each.kind for each in examine(made).findings} == {FindingKind.INCOMPLETE}


def test_a_split_recording_with_a_part_cut_off_is_incomplete_in_each_conversion(tmp_path):
    @virtual_time
    async def main():
        record = {"to": str(tmp_path / "run"), "split": {"duration": "1s"}}
        async with harness(Left, Right, Doubler, record=record) as lab:
            await lab.advance(3.5)

    main()
    last = max((tmp_path / "run").glob("*.mcap"))
    last.write_bytes(ends_of(last)[0])
    for number, how in enumerate(({}, {"start": 2}, {"end": 2}, {"topics": ["/count"]})):
        with Bag(cut(tmp_path / "run", tmp_path / f"{number}.mcap", **how)) as made:
            assert not made.complete


def test_a_replay_of_a_part_says_what_it_lacks(run, tmp_path):
    later = replay(cut(run, tmp_path / "later.mcap", start=2), Doubler)
    later.assert_same()
    assert "from 2 s" in "\n".join(later.notes)
    assert replay(cut(run, tmp_path / "front.mcap", end=2), Left, Right, Doubler).same
    picked = cut(run, tmp_path / "picked.mcap", topics=["/double", "/_ticks"])
    with pytest.raises(IncompleteRecording, match="needs /count; convert it with"):
        replay(picked, Doubler)
    assert replay(cut(run, tmp_path / "enough.mcap", topics=["/double", "/count"]), Doubler).same


def test_playing_from_a_moment_begins_with_kept_messages(run):
    """Also over and over, and of the chosen topics alone."""

    class Late(Node):
        def declare(self):
            self.heard = []
            for topic, cls in (("/static", String), ("/state", Int64)):
                self.create_subscription(cls, topic, self.hear, qos=QoS(depth=50, durability="transient_local"))

        def hear(self, message):
            self.heard.append(message.data)

    def heard(seconds, **asked):
        @virtual_time
        async def main():
            async with harness(Player(file=run, start_s=3.55, **asked), Late) as lab:
                await lab.advance(seconds)
                return lab.node(Late).heard

        return main()

    first = ["left", 20, 30, "right"]
    assert heard(0.1) == first
    assert heard(0.3, duration_s=0.1, loop=True)[:12] == [*first, *first, *first]
    assert heard(0.1, topics=["/state"]) == [20, 30]
    assert heard(0.1, topics=["/count"]) == []
