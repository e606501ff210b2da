"""The node that publishes a recording.

Tests of `player.py`, `message_classes.py`, `ordered_messages.py` and `playback_clock.py`.
"""

import asyncio
import shlex

from mcap.writer import Writer

from busflow import Node, subscription
from busflow.errors import LaunchError
from busflow.interfaces.encoding.foreign import ForeignType
from busflow.interfaces.encoding.typesupport import OpaqueMessage, TypeSupport
from busflow.interfaces.message import Message, find_type
from busflow.msgs.rosgraph_msgs import Clock
from busflow.msgs.std_msgs import Float64, Int64, String
from busflow.msgs.std_srvs import Trigger
from busflow.recording.player import message_classes
from busflow.recording.player.player import Player
from busflow.testing import harness, virtual_time
from tests.vectors import cases

MS = 1_000_000
NUMBERS = [("/number", Int64(data=n), n * 100 * MS) for n in range(1, 6)]


class Listener(Node):
    """Keeps what it hears, and when."""

    async def start(self):
        self.heard = []

    @subscription("number")
    def hear(self, number: Int64) -> None:
        self.heard.append((number.data, round(self.clock.seconds(), 9)))


def played(path, seconds=10.0, **parameters):
    """What a listener hears of a recording, and the log."""

    @virtual_time
    async def main():
        async with harness(Player(file=path, **parameters), Listener) as lab:
            await lab.advance(seconds)
            return lab.node(Listener).heard, lab

    return main()


def test_messages_come_in_their_time(record, golden):
    heard, lab = played(record(NUMBERS))
    assert heard == [(1, 0.0), (2, 0.1), (3, 0.2), (4, 0.3), (5, 0.4)]
    golden("\n".join(line.event for line in lab.log))


def test_a_part_twice_as_fast_after_a_delay(record):
    """Case play/delay."""
    heard, _ = played(record(NUMBERS), rate=2.0, start_s=0.1, duration_s=0.2, delay_s=3.0)
    assert heard == [(2, 3.0), (3, 3.05), (4, 3.1)]


def test_negative_value_is_reported_and_ignored(record):
    """Case play/delay-negative."""
    heard, lab = played(record(NUMBERS), start_s=-5.0, delay_s=-1.0)
    assert len(heard) == 5
    assert [line.level for line in lab.log] == ["warning", "warning", "info"]


