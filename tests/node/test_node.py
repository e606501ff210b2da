"""The promises to the author of a node: parameters, names, generators, tasks, and endpoints made while it runs.

Tests of `node.py`, `context.py`, `endpoints.py`, `lifetime.py` and `signatures.py`.
"""

from __future__ import annotations

import asyncio
import re
import threading
from typing import TYPE_CHECKING

import pytest

from busflow import Graph, Message, Node, NodeFailed, Parameters, QoS, launch, publisher, subscription
from busflow.clock import SimClock
from busflow.errors import (
    IncompatibleQoS,
    IncompatibleType,
    InvalidDeclaration,
    InvalidName,
    InvalidParameter,
    LaunchError,
    NotRunning,
)
from busflow.msgs.std_msgs import Int64, String
from busflow.node import signatures
from busflow.node.node import parameters_class
from busflow.testing import virtual_time

if TYPE_CHECKING:
    from busflow.node.parameters import Parameters as Unseen


class Rates(Parameters):
    rate_hz: float = 10
    label: str = "fast"


class Rated(Node):
    parameters: Rates


def graph_of(*what, seed=None):
    return Graph(what, clock=SimClock(), seed=seed)


async def settle():
    await asyncio.get_running_loop().settle()


# Made by hand.


def test_a_node_accepts_parameters_by_value_or_whole():
    assert Rated().parameters == Rates()
    assert Rated(rate_hz=50).parameters.rate_hz == 50
    assert Rated(Rates(label="slow"), name="left").parameters.label == "slow"
    assert Rated(Rates(), name="left").name == "left"


def test_all_faults_of_parameters_come_at_once():
    with pytest.raises(InvalidParameter) as caught:
        Rated(rate_hz="50", lable="x")
    assert {fault.path for fault in caught.value.faults} == {("rate_hz",), ("lable",)}


def test_a_node_takes_its_parameters_object_or_values(golden):
    class Others(Parameters):
        rate_hz: float = 10

    for make in (lambda: Rated(Rates(), rate_hz=1), lambda: Rated(Others()), lambda: Rated({"rate_hz": 1})):
        with golden.raises(InvalidDeclaration):
            make()


def test_a_node_without_an_annotation_takes_no_parameters():
    class Plain(Node):
        pass

    assert Plain().parameters == Parameters()
    with pytest.raises(InvalidParameter, match="rate_hz"):
        Plain(rate_hz=1)


def test_a_subclass_inherits_or_replaces_the_parameters_class():
    class Derived(Rated):
        pass

    class More(Rates):
        gain: float = 1

    class Anew(Rated):
        parameters: More

    assert parameters_class(Derived) is Rates
    assert Anew(gain=2).parameters == More(gain=2)


def test_an_impossible_annotation_of_parameters_is_named(golden):
    class Untrue(Node):
        parameters: Unseen

    class Wrong(Node):
        parameters: int

    with golden.raises(InvalidDeclaration):
        Untrue()
    with golden.raises(InvalidDeclaration):
        Wrong()


@pytest.mark.parametrize(
    ("written", "name"),
    [
        ("Talker", "talker"),
        ("IMUPublisher2", "imu_publisher2"),
        ("HTTPServer", "http_server"),
        ("A", "a"),
        ("a_b", "a_b"),
    ],
)
def test_a_node_is_named_like_its_class(written, name):
    assert type(written, (Node,), {})().name == name


@pytest.mark.parametrize("name", ["", "über", "two words", "a/b", "1st", "a" * 300, "\x1b[31m"])
def test_a_name_outside_ros_grammar_is_refused_escaped(name):
    with pytest.raises(InvalidName) as caught:
        Rated(name=name)
    assert "\x1b" not in str(caught.value)


def test_a_call_that_needs_a_graph_says_so(golden):
    node = Rated()
    for use in (
        lambda: node.clock,
        lambda: node.log,
        lambda: node.rng,
        lambda: node.create_publisher(Int64, "numbers"),
        lambda: node.create_subscription(Int64, "numbers"),
    ):
        with golden.raises(NotRunning):
            use()
    with pytest.raises(NotRunning):
        node.spawn(asyncio.sleep(0))
    assert repr(node) == "<Rated /rated>"


