"""What a node of ROS 2 sends that is wrong costs a line in the log and a count, and nothing else."""

import asyncio
import struct
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from busflow import Node, launch, service, subscription
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.example_interfaces import AddTwoInts
from busflow.msgs.std_msgs import Float64MultiArray, Int64, String
from busflow.wire.mirror import zenoh_feed
from tests.ros2.rmw_node import RELIABLE, RmwNode
from tests.ros2.sessions import free_port, rmw_session, ros2_at, until, until_arrived

STRING, ARRAY, COUNT, ADD = map(TypeSupport, (String, Float64MultiArray, Int64, AddTwoInts))
RIGHT, LAST = (STRING.encode(String(data=text)) for text in ("right", "last"))


class Robot(Node):
    async def start(self) -> None:
        self.arrived: asyncio.Queue[Any] = asyncio.Queue()

    @subscription("/words")
    async def on_words(self, words: String) -> None:
        await self.arrived.put(words.data)

    @subscription("/numbers")
    async def on_numbers(self, numbers: Float64MultiArray) -> None:
        await self.arrived.put(len(numbers.data))

    @subscription("/count")
    async def on_count(self, count: Int64) -> None:
        await self.arrived.put(count.data)

    @service(AddTwoInts, "/add")
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)


@pytest.fixture
def neighbour() -> Iterator[Callable[[int], RmwNode]]:
    opened: list[Any] = []

    def open_session(port: int) -> RmwNode:
        opened.append(rmw_session(port))
        return RmwNode(opened[-1].__enter__(), "ros")

    yield open_session
    for each in opened:
        each.__exit__(None, None, None)


@pytest.mark.asyncio
async def test_malformed_messages_are_counted_and_logged_once(
    neighbour: Callable[[int], RmwNode], capsys: pytest.CaptureFixture[str]
):
    port = free_port()
    async with launch(ros2_at(port), Robot, inspect="bad") as graph:
        robot, ros = graph.node(Robot), neighbour(port)
        publish, publish_numbers = ros.publisher("/words", STRING), ros.publisher("/numbers", ARRAY)
        publish_count, count = ros.publisher("/count", COUNT), COUNT.encode(Int64(data=7))
        await until_arrived(lambda: publish(RIGHT), robot.arrived, "right")
        wrong = [b"", b"\0\1\0\0", RIGHT[:-3], b"\xff" * 40, b"\0\1\0\0" + struct.pack("<I", 0xFFFFFFFF) + b"x"]
        for payload in wrong:
            publish(payload)
        key = f"7/words/std_msgs::msg::dds_::String_/{STRING.type_hash}"
        ros.session.put(f"{key}/_buf_cpu", wrong[0])  # Lyrical's nodes send each other such ones
        absurd = b"\0\1\0\0" + struct.pack("<III", 0, 0, 0x7FFFFFFF) + b"\0" * 64
        numbers = ARRAY.encode(Float64MultiArray(data=[1.0, 2.0]))
        await until_arrived(lambda: (publish_numbers(absurd), publish_numbers(numbers)), robot.arrived, 2)
        await until_arrived(lambda: publish_count(count), robot.arrived, 7)
        publish_count(count + bytes(5_000_000))
        await until_arrived(lambda: publish_count(COUNT.encode(Int64(data=8))), robot.arrived, 8)
        where = f"7/add/example_interfaces::srv::dds_::AddTwoInts_/{ADD.type_hash}"
        async with asyncio.timeout(60):
            (refusal,) = await asyncio.to_thread(lambda: list(ros.session.get(where, payload=bytes(5_000_000))))
        assert "5,000,000 bytes" in refusal.err.payload.to_string()
        await until_arrived(lambda: publish(LAST), robot.arrived, "last")
        topics = graph.bus.topics
        assert topics["/count"].losses == {"malformed": 1}
        assert topics["/words"].losses == {"malformed": len(wrong)}
        assert topics["/numbers"].losses["malformed"] >= 1
    log = capsys.readouterr().err
    assert log.count("a message on /words ") == 1
    assert "std_msgs/msg/Int64: 5,000,012 bytes" in log
    assert "Traceback" not in log


