"""A graph and those outside its process: what leaves it and when, what comes in and from whom, and what is kept out.

Tests of `inlet.py`, `arrival_buffer.py`, `outlet.py` and `remote_publishers.py`.
"""

import asyncio
import struct
import threading
import time
from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
import pytest
import zenoh
import zenoh.ext
from pydantic import Field

from busflow import (
    Durability,
    Message,
    Node,
    Overflow,
    PublisherMatched,
    QoS,
    Reliability,
    on_event,
    publisher,
    subscription,
)
from busflow.errors import MalformedMessage
from busflow.interfaces.encoding.foreign import ForeignType
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_msgs import Float64, Float64MultiArray, Int64, String
from busflow.wire.client.client import Peer, join
from busflow.wire.client.listener import Listener
from busflow.wire.mirror.outlet import Outlet
from busflow.wire.zenoh.keys import Attachment, Token, TokenKind, topic_key
from busflow.wire.zenoh.qos_text import to_text
from busflow.wire.zenoh.run_directory import find_run
from busflow.wire.zenoh.session import open_session
from tests.vectors import cases

pytestmark = pytest.mark.asyncio

PATIENCE_S = 60.0
LATCHED = QoS(durability=Durability.TRANSIENT_LOCAL, depth=3)


class Talker(Node):
    numbers = publisher(Int64, "numbers")
    kept = publisher(Int64, "kept", qos=LATCHED)
    images = publisher(Image, "images")
    words = publisher(String, "words")


class Reader(Node):
    """Keeps the numbers that it receives."""

    def __init__(self, **words) -> None:
        super().__init__(**words)
        self.received = []

    @subscription("numbers", qos=QoS(depth=100))
    def on_number(self, number: Int64) -> None:
        self.received.append(number.data)


class ImageReader(Node):
    shape = None

    @subscription("images")
    def on_image(self, image: Image) -> None:
        self.shape = (image.height, image.width, int(image.data.sum()))


class Mood(Message, package="test_outside"):
    """Message with values that no definition file of ROS 2 can state."""

    words: Mapping[str, int] = Field(default_factory=dict)
    note: str | None = None


class MoodNode(Node):
    moods = publisher(Mood, "moods")
    received = None

    @subscription("wishes")
    def on_wish(self, wish: Mood) -> None:
        self.received = wish


class Sensor(Message, package="my_robot"):
    """A type of the user's own."""

    level: float = 0.5
    tags: Sequence[str] = ()


class SensorNode(Node):
    sensors = publisher(Sensor, "sensors")
    received = None

    @subscription("sensors_in")
    def on_sensor(self, sensor: Sensor) -> None:
        self.received = sensor


class Stranger:
    """A node of ROS 2 as `rmw_zenoh` has it, made of plain Zenoh: nothing of busflow's is behind it."""

    def __init__(self, run, name="stranger"):
        self.session = open_session(run.directory)
        self.name, self._id, self._tokens = name, 0, []
        self.zid = str(self.session.info.zid())
        self._declare(f"@ros2_lv/0/{self.zid}/0/0/NN/%/%/{name}")

    def _declare(self, key):
        token = self.session.liveliness().declare_token(key)
        self._tokens.append(token)
        return token

    def endpoint(self, kind, topic, support, qos="::,10:,:,:,,", type_hash=None):
        self._id += 1
        hash_ = type_hash or support.type_hash
        package, _, name = support.name.split("/")
        place = f"%{topic.strip('/').replace('/', '%')}/{package}::msg::dds_::{name}_/{hash_}/{qos}"
        return self._declare(f"@ros2_lv/0/{self.zid}/0/{self._id}/{kind}/%/%/{self.name}/{place}")

    def key(self, topic, support):
        return topic_key(topic, support.name, support.type_hash)

    def close(self):
        self.session.close()


@pytest.fixture
def strangers():
    made = []

    def make(looked, **words):
        made.append(Stranger(looked.peer.run, **words))
        return made[-1]

    yield make
    for each in made:
        each.close()