# Written wrongly.


@pytest.mark.parametrize("name", ["name", "clock", "log", "rng", "spawn", "run_sync", "create_publisher", "_runtime"])
def test_an_attribute_that_hides_nodes_own_is_refused(name):
    with pytest.raises(InvalidDeclaration, match=rf"Hiding\.{name} hides Node\.{name}"):
        type("Hiding", (Node,), {name: 1})
    with pytest.raises(InvalidDeclaration, match=rf"Hiding\.{name} hides"):
        type("Hiding", (Node,), {"__annotations__": {name: int}})


def test_parameters_are_annotated_not_assigned(golden):
    with golden.raises(InvalidDeclaration):

        class Assigning(Node):
            parameters = Rates()


@pytest.mark.parametrize("hook", ["start", "run", "stop"])
def test_a_hook_that_is_awaited_must_be_async(hook, golden):
    def plain(self): ...

    with golden.raises(InvalidDeclaration):
        type("Plain", (Node,), {hook: plain})


def test_declare_must_not_be_async(golden):
    async def declare(self): ...

    with golden.raises(InvalidDeclaration):
        type("Async", (Node,), {"declare": declare})


@virtual_time
async def test_init_without_super_is_refused_with_advice(golden):
    class Forgetful(Node):
        def __init__(self):
            self.state = 1

    with golden.raises(InvalidDeclaration):
        await graph_of(Forgetful).start()


class Rclpys(Node):
    def __init__(self):
        super().__init__("sensor_processor")


class Wanting(Node):
    def __init__(self, port):
        super().__init__(name=port)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (Rclpys, "Rclpys is named by the launch file, by its class or with Rclpys(name='sensor_processor')"),
        (lambda: launch(Rclpys), "write no __init__: its ends are declared in the class"),
        (lambda: launch(Wanting), "Wanting cannot be built: missing a required argument: 'port'; write no __init__"),
        (lambda: Node("front"), "Node is named by the launch file, by its class or with Node(name='front')"),
    ],
)
def test_init_of_a_nodes_own_is_answered(make, said):
    with pytest.raises(InvalidDeclaration, match=re.escape(said)) as caught:
        make()
    assert ("__init__" in str(caught.value)) == ("front" not in said)


@virtual_time
async def test_raising_declare_is_a_problem_before_the_start():
    class Raising(Node):
        def declare(self):
            raise ZeroDivisionError("by nothing")

    class Exiting(Node):
        def declare(self):
            raise SystemExit(3)

    with pytest.raises(LaunchError) as caught:
        await graph_of(Raising, Exiting).start()
    assert [problem.code for problem in caught.value.problems] == ["declaration"] * 2
    for word in (
        "raising cannot declare its endpoints: ZeroDivisionError: by nothing",
        "SystemExit: 3",
        "test_node.py:",
    ):
        assert word in str(caught.value)


@virtual_time
async def test_a_node_belongs_to_one_graph(golden):
    node = Rated()
    async with graph_of(node):
        pass
    with golden.raises(LaunchError):
        await graph_of(node).start()
    twice = Rated()
    with golden.raises(LaunchError):
        await graph_of(twice, twice).start()


# Around a running node.


@virtual_time
async def test_the_clock_is_the_run_s():
    graph = graph_of(Rated)
    async with graph:
        await asyncio.sleep(2)
        assert graph.node(Rated).clock is graph.clock
        assert graph.node(Rated).clock.seconds() == 2


async def numbers_of(seed, *names):
    """The first random numbers of nodes of these names, and again after a reseed."""
    async with graph_of(*(Rated(name=name) for name in names), seed=seed) as graph:
        nodes = [graph.node(name) for name in names]
        first = [node.rng.uniform(size=3).tolist() for node in nodes]
        for node in nodes:
            node.rng.reseed()
        assert [node.rng.uniform(size=3).tolist() for node in nodes] == first
    return first