@pytest.mark.asyncio
async def test_wrong_attachments_types_and_requests_harm_nothing(
    neighbour: Callable[[int], RmwNode], capsys: pytest.CaptureFixture[str]
):
    port = free_port()
    async with launch(ros2_at(port), Robot, inspect="bad") as graph:
        robot, ros = graph.node(Robot), neighbour(port)
        publish = ros.publisher("/words", STRING)
        await until_arrived(lambda: publish(RIGHT), robot.arrived, "right")
        key = f"7/words/std_msgs::msg::dds_::String_/{STRING.type_hash}"
        for attachment in (b"x" * 33, b"\0" * 32, b"", b"\x10" * 4000):
            ros.session.put(key, RIGHT, attachment=attachment)
        ros.end("MP", "/words", "std_msgs/msg/Int64", TypeSupport(Int64).type_hash, RELIABLE)
        ros.end("MP", "/words", "std_msgs/msg/String", "RIHS01_" + "1" * 64, RELIABLE)
        ros.end("MP", "/words", "std_msgs/msg/String", STRING.type_hash, "9:9:9,9:9,9:9,9:9,9,9")
        where = f"7/add/example_interfaces::srv::dds_::AddTwoInts_/{ADD.type_hash}"
        async with asyncio.timeout(60):
            (refusal,) = await asyncio.to_thread(lambda: list(ros.session.get(where, payload=b"\xff" * 7)))
            (nothing,) = await asyncio.to_thread(lambda: list(ros.session.get(where)))
        for each in (refusal, nothing):
            assert "MalformedMessage" in each.err.payload.to_string()
        await until_arrived(lambda: publish(LAST), robot.arrived, "last")
        request = TypeSupport(AddTwoInts.Request).encode(AddTwoInts.Request(a=1, b=2))
        async with asyncio.timeout(60):
            answer, *_ = await asyncio.to_thread(ros.call, "/add", ADD, request)
        assert TypeSupport(AddTwoInts.Response).decode(answer).sum == 3
        await until(lambda: graph.bus.topics["/words"].losses["malformed"] >= 3)
    log = capsys.readouterr().err
    assert ": it publishes std_msgs/msg/Int64" in log
    assert "another definition of std_msgs/msg/String" in log
    assert "Traceback" not in log


@pytest.mark.asyncio
async def test_escapes_in_names_reach_no_terminal(
    neighbour: Callable[[int], RmwNode], capsys: pytest.CaptureFixture[str]
):
    port = free_port()
    async with launch(ros2_at(port), Robot, inspect="bad") as graph:
        ros = neighbour(port)
        kept = [
            ros.token("9/9/NN/%/%/\x1b[2Jevil"),
            ros.token(
                f"9/10/MP/%/%/\x1b[31mred/%words/std_msgs::msg::dds_::Int64_/{TypeSupport(Int64).type_hash}/{RELIABLE}"
            ),
            ros.token("9/11/MP/%/%/n/%words"),
            ros.token("9/x/QQ/%/%/n"),
        ]
        ros.publisher("/words", STRING)
        await until(lambda: graph.bus.topics["/words"].publishers)
        log = capsys.readouterr().err
        assert "red in another" in log
        assert "\x1b" not in log
        del kept


@pytest.mark.asyncio
async def test_a_flood_leaves_the_run_answering(
    neighbour: Callable[[int], RmwNode],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    limits: Callable[..., None],
):
    port, log = free_port(), ""
    limits(busy_loop=0.001)  # any turn of the loop counts as long, and two messages as too many
    monkeypatch.setattr(zenoh_feed, "LARGEST", 0)
    async with launch(ros2_at(port), Robot, inspect="flood") as graph:
        robot, ros = graph.node(Robot), neighbour(port)
        publish = ros.publisher("/words", STRING)
        await until_arrived(lambda: publish(RIGHT), robot.arrived, "right")

        def flood() -> None:
            for number in range(2000):
                publish(RIGHT)
                ros.token(f"1/{number + 100}/MP/%/%/n{number}/%words/std_msgs::msg::dds_::Bool_/RIHS01_0/{RELIABLE}")

        flooding = asyncio.get_running_loop().run_in_executor(None, flood)
        turns = 0
        while not flooding.done():
            await asyncio.sleep(0.01)
            turns += 1
        await flooding
        topic = graph.bus.topics["/words"]
        counts: Counter[str] = topic.losses
        await until_arrived(lambda: publish(LAST), robot.arrived, "last")
        assert turns > 10, "the loop went on meanwhile"
        async with asyncio.timeout(60):
            while "messages on /words from other processes are dropped" not in (log := log + capsys.readouterr().err):
                await asyncio.to_thread(lambda: [publish(RIGHT) for _ in range(200)])
        await until_arrived(lambda: publish(LAST), robot.arrived, "last")
        assert set(counts) <= {"lost"}
    log += capsys.readouterr().err
    assert 1 <= log.count("not received on /words") <= 21
    assert log.count(" dropped: more than") == 1