def signed(sequence, gid=b"s" * 16):
    return struct.pack("<qqB", sequence, time.time_ns(), 16) + gid


def details(looked, topic):
    return looked.peer.graph().topics[topic].details


async def published(looked, topic, count):
    """Wait until so many messages were published on a topic of the graph."""
    await looked.until(lambda: looked.graph.bus.topics[topic].published >= count)


def warnings(capsys):
    return [
        line for line in capsys.readouterr().err.splitlines() if "warning" in line and "has no publisher" not in line
    ]


# What leaves.


async def test_messages_are_encoded_only_for_listeners(looked_at, monkeypatch):
    encoded = Counter()
    real = TypeSupport.encode.func

    def counting(support):
        encode = real(support)
        return lambda message: encoded.update([support.name]) or encode(message)

    patched = type(TypeSupport.encode)(counting)
    patched.__set_name__(TypeSupport, "encode")
    monkeypatch.setattr(TypeSupport, "encode", patched)
    async with looked_at(Talker, Reader) as looked:
        talker = looked.graph.node(Talker)
        talker.numbers.publish(Int64(data=1))
        talker.words.publish(String(data="a"))
        await looked.ask(looked.peer.graph)
        assert encoded == {}
        async with looked.listening("numbers") as received:
            talker.numbers.publish(Int64(data=2))
            assert (await received()).sequence > 1
        assert set(encoded) == {"std_msgs/msg/Int64"}
        await looked.until(lambda: not talker.numbers.is_received or talker.numbers._outlet is None)
        before = encoded.total()
        talker.numbers.publish(Int64(data=3))
        assert encoded.total() == before


async def test_listener_misses_nothing_after_the_answer(looked_at, monkeypatch):
    monkeypatch.setattr(Outlet, "_listen", lambda *_: None)  # as late as Zenoh can be with telling who listens
    async with looked_at(Talker) as looked:
        topic = await looked.ask(lambda: looked.peer.graph().topic("numbers"))
        type_ = await looked.ask(looked.peer.type, topic.type)
        with looked.peer.listen(topic, type_) as listener:
            await looked.ask(looked.peer.ask, "log", count=1, node=None, level=0)
            looked.graph.node(Talker).numbers.publish(Int64(data=7))
            assert (await looked.ask(listener.get, PATIENCE_S)).sequence == 1


class Watchful(Node):
    """Notes which subscriptions match its publisher."""

    numbers = publisher(Int64, "numbers")

    async def start(self) -> None:
        self.events: list[PublisherMatched] = []

    @on_event("numbers")
    def on_matched(self, event: PublisherMatched) -> None:
        self.events.append(event)


async def test_publisher_matches_subscriptions_of_other_processes(looked_at):
    async with looked_at(Watchful) as looked:
        events = looked.graph.node(Watchful).events
        session = await looked.ask(open_session, find_run("looked").directory)

        def subscribe(number: int, message_type: type[Message] = Int64, **qos: object) -> zenoh.LivelinessToken:
            type_ = TypeSupport(message_type)
            end = ("/numbers", type_.name, type_.type_hash, to_text(QoS(**qos), is_request=True))
            token = Token(str(session.info.zid()), 0, number, TokenKind.SUBSCRIPTION, "/", "elsewhere", *end)
            return session.liveliness().declare_token(str(token))

        others = [subscribe(1, Float64), subscribe(2, durability=Durability.TRANSIENT_LOCAL)]
        ends = [subscribe(3), subscribe(4)]
        await looked.until(lambda: len(events) == 2)
        ends[0].undeclare()
        await looked.until(lambda: len(events) == 3)
        counts = (1, 1, 1, 1), (2, 1, 2, 1), (2, 0, 1, -1)
        assert events == [PublisherMatched("/numbers", *each) for each in counts]
        for token in (*others, ends[1]):
            token.undeclare()
        await looked.ask(session.close)