@virtual_time
async def test_random_numbers_depend_on_seed_and_name_alone():
    left, right = await numbers_of(1, "left", "right")
    assert left != right
    assert await numbers_of(1, "right", "left", "third") == [right, left, (await numbers_of(1, "third"))[0]]
    assert (await numbers_of(2, "left"))[0] != left


@virtual_time
async def test_the_log_is_bound_to_the_node():
    log = []
    graph = Graph([Rated(name="left")], clock=SimClock(), sinks=(log.append,))
    async with graph:
        graph.node("left").log.info("here", joint="knee")
    assert [(line.node, line.event, line.values) for line in log] == [("/left", "here", {"joint": "knee"})]


@virtual_time
async def test_a_spawned_task_has_the_node_s_name():
    class Spawning(Node):
        async def start(self):
            self.spawn(self.work())
            self.spawn(self.work(), name="second")

        async def work(self):
            names.append(asyncio.current_task().get_name())

    names = []
    async with graph_of(Spawning):
        await settle()
    assert names == ["/spawning.work", "/spawning.second"]


@virtual_time
async def test_what_a_task_cannot_run_is_refused(golden):
    async with graph_of(Node) as graph:
        node = graph.node("node")
        with golden.raises(InvalidDeclaration):
            node.spawn(settle)
        with golden.raises(InvalidDeclaration):
            await node.run_sync(settle)


def test_run_sync_returns_or_raises_from_a_thread():
    class Driver(Node):
        async def start(self):
            self.read = await self.run_sync(lambda *words: (words, threading.current_thread()), "a", "b")

        async def run(self):
            await self.run_sync(int, "unplugged")

    driver = Driver()

    async def main():
        with pytest.raises(NodeFailed, match="unplugged"):
            async with launch(driver), asyncio.timeout(60):
                await asyncio.Event().wait()

    asyncio.run(main())
    words, thread = driver.read
    assert words == ("a", "b")
    assert thread is not threading.main_thread()


def test_a_stopping_node_abandons_its_blocking_call():
    released, ended = threading.Event(), threading.Event()

    class Driver(Node):
        async def run(self):
            await self.run_sync(self.block)

        def block(self):
            self.entered.set()
            released.wait(60)
            ended.set()

    driver = Driver()
    driver.entered = threading.Event()

    async def main():
        async with launch(driver):
            assert await asyncio.to_thread(driver.entered.wait, 30)
        assert not ended.is_set()
        released.set()

    asyncio.run(main())
    assert ended.wait(60)


# Endpoints made while the node is made, started or running.


class Number(Message, package="test"):
    data: int


@pytest.mark.parametrize(("hz", "ticks"), [(3, 6), (0.5, 1), (0, 0)])
@virtual_time
async def test_a_timer_is_created_with_its_rate_too(hz, ticks):
    class Ticking(Node):
        count = 0

        def declare(self):
            self.timer = self.create_timer(hz=hz, handler=self.tick)

        def tick(self):
            self.count += 1

    async with graph_of(Ticking) as graph:
        await asyncio.sleep(2.001)
        assert graph.node(Ticking).count == ticks
        assert graph.report().timers[0].name == "tick"


@virtual_time
async def test_declare_creates_what_only_the_parameters_decide():
    class Many(Parameters):
        channels: int = 2

    class Sampler(Node):
        parameters: Many

        def declare(self):
            self.outputs = [self.create_publisher(Number, f"channel_{i}") for i in range(self.parameters.channels)]
            self.create_timer(1, self.sample)

        def sample(self):
            for index, output in enumerate(self.outputs):
                output.publish(Number(data=index))

    async with graph_of(Sampler(channels=3)) as graph:
        received = [graph.subscribe(Number, f"channel_{index}") for index in range(3)]
        await asyncio.sleep(2.5)
        assert [(each.published, each.latest.data) for each in received] == [(2, 0), (2, 1), (2, 2)]
        assert graph.report().timers[0].name == "sample"