def test_it_begins_anew_until_it_is_stopped(record):
    heard, _ = played(record(NUMBERS), seconds=1.0, loop=True)
    assert heard == [(n % 5 + 1, round(0.1 * n - 0.1 * (n // 5), 9)) for n in range(len(heard))]
    assert len(heard) == 13


def test_an_empty_recording_does_not_loop(record, golden):
    heard, lab = played(record([]), loop=True)
    assert heard == []
    golden(lab.log[-1].event)


def test_topics_are_chosen_and_renamed(record):
    messages = [*NUMBERS, ("/other", String(data="x"), 1), ("/third", String(data="y"), 2)]

    @virtual_time
    async def main():
        chosen = {"topics": ["num*", "/other", "third"], "exclude": ["third"], "rename": {"/other": "/else"}}
        player = Player(file=record(messages), **chosen)
        async with harness(player) as lab:
            await lab.advance(10)
            assert set(lab.graph.bus.topics) == {"/number", "/else"}
            assert [each.data for each in lab.received("else")] == ["x"]

    main()


def test_an_unknown_topic_fails_before_the_start(record, golden):
    with golden.raises(LaunchError):
        played(record(NUMBERS), topics=["nmber"])


def test_hidden_topics_are_played_only_when_named(record):
    messages = [*NUMBERS, ("/_ticks", String(data="x"), 1), ("/a/_service_event", String(data="y"), 2)]
    _, lab = played(record(messages))
    assert set(lab.graph.bus.topics) == {"/number"}
    _, lab = played(record(messages), topics=["/_ticks"])
    assert "/_ticks" in lab.graph.bus.topics


def test_parameter_and_service_pause_and_resume_the_player(record):
    @virtual_time
    async def main():
        async with harness(Player(file=record(NUMBERS), paused=True), Listener) as lab:
            await lab.advance(5)
            heard = lab.node(Listener).heard
            assert heard == []
            assert (await lab.call(Trigger, "player/play_next")).success
            assert heard == [(1, 5.0)]
            lab.set_parameters(Player, paused=False)
            await lab.advance(0.15)
            assert heard[1:] == [(2, 5.1)]
            await lab.call(Trigger, "player/pause")
            assert lab.node(Player).parameters.paused
            assert (await lab.call(Trigger, "player/toggle_paused")).message == "playing"
            lab.set_parameters(Player, rate=0.5)
            await lab.advance(1)
            assert heard[2:] == [(3, 5.25), (4, 5.45), (5, 5.65)]
            assert not (await lab.call(Trigger, "player/play_next")).success

    main()


def test_clock_publishes_the_recordings_time(record):
    @virtual_time
    async def main():
        async with harness(Player(file=record(NUMBERS), clock_hz=20.0, rate=2.0)) as lab:
            await lab.advance(0.15)
            return [each.clock.sec * 1000 + each.clock.nanosec // MS for each in lab.received("clock", Clock)]

    assert main() == [200, 300, 400]


ODD_NAMES = ("/front-left/count", "sensor.count", "", "/a b/ü", "/x//y", "/x/", "/1x", "/ns/2-d")


def odd_names(path):
    """A recording with topics that have no name of ROS, one that has, and types with odd names."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "a test")
        names = dict.fromkeys((*ODD_NAMES, "/ok", "count"), "std_msgs/msg/Int64")
        for topic, name in (names | {"/one": "Odd", "/two": "std_msgs/Int64", "/dash": "my-pkg/msg/Odd"}).items():
            schema = writer.register_schema(name, "ros2msg", b"int64 data\n")
            writer.add_message(writer.register_channel(topic, "cdr", schema), 1, b"\0\1\0\0" + bytes(8), 1)
        writer.finish()
    return path


def test_topics_without_a_name_of_ros_are_left_out_with_a_remap_that_works(tmp_path):
    path = odd_names(tmp_path / "odd.mcap")
    _, lab = played(path)
    left_out = {line.values["topic"]: line.values["reason"] for line in lab.log if "left out" in line.event}
    assert set(left_out) == {*ODD_NAMES, "/dash"}
    assert [line.values["messages"] for line in lab.log if "played to the end" in line.event] == [4]
    advised = [shlex.split(why.partition("--remap ")[2]) for why in left_out.values() if "--remap" in why]
    rename = dict(each.split(":=") for (each,) in advised)
    assert set(rename) == {*ODD_NAMES} - {""}
    _, lab = played(path, rename=rename)
    assert [line.values["messages"] for line in lab.log if "played to the end" in line.event] == [4 + len(rename)]


def test_patterns_take_names_that_are_not_of_ros(tmp_path):
    path = odd_names(tmp_path / "odd.mcap")
    rename = {"/front-left/count": "/left", "/sensor.count": "/right"}
    for topics in (["/front-left/*", "sensor.count"], ["front-left/count", "/*.count"]):
        _, lab = played(path, topics=topics, rename=rename)
        assert [line.values["messages"] for line in lab.log if "played to the end" in line.event] == [2]
    _, lab = played(path, exclude=[each for each in ODD_NAMES if each])
    assert [line.values["topic"] for line in lab.log if "left out" in line.event] == ["", "/dash"]


def test_types_without_a_class_pass_as_they_are(tmp_path):
    definition = b"int32 a\nstring b\n"
    path = tmp_path / "foreign.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "a test")
        schema = writer.register_schema("my_pkg/msg/Thing", "ros2msg", definition)
        channel = writer.register_channel("/thing", "cdr", schema)
        payload = b"\0\1\0\0\3\0\0\0\2\0\0\0x\0\xee\xee"  # padded, as some writers do
        writer.add_message(channel, 0, payload, 0)
        writer.finish()

    @virtual_time
    async def main():
        async with harness(Player(file=path)) as lab:
            await lab.advance(1)
            (message,) = lab.received("thing")
            assert isinstance(message, OpaqueMessage)
            assert message.payload.tobytes() == payload
            assert isinstance(message.foreign, ForeignType)
            assert message.foreign.decode(payload) == {"a": 3, "b": "x"}

    main()


def test_the_users_class_decodes_the_recorded_type(record):
    from busflow import Message
    from busflow.interfaces.message import float64

    class Balance(Message, package="my_robot"):
        value: float64 = 0.0

    class Reader(Node):
        async def start(self):
            self.got = []

        @subscription("balance")
        def hear(self, balance: Balance) -> None:
            self.got.append(balance.value)

    @virtual_time
    async def main():
        async with harness(Player(file=record([("/balance", Balance(value=2.5), 0)])), Reader) as lab:
            await lab.advance(1)
            return lab.node(Reader).got

    assert main() == [2.5]


def test_message_classes_are_searched_once_for_all_topics(record, monkeypatch):
    looked = []
    below = message_classes._below
    monkeypatch.setattr(message_classes, "_below", lambda cls: looked.append(cls) or below(cls))
    played(record([(f"/number{n}", Int64(data=n), n * MS) for n in range(5)]))
    assert looked.count(Message) == 1


def test_unreadable_messages_are_reported_once_and_skipped(tmp_path, golden):
    path = tmp_path / "broken.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "a test")
        schema = writer.register_schema("std_msgs/msg/Int64", "ros2msg", b"int64 data\n")
        channel = writer.register_channel("/number", "cdr", schema)
        for n, payload in enumerate([b"\0\1\0\0" + b"\1" + bytes(7), b"\0\1\0\0\1", b"", b"\0\1\0\0\2" + bytes(7)]):
            writer.add_message(channel, n, payload, n)
        writer.finish()
    heard, lab = played(path)
    assert [value for value, _ in heard] == [1, 2]
    golden("\n".join(line.event for line in lab.log if line.level == "warning"))


def test_a_damaged_recording_plays_up_to_the_damage(record):
    path = record([("/number", Int64(data=n), n * MS) for n in range(5000)])
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    heard, lab = played(path)
    assert 0 < len(heard) < 5000
    assert [value for value, _ in heard] == list(range(len(heard)))
    warned = [dict(line.values)["reason"] for line in lab.log if line.level == "warning"]
    assert len(warned) == 1
    assert "cut off" in warned[0]
    assert lab.node(Player).incomplete


def test_a_burst_at_one_instant_is_delivered_whole(record):
    heard, lab = played(record([("/number", Int64(data=n), 0) for n in range(500)]))
    assert len(heard) == 500
    assert lab.ledger.dropped == 0


def test_it_is_a_plugin_of_a_launch_file(tmp_path, record):
    path = record([("/value", Float64(data=1.5), 0)])
    file = tmp_path / "play.yaml"
    file.write_text(
        f"name: play\nnodes:\n  player:\n    plugin: player\n    parameters:\n      file: {path}\n      rate: 2.0\n"
    )

    @virtual_time
    async def main():
        async with harness(file) as lab:
            await lab.advance(1)
            return [each.data for each in lab.received("value")]

    assert main() == [1.5]


def test_a_run_that_follows_the_clock_cannot_play(record, golden):
    path = record(NUMBERS)

    @virtual_time(follows=True)
    async def main():
        async with harness(Player(file=path), expect_failure=Player) as lab:
            await asyncio.sleep(0)
            return lab.graph.failures[0].summary

    golden(main())


def test_a_bag_that_ros_2_recorded_is_played():
    @virtual_time
    async def main():
        async with harness(Player(file="tests/cases/rosbag2/talker")) as lab:
            await lab.advance(10)
            assert [each.data for each in lab.received("topic", String)] == [f"Hello, world! {n}" for n in range(10)]
            assert len(lab.received("rosout")) == 10

    main()


def test_messages_recorded_by_ros_2_are_played_unchanged(tmp_path):
    path = tmp_path / "ros2.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "a test")
        recorded, channels = cases("g_cdr_recorded"), {}
        for number, case in enumerate(recorded):
            if case["topic"] not in channels:
                text = TypeSupport(find_type(case["type"])).definition.encode()
                schema = writer.register_schema(case["type"], "ros2msg", text)
                channels[case["topic"]] = writer.register_channel(case["topic"], "cdr", schema)
            writer.add_message(channels[case["topic"]], number, bytes.fromhex(case["cdr"]), number)
        writer.finish()

    @virtual_time
    async def main():
        async with harness(Player(file=path)) as lab:
            await lab.advance(1)
            for topic in channels:
                wanted = [bytes.fromhex(case["cdr"]) for case in recorded if case["topic"] == topic]
                played = lab.received(topic)
                support = TypeSupport(type(played[0]))
                assert [support.decode(each) for each in wanted] == played

    main()