async def test_inlet_of_the_same_process_causes_no_encoding(looked_at):
    async with looked_at(Talker, Reader) as looked:
        await looked.publish("/numbers", 5)
        await looked.until(lambda: looked.graph.node(Reader).received)
        assert looked.graph.node(Talker).numbers._outlet is None


async def test_a_late_listener_gets_history_then_new_messages(looked_at):
    async with looked_at(Talker) as looked:
        kept = looked.graph.node(Talker).kept
        for number in range(1, 6):
            kept.publish(Int64(data=number))
        type_ = await looked.ask(looked.peer.type, "std_msgs/msg/Int64")
        async with looked.listening("kept") as received:
            found = [await received() for _ in range(3)]
            for number in (6, 7):
                kept.publish(Int64(data=number))
            found += [await received() for _ in range(2)]
        numbers = [(each.sequence, type_.decode(each.payload)["data"]) for each in found]
        assert numbers == [(number, number) for number in range(3, 8)]


async def test_images_of_all_sizes_leave_in_order(looked_at):
    async with looked_at(Talker) as looked:
        images = looked.graph.node(Talker).images
        data = np.arange(6_220_800, dtype=np.uint32).astype(np.uint8)
        big = Image(height=1080, width=1920, encoding="rgb8", step=5760, data=data)
        small = Image(height=1, width=1, encoding="mono8", step=1, data=data[:1])
        found = []
        async with looked.listening("images") as received:
            for _ in range(2):
                images.publish(big)
                images.publish(small)
                found += [await received() for _ in range(2)]
        assert [each.sequence for each in found] == [1, 2, 3, 4]
        type_ = await looked.ask(looked.peer.type, "sensor_msgs/msg/Image")
        assert bytes(type_.decode(found[2].payload)["data"]) == data.tobytes()


async def test_a_publisher_ends_after_its_large_messages(looked_at):
    arrivals = []

    class Ends(Listener):
        """Notes that a message has arrived, and that a publisher of images has ended."""

        def put(self, sample):  # noqa: ARG002  # what arrives does not matter here
            arrivals.append("image")

        def note(self, sample):
            if sample.kind == zenoh.SampleKind.DELETE and Token.parse(str(sample.key_expr)).topic == "/images":
                arrivals.append("end")

    async with looked_at(Talker) as looked:
        images = looked.graph.advertise(Image, "images")
        topic, ends = await looked.ask(lambda: looked.peer.graph().topic("images")), Ends(depth=1)
        await looked.ask(looked.peer.type, topic.type)
        tokens = looked.peer.session.liveliness().declare_subscriber("@ros2_lv/**", ends.note)
        with looked.peer.listen(topic, listener=ends):
            await looked.ask(looked.peer.ask, "log", count=1, node=None, level=0)
            for _ in range(3):
                images.publish(Image(data=np.zeros(2_000_000, np.uint8)))
            images.close()
            await looked.until(lambda: len(arrivals) == 4)
        tokens.undeclare()
    assert arrivals.index("end") >= 2, "Zenoh itself lets it overtake what is left of the last one"


async def test_unencodable_message_is_logged_once_and_delivered_locally(looked_at, capsys):
    async with looked_at(Talker) as looked:
        words, here = looked.graph.node(Talker).words, looked.graph.subscribe(String, "words")
        async with looked.listening("words") as received:
            for text in ("\ud800", "\udfff", "fine"):
                words.publish(String.model_construct(data=text))  # which checks nothing
            assert b"fine" in (await received()).payload
        assert here.queued == 3
    assert len([line for line in warnings(capsys) if " cannot leave " in line]) == 1


async def test_message_too_large_is_unsent_and_delivered_here(looked_at, capsys, monkeypatch):
    """Case msg/oversize."""
    monkeypatch.setattr("busflow.wire.mirror.outlet.LARGEST", 1000)
    async with looked_at(Talker) as looked:
        words, here = looked.graph.node(Talker).words, looked.graph.subscribe(String, "words")
        async with looked.listening("words") as received:
            for text in ("long" * 500, "long" * 600, "short"):
                words.publish(String(data=text))
            assert b"short" in (await received()).payload
        assert here.queued == 3
        assert looked.graph.bus.topics["/words"].losses == {"unsent": 2}
    assert len([line for line in warnings(capsys) if "2,009 bytes" in line and "1,000" in line]) == 1