@virtual_time
async def test_an_endpoint_created_later_is_a_late_joiner():
    heard, latched = [], QoS(durability="transient_local")

    class Source(Node):
        numbers = publisher(Number, "numbers", qos=latched)

        async def start(self):
            self.numbers.publish(Number(data=1))

    class Late(Node):
        async def run(self):
            await asyncio.sleep(1)
            self.create_subscription(Number, "numbers", self.hear, qos=latched)
            self.create_subscription(Number, "numbers", self.hear_plainly)
            self.create_timer(1, self.tick)
            await settle()
            heard.append("created")

        async def hear(self, number):
            heard.append(number.data)

        def hear_plainly(self, number):
            heard.append(-number.data)

        def tick(self):
            heard.append("tick")

    async with graph_of(Source, Late) as graph:
        await asyncio.sleep(1.5)
        graph.node(Source).numbers.publish(Number(data=2))
        await asyncio.sleep(1)
    assert heard[:2] == [1, "created"]
    assert sorted(heard[2:4]) == [-2, 2]
    assert heard[4:] == ["tick"]


@virtual_time
async def test_an_endpoint_created_later_is_checked_at_once():
    class Source(Node):
        numbers = publisher(Number, "numbers", qos=QoS(reliability="best_effort"))

    class Late(Node):
        pass

    async with graph_of(Source, Late) as graph:
        late = graph.node(Late)
        for error, create in (
            (IncompatibleType, lambda: late.create_subscription(String, "numbers")),
            (IncompatibleQoS, lambda: late.create_subscription(Number, "numbers")),
            (InvalidName, lambda: late.create_publisher(Number, "two words")),
            (InvalidDeclaration, lambda: late.create_publisher("numbers", Number)),
            (InvalidDeclaration, lambda: late.create_timer(-1, print)),
            (InvalidDeclaration, lambda: late.create_timer(hz=-1, handler=print)),
            (InvalidDeclaration, lambda: late.create_timer(hz=float("nan"), handler=print)),
            (InvalidDeclaration, lambda: late.create_timer(1, print, hz=1)),
            (InvalidDeclaration, lambda: late.create_timer(handler=print)),
            (InvalidDeclaration, lambda: late.create_timer(1)),
            (InvalidDeclaration, lambda: late.create_timer(1, print, missed="never")),
        ):
            with pytest.raises(error):
                create()
    assert graph.report().topics[0].subscriptions == ()


@virtual_time
async def test_a_pulled_subscription_lasts_from_start_to_end():
    class Puller(Node):
        numbers = subscription(Number, "numbers")

        async def start(self):
            self.got = []
            self.before = self.numbers.latest

        async def run(self):
            self.got += [number.data async for number in self.numbers]

    puller = Puller()
    async with graph_of(puller) as graph:
        outside = graph.subscribe(Number, "numbers")
        for data in range(3):
            graph.publish("numbers", Number(data=data))
        await settle()
        assert puller.before is None
        assert puller.numbers.delivered == 3
        graph.publish("numbers", Number(data=9))
        assert puller.numbers.latest == Number(data=9)
    assert [number.data async for number in outside] == [0, 1, 2, 9]


def test_signature_shows_number_of_arguments():
    def none(self): ...
    def one(self, message: String): ...
    def optional(self, message=None): ...
    def two(self, message, more): ...

    functions = (none, one, optional, two)
    assert [signatures.takes_none(each) for each in functions] == [True, False, True, False]
    assert [signatures.takes_one(each) for each in functions] == [False, True, True, False]
    assert [signatures.message_annotation(each) for each in (none, one, optional)] == [None, "String", None]
    assert signatures.takes_one(len)
    assert signatures.line_of(len) is None


def test_node_used_before_it_is_made_fails(golden):
    class Hasty(Node):
        def __init__(self):
            self.log.info("hello")
            super().__init__()

    with golden.raises(AttributeError):
        Hasty()
