"""`/rosout`: the log as a topic, for whoever receives it, and for nobody else."""

from busflow import Node, publisher, subscription
from busflow.bus.endpoint import ROSOUT
from busflow.bus.qos import QoS
from busflow.launchfile.model.description import LaunchDescription
from busflow.launchfile.model.ros2 import Ros2Spec
from busflow.log import LogRecord
from busflow.msgs.rcl_interfaces import Log
from busflow.msgs.std_msgs import Int64
from busflow.runner.rosout import log_message
from busflow.testing import harness, virtual_time


class Talker(Node):
    """Logs what it is told to."""

    def say(self, text: str, **values: object) -> None:
        self.log.warning(text, **values)


class Listener(Node):
    """Hears the log, and logs what it hears, which is not to go round for ever."""

    def __init__(self):
        super().__init__()
        self.received: list[Log] = []

    @subscription(ROSOUT)
    def on_line(self, line: Log) -> None:
        self.received.append(line)
        self.log.info("heard a line")


@virtual_time
async def test_node_receives_only_lines_of_other_nodes():
    async with harness(Talker(), Listener()) as robot:
        robot.node(Talker).say("slow", load=0.9)
        await robot.settle()
        (line,) = robot.node(Listener).received
    assert (line.name, line.level, line.msg) == ("/talker", Log.WARN, "slow load=0.9")
    assert line.stamp.sec > 0


@virtual_time
async def test_rosout_does_not_exist_without_a_subscription():
    async with harness(Talker()) as robot:
        robot.node(Talker).say("alone")
        assert ROSOUT not in robot.graph.bus.topics
        robot.graph.rosout.announce()
        robot.node(Talker).say("still alone")
        assert robot.graph.bus.topics[ROSOUT].published == 0
        assert [topic.name for topic in robot.graph.report().topics] == []


@virtual_time
async def test_only_latched_late_subscription_receives_earlier_lines():
    async with harness(Talker()) as robot:
        robot.node(Talker).say("before")
        first = robot.graph.subscribe(Log, ROSOUT, qos=QoS(durability="transient_local"))
        robot.node(Talker).say("after")
        second = robot.graph.subscribe(Log, ROSOUT, qos=QoS(durability="transient_local"))
        await robot.settle()
        assert [first.latest and first.latest.msg, second.latest and second.latest.msg] == ["after", "after"]


@virtual_time
async def test_full_blocking_queue_does_not_fail_logging():
    async with harness(Talker()) as robot:
        waiting = robot.graph.subscribe(Log, ROSOUT, qos=QoS(depth=1, overflow="block"))
        for _ in range(3):
            robot.node(Talker).say("on and on")
        assert robot.graph.rosout.refused == 2
        assert waiting.latest is not None


class Wrong(Node):
    """Takes the log for something else."""

    numbers = publisher(Int64, "numbers")

    @subscription(ROSOUT)
    def on_number(self, number: Int64) -> None:
        pass


@virtual_time
async def test_rosout_of_another_type_is_warned_about():
    async with harness(Wrong(), Talker()) as robot:
        robot.node(Talker).say("unheard")
        events = [record.event for record in robot.log]
    assert any("not published on /rosout" in text for text in events)


def test_control_characters_in_lines_are_escaped():
    record = LogRecord(0, "error", "/n", "a\x1b[31m\nb", {"\x1b": "\ud800"})
    assert log_message(record).msg == "a\\x1b[31m\nb \\x1b=\\ud800"


@virtual_time
async def test_nodes_of_ros2_are_offered_what_they_expect():
    """`rcl_qos_profile_rosout_default` in `logging_rosout.h` of ros2/rcl 9.2: 1000 deep, transient_local, for 10 s."""
    async with harness(LaunchDescription("robot", (), ros2=Ros2Spec()), Talker) as robot:
        robot.graph.rosout.announce()
        robot.node(Talker).say("nobody receives this yet")
        late = robot.graph.subscribe(Log, ROSOUT, qos=QoS(durability="transient_local"))
        await robot.settle()
        assert late.latest is not None
        assert late.latest.msg == "nobody receives this yet"
        await robot.advance(11)
        later = robot.graph.subscribe(Log, ROSOUT, qos=QoS(durability="transient_local"))
        await robot.settle()
        assert later.latest is None