# What comes in.


async def test_a_departed_publishers_messages_stay_counted(looked_at):
    async with looked_at(Talker, Reader) as looked:
        topic = looked.graph.bus.topics["/numbers"]
        await looked.publish("/numbers", *range(100))
        await published(looked, "/numbers", 100)
        assert looked.graph.node(Reader).received == list(range(100))
        await looked.until(lambda: len(topic.publishers) == 1)
        (line,) = (each.statistics() for each in topic.subscriptions)
        assert (topic.published, line.delivered, line.dropped) == (100, 100, 0)
        assert [thread.name for thread in threading.enumerate() if "inlet" in thread.name] == []


async def test_a_blocked_process_does_not_stop_others_publishing(looked_at):
    async with looked_at(Talker, Reader) as looked:
        type_ = await looked.ask(looked.peer.type, "std_msgs/msg/Int64")
        before_s = looked.graph.clock.seconds()
        with looked.peer.advertise("/numbers", type_):  # in the loop's own thread, which is the one that is to answer
            assert looked.graph.clock.seconds() - before_s > 1


async def test_a_departure_is_noticed_under_load(looked_at):
    async with looked_at(Talker, Reader) as looked:
        type_ = await looked.ask(looked.peer.type, "std_msgs/msg/Int64")
        topic, stop = looked.graph.bus.topics["/numbers"], threading.Event()

        def go_on():
            with looked.peer.advertise("/numbers", type_) as speaker:
                while not stop.wait(0.005):
                    speaker.publish({"data": 1})

        going_on = asyncio.create_task(asyncio.to_thread(go_on))
        await looked.until(lambda: len(topic.publishers) == 2)
        await looked.publish("/numbers", 7)
        await looked.until(lambda: 7 in looked.graph.node(Reader).received)
        await looked.until(lambda: len(topic.publishers) == 2)
        stop.set()
        await going_on


async def test_leaving_publisher_does_not_block_the_loop(looked_at):
    """Zenoh tells of listeners, and has what is kept repeated, in one thread, which needs the interpreter's lock."""
    telling, ended, go_on, went_on = threading.Event(), threading.Event(), threading.Event(), []

    def tell(_status) -> None:
        telling.set()
        went_on.append(go_on.wait(8.0))  # less than Zenoh itself waits for its thread

    def let_go_on() -> None:
        ended.wait(0.5)
        go_on.set()

    async with looked_at(Talker()) as looked:
        session = looked.peer.session
        way = session.declare_publisher("test_outside/plain")
        way.declare_matching_listener(zenoh.handlers.Callback(tell, indirect=False))
        other = await asyncio.to_thread(lambda: Peer(find_run("looked")))
        listening = other.session.declare_subscriber("test_outside/plain", zenoh.handlers.RingChannel(1))
        assert await asyncio.to_thread(telling.wait, PATIENCE_S)
        helper = threading.Thread(target=let_go_on)
        helper.start()
        await looked.graph.stop()
        ended.set()
        await asyncio.to_thread(helper.join)
        listening.undeclare()
        await asyncio.to_thread(other.close)
    assert went_on[0]


async def test_each_subscription_receives_each_message_once(looked_at):
    async with looked_at(Talker, Reader, Reader(name="second")) as looked:
        type_ = await looked.ask(looked.peer.type, "std_msgs/msg/Int64")
        with looked.peer.advertise("/numbers", type_, settle=False) as speaker:
            await looked.ask(looked.peer.settle)
            speaker.publish({"data": 1})
            await published(looked, "/numbers", 1)
            late = looked.graph.subscribe(Int64, "numbers")
            speaker.publish({"data": 2})
            await published(looked, "/numbers", 2)
        assert [looked.graph.node(name).received for name in ("reader", "second")] == [[1, 2], [1, 2]]
        assert (await anext(late)).data == 2
        await looked.until(lambda: len(looked.graph.bus.topics["/numbers"].publishers) == 1)


async def test_outside_history_reaches_early_and_late_nodes(looked_at):
    class Late(Reader):
        @subscription("map", qos=LATCHED)
        def on_map(self, number: Int64) -> None:
            self.received.append(number.data)

    async with looked_at(Talker, Late) as looked:
        type_, peer, qos = await looked.ask(looked.peer.type, "std_msgs/msg/Int64"), looked.peer, to_text(LATCHED)
        with (
            peer.advertise("/map", type_, qos=qos, settle=False) as first,
            peer.advertise("/later", type_, qos=qos, settle=False) as second,
        ):
            for number in range(1, 6):
                first.publish({"data": number})
                second.publish({"data": number})
            await looked.until(lambda: looked.graph.node(Late).received[-3:] == [3, 4, 5])
            later = looked.graph.subscribe(Int64, "later", qos=LATCHED)
            assert [(await asyncio.wait_for(anext(later), PATIENCE_S)).data for _ in range(3)] == [3, 4, 5]


async def test_gaps_are_lost_until_they_arrive(looked_at, strangers):
    async with looked_at(Talker, Reader) as looked:
        stranger, support = strangers(looked), TypeSupport(Int64)
        stranger.endpoint("MP", "/numbers", support)
        await looked.until(lambda: len(looked.graph.bus.topics["/numbers"].publishers) == 2)
        for sequence in (3, 4, 7, 8, 6, 6, 2, 12):
            payload = support.encode(Int64(data=sequence))
            stranger.session.put(stranger.key("/numbers", support), payload, attachment=signed(sequence))
        await looked.until(lambda: looked.graph.node(Reader).received[-1:] == [12])
        assert looked.graph.node(Reader).received == [3, 4, 7, 8, 6, 2, 12], "late, but none twice"
        told = await looked.ask(details, looked, "/numbers")
        assert (told["published"], told["losses"]) == (7, {"lost": 4})


async def test_a_message_that_expired_in_transit_is_lost(looked_at, strangers):
    async with looked_at(Talker, Reader) as looked:
        stranger, support = strangers(looked), TypeSupport(Int64)
        stranger.endpoint("MP", "/numbers", support, to_text(QoS(lifespan=600.0)))
        await looked.until(lambda: len(looked.graph.bus.topics["/numbers"].publishers) == 2)
        for sequence, age_ns in ((1, 3600 * 10**9), (2, 0)):
            told = Attachment(sequence, time.time_ns() - age_ns, b"s" * 16).encode()
            stranger.session.put(
                stranger.key("/numbers", support), support.encode(Int64(data=sequence)), attachment=told
            )
        await published(looked, "/numbers", 1)
        await looked.until(lambda: looked.graph.node(Reader).received)
        assert looked.graph.node(Reader).received == [2]
        assert (await looked.ask(details, looked, "/numbers"))["losses"] == {"expired": 1}


async def test_ros_2_node_is_a_full_peer(looked_at, strangers):
    async with looked_at(Talker, Reader) as looked:
        stranger, support = strangers(looked, name="turtle"), TypeSupport(Int64)
        got = []
        sub = stranger.session.declare_subscriber(
            stranger.key("/numbers", support), zenoh.handlers.Callback(got.append, indirect=False)
        )
        stranger.endpoint("MS", "/numbers", support)
        stranger.endpoint("MP", "/numbers", support)
        talker = looked.graph.node(Talker)
        await looked.until(lambda: talker.numbers._outlet)
        talker.numbers.publish(Int64(data=7))
        await looked.until(lambda: got)
        assert got[0].payload.to_bytes() == bytes.fromhex("00010000") + struct.pack("<q", 7)
        sequence, _, length = struct.unpack_from("<qqB", got[0].attachment.to_bytes())
        assert (sequence, length, len(got[0].attachment.to_bytes())) == (1, 16, 33)
        await looked.until(lambda: len(looked.graph.bus.topics["/numbers"].publishers) == 2)
        stranger.session.put(stranger.key("/numbers", support), support.encode(Int64(data=8)), attachment=signed(1))
        await looked.until(lambda: looked.graph.node(Reader).received == [7, 8])

        def graph():
            everything = stranger.session.liveliness().get("@ros2_lv/0/**", timeout=PATIENCE_S)
            return [Token.parse(str(reply.ok.key_expr)) for reply in everything]

        tokens = await looked.ask(graph)
        ours = {(each.kind, each.node_name, each.topic) for each in tokens if each.session != stranger.zid}
        assert {
            (TokenKind.NODE, "/talker", ""),
            (TokenKind.PUBLISHER, "/talker", "/kept"),
            (TokenKind.SUBSCRIPTION, "/reader", "/numbers"),
        } <= ours
        seen = await looked.ask(lambda: looked.peer.graph().topic("numbers"))
        assert "/turtle" in {end.node for end in seen.publishers} & {end.node for end in seen.subscriptions}
        sub.undeclare()


async def test_a_late_node_receives_ros_2_latched_messages(looked_at, strangers):
    async with looked_at(Talker) as looked:
        stranger, support = strangers(looked), TypeSupport(Int64)
        keeping = zenoh.ext.declare_advanced_publisher(
            stranger.session,
            stranger.key("/map", support),
            cache=zenoh.ext.CacheConfig(max_samples=7),
            publisher_detection=True,
            sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=0.5),
        )
        stranger.endpoint("MP", "/map", support, ":1:,7:,:,:,,")
        for number in (1, 2):
            keeping.put(support.encode(Int64(data=number)), attachment=signed(number))
        late = looked.graph.subscribe(Int64, "map", qos=LATCHED)
        assert [(await asyncio.wait_for(anext(late), PATIENCE_S)).data for _ in range(2)] == [1, 2]
        keeping.undeclare()


async def test_a_blocking_queue_loses_no_outside_message(looked_at):
    class Slow(Node):
        def __init__(self):
            super().__init__()
            self.received = []

        @subscription("numbers", qos=QoS(depth=2, overflow=Overflow.BLOCK))
        async def on_number(self, number: Int64) -> None:
            self.received.append(number.data)
            await asyncio.sleep(0.001)

    async with looked_at(Slow) as looked:
        await looked.publish("/numbers", *range(200))
        await looked.until(lambda: len(looked.graph.node(Slow).received) == 200)
        assert looked.graph.node(Slow).received == list(range(200))
        assert await looked.ask(lambda: details(looked, "/numbers")["losses"]) == {}


async def test_full_blocking_queue_refuses_and_logs_once(looked_at, capsys):
    async with looked_at(Talker) as looked:
        stuck = looked.graph.subscribe(Int64, "stuck", qos=QoS(depth=1, overflow=Overflow.BLOCK, block_timeout_s=0.01))
        await looked.publish("/stuck", *range(5))
        async with asyncio.timeout(PATIENCE_S):
            while (await looked.ask(details, looked, "/stuck"))["losses"].get("refused") != 4:
                pass
        assert stuck.queued == 1
    assert len([line for line in warnings(capsys) if "is refused" in line]) == 1


async def test_six_megabytes_arrive_although_their_client_leaves(looked_at):
    async with looked_at(ImageReader) as looked:
        type_ = await looked.ask(looked.peer.type, "sensor_msgs/msg/Image")
        data = np.ones(6_220_800, np.uint8)
        payload = TypeSupport(Image).encode(Image(height=1080, width=1920, encoding="rgb8", step=5760, data=data))

        def speak():
            with join(looked.peer.run.name) as client, client.advertise("/images", type_) as speaker:
                speaker.publish_bytes(payload)

        await looked.ask(speak)
        await looked.until(lambda: looked.graph.node(ImageReader).shape)
        assert looked.graph.node(ImageReader).shape == (1080, 1920, 6_220_800)


@pytest.mark.parametrize(
    ("node", "out", "into", "message", "plain"),
    [
        (MoodNode, "moods", "/wishes", Mood(words={"a": 1}, note=None), {"words": {"a": 1}, "note": None}),
        (SensorNode, "sensors", "/sensors_in", Sensor(level=0.25, tags=("x",)), {"level": 0.25, "tags": ("x",)}),
    ],
)
async def test_a_users_types_cross_without_a_peers_class(looked_at, node, out, into, message, plain):
    async with looked_at(node) as looked:
        type_ = await looked.ask(lambda: looked.peer.type(looked.peer.graph().topic(out).type))
        async with looked.listening(out) as received:
            getattr(looked.graph.node(node), out).publish(message)
            assert type_.decode((await received()).payload) == plain
        await looked.publish(into, plain, type_name=type_.name)
        assert await looked.until(lambda: looked.graph.node(node).received) == message


# What is kept out.


async def test_unfit_publisher_is_logged_once_and_not_received(looked_at, strangers, capsys):
    async with looked_at(Talker, Reader) as looked:
        stranger, support = strangers(looked), TypeSupport(Int64)
        weak, before = to_text(QoS(reliability=Reliability.BEST_EFFORT)), looked.graph.log.counts["warning"]
        stranger.endpoint("MP", "/numbers", support, weak)
        stranger.endpoint("MP", "/numbers", TypeSupport(Float64))
        stranger.endpoint("MP", "/numbers", support, type_hash="RIHS01_" + "0" * 64)
        stranger.endpoint("MP", "/numbers", support, "no QoS at all")
        stranger.session.put(stranger.key("/numbers", support), support.encode(Int64(data=1)), attachment=signed(1))
        await looked.until(lambda: looked.graph.log.counts["warning"] >= before + 4)
        late = looked.graph.subscribe(Int64, "numbers")
        await looked.ask(looked.peer.graph)
        assert len(looked.graph.bus.topics["/numbers"].publishers) == 1
        assert (looked.graph.node(Reader).received, late.queued) == ([], 0)
    told = warnings(capsys)
    assert len(told) == 4, told
    for words in (
        "best_effort is offered",
        "publishes std_msgs/msg/Float64",
        "another definition",
        "is no QoS",
    ):
        assert len([line for line in told if words in line]) == 1, told


async def test_an_incompatible_publishers_messages_count_as_its_own(looked_at):
    async with looked_at(Talker, Reader) as looked:
        type_ = await looked.ask(looked.peer.type, "std_msgs/msg/Int64")
        weak = to_text(QoS(reliability=Reliability.BEST_EFFORT))

        def speak():
            with (
                looked.peer.advertise("/numbers", type_) as good,
                looked.peer.advertise("/numbers", type_, qos=weak) as bad,
            ):
                for number in range(5):
                    good.publish({"data": number})
                    bad.publish({"data": 100})
            return True

        await looked.ask(speak)
        await published(looked, "/numbers", 5)
        async with asyncio.timeout(PATIENCE_S):
            while (await looked.ask(details, looked, "/numbers"))["losses"] != {"incompatible": 5}:
                pass
        assert looked.graph.node(Reader).received == list(range(5))


async def test_an_incompatible_outside_publisher_is_only_a_warning(looked_at, capsys):
    async with looked_at(Talker, Reader) as looked:
        type_ = await looked.ask(looked.peer.type, "std_msgs/msg/Int64")
        topic = looked.graph.bus.topics["/numbers"]
        with looked.peer.advertise("/numbers", type_, settle=False):
            await looked.until(lambda: len(topic.publishers) == 2)
            looked.graph.node(Talker).numbers.close()
            strict = looked.graph.subscribe(Int64, "numbers", qos=LATCHED)
            await looked.until(lambda: topic.publishers == [])
            strict.close()
            await looked.until(lambda: len(topic.publishers) == 1)
    assert len([line for line in warnings(capsys) if "not received on /numbers" in line]) == 1


HOSTILE_QOS = [
    "::,99999999999999999999999:,:,:,,",
    "::,-5:,:,:,,",
    "::,10:99999999999999999999999999999999,1:,:,,",
    "::,10:,:,:7,,",
    "3:3:3,1:,:,:4,,",
]


async def test_a_token_with_any_qos_harms_nothing(looked_at, strangers):
    async with looked_at(Talker, Reader) as looked:
        stranger, support = strangers(looked), TypeSupport(Int64)
        for number, qos in enumerate(HOSTILE_QOS, 1):
            stranger.endpoint("MP", "/numbers", support, qos)
            await looked.ask(looked.peer.graph)
            looked.graph.node(Talker).numbers.publish(Int64(data=number))
            await looked.until(lambda number=number: looked.graph.node(Reader).received == [*range(1, number + 1)])


TYPES = {cls: TypeSupport(cls).name for cls in (String, Float64, Float64MultiArray, Image)}


@pytest.mark.parametrize("cls", TYPES, ids=TYPES.get)
async def test_malformed_bytes_are_counted_and_logged_once(looked_at, strangers, capsys, cls):
    class Hears(Node):
        def __init__(self):
            super().__init__()
            self.received = 0

        def declare(self):
            self.create_subscription(cls, "x", self.on_message)

        def on_message(self, _message) -> None:
            self.received += 1

    support = TypeSupport(cls)
    hostile = [bytes.fromhex(case["cdr"]) for case in cases("g_cdr_malformed")]
    rng = np.random.default_rng(7)
    whole = support.encode(cls())
    for _ in range(300):
        data = bytearray(whole)
        for place in rng.integers(0, len(data), 3):
            data[place] = int(rng.integers(0, 256))
        hostile.append(bytes(data[: int(rng.integers(0, len(data) + 1))]))
    refused = 0
    for payload in hostile:
        try:
            support.decode(payload)
        except MalformedMessage:
            refused += 1
    async with looked_at(Hears) as looked:
        stranger = strangers(looked)
        stranger.endpoint("MP", "/x", support)
        topic = looked.graph.bus.topics["/x"]
        await looked.until(lambda: topic.publishers)
        for number, payload in enumerate(hostile, start=1):
            await asyncio.to_thread(
                stranger.session.put, stranger.key("/x", support), payload, attachment=signed(number)
            )
            while (
                number % 10 == 0
                and (await looked.ask(details, looked, "/x"))["losses"].get("malformed", 0) + (topic.published) < number
            ):
                pass  # the ring for images is a short one
        await published(looked, "/x", len(hostile) - refused)
        stranger.session.put(stranger.key("/x", support), whole, attachment=b"no attachment of ours")
        stranger.session.put(stranger.key("/x", support), whole, attachment=signed(len(hostile) + 1))
        await published(looked, "/x", len(hostile) - refused + 1)
        told = await looked.ask(details, looked, "/x")
        assert told["losses"] == {"malformed": refused + 1}
    assert len([line for line in warnings(capsys) if "is malformed" in line]) == 1


async def test_malformed_tokens_are_ignored(looked_at, strangers):
    async with looked_at(Talker) as looked:
        stranger = strangers(looked)
        for key in ("@ros2_lv/0/x", "@ros2_lv/0/x/y/z/MP/%/%/n/%t/T/h/q", "@ros2_lv/0/é/1/1/NN/%/%/n"):
            stranger._declare(key)
        assert "/talker" in (await looked.ask(looked.peer.graph)).nodes


async def test_a_description_with_a_false_hash_is_refused():
    support = TypeSupport(Int64)
    with pytest.raises(MalformedMessage, match="hash"):
        ForeignType(support.name, "RIHS01_" + "0" * 64, support.description)
    assert Attachment.decode(signed(3)).sequence == 3
