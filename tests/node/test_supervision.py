"""Nodes that are started anew: what they keep, when they are given up, who waits for whom, and what an end means."""

import asyncio
from typing import ClassVar

import pytest

from busflow import (
    Graph,
    LivelinessChanged,
    Message,
    Node,
    NodeFailed,
    Parameters,
    PublisherMatched,
    QoS,
    RestartPolicy,
    on_event,
    publisher,
    service,
    subscription,
    supervised,
    timer,
)
from busflow.clock import SimClock
from busflow.errors import InvalidDeclaration, LaunchError
from busflow.msgs.std_msgs import Int64
from busflow.msgs.std_srvs import Trigger
from busflow.testing import explore, harness, virtual_time
from tests.vectors import each_case

POLICY = {"permanent": "always", "transient": "on-failure", "temporary": "never", "no": "never"}


class Number(Message, package="test"):
    data: int = 0


def graph_of(*what, **options):
    return Graph(what, clock=SimClock(), **options)


def state(graph, name):
    return next(node for node in graph.report().nodes if node.name == name)


def balanced(graph):
    return all(line.published == line.delivered + line.dropped + line.queued for line in graph.bus.ledger())


ENDS = {"child exits: abnormal": "raises", "timeout": "is late"}
"""Ends of a child that are no return; a node does not know OTP's shutdown, and returns."""


@each_case("k_supervision", "otp/", "systemd/")
@virtual_time
async def test_the_table_of_policies_and_ends(case, limits):
    given, restarted = case["given"], case["expect"]["restarted"]
    policy = POLICY.get(stated := given.get("restart") or given["Restart"], stated)
    end = ENDS.get(case["steps"][0])
    limits(start=0.02)
    lives = []

    class Ending(Node):
        async def start(self) -> None:
            lives.append(self)
            if end == "is late" and len(lives) == 1:
                await asyncio.Event().wait()

        async def run(self) -> None:
            if len(lives) > 1:
                await asyncio.Event().wait()
            if end == "raises":
                raise ValueError(end)

    class Bystander(Node):
        @timer(0.5)
        def tick(self) -> None: ...

    graph = graph_of(supervised(Ending, restart=policy), Bystander)
    starting = asyncio.create_task(graph.start())
    await asyncio.wait([starting])
    await asyncio.sleep(1)
    assert (len(lives) == 2) == restarted
    assert state(graph, "/ending").restarts == restarted
    await graph.stop()
    if not starting.cancelled():
        starting.exception()


class Counting(Node):
    """A node with some of everything, that fails on negative numbers."""

    instances: ClassVar[list["Counting"]] = []

    latched = publisher(Number, "latched", qos=QoS(durability="transient_local", depth=1))
    numbers = subscription(Number, "pulled")

    async def start(self) -> None:
        Counting.instances.append(self)
        self.seen: list[int] = []

    @subscription("numbers", qos=QoS(depth=5))
    def hear(self, number: Number) -> None:
        self.seen.append(number.data)
        if number.data < 0:
            raise ValueError(number.data)

    @timer(0.25)
    def tick(self) -> None: ...

    @service(Trigger, "~/ask")
    def ask(self, _request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=True, message=str(len(Counting.instances)))


@pytest.fixture(autouse=True)
def _no_instances():
    Counting.instances = []


@virtual_time
async def test_a_restarted_node_continues_with_the_next_message():
    graph = graph_of(supervised(Counting, restart="on-failure"))
    async with graph:
        for data in (1, -1, 2):
            graph.publish("numbers", Number(data=data))
        await asyncio.sleep(0.05)
        assert state(graph, "/counting").state == "restarting"
        for data in (3, 4, 5, 6, 7):
            graph.publish("numbers", Number(data=data))
        await asyncio.sleep(0.1)
        first, second = Counting.instances
        assert (first.seen, second.seen) == ([1, -1], [3, 4, 5, 6, 7])
        assert graph.node(Counting) is second
        told = state(graph, "/counting")
        assert (told.state, told.restarts, told.failures) == ("running", 1, 1)
        assert "ValueError: -1" in told.last_failure
        [line] = [line for line in graph.bus.ledger() if line.topic == "/numbers"]
        assert (line.published, line.delivered, line.dropped, line.queued) == (8, 7, 1, 0)
        assert (await graph.call(Trigger, "counting/ask")).message == "2"
    assert graph.exit_code == 0
    assert balanced(graph)


@virtual_time
async def test_only_the_node_that_failed_is_built_anew():
    graph = graph_of(supervised(Counting, restart="on-failure"), Counting(name="other"))
    async with graph:
        other = graph.node("other")
        graph.node("counting")._runtime.life.fail("here", ValueError("no"))
        await asyncio.sleep(0.2)
        assert graph.node("other") is other
        assert len(Counting.instances) == 3


@virtual_time
async def test_a_latched_message_survives_the_publishers_restart():
    graph = graph_of(supervised(Counting, restart="on-failure"))
    latched = QoS(durability="transient_local", depth=1)
    async with graph:
        graph.node(Counting).latched.publish(Number(data=7))
        graph.publish("numbers", Number(data=-1))
        await asyncio.sleep(0.05)
        meanwhile = graph.subscribe(Number, "latched", qos=latched)
        assert meanwhile.latest == Number(data=7)
        await asyncio.sleep(0.1)
        assert graph.subscribe(Number, "latched", qos=latched).latest == Number(data=7)
        graph.node(Counting).latched.publish(Number(data=8))
        assert meanwhile.latest == Number(data=8)
        assert graph.bus.topics["/latched"].published == 2


@virtual_time
async def test_restart_is_unnoticed_new_instance_gets_matched_events():
    heard = []

    class Watching(Node):
        @on_event("latched")
        def changed(self, event: LivelinessChanged) -> None:
            heard.append(event)

        latched = subscription(Number, "latched")

    class Source(Counting):
        @on_event("latched")
        def matched(self, event: PublisherMatched) -> None:
            heard.append(event)

    async with graph_of(supervised(Source, restart="on-failure"), Watching) as graph:
        await asyncio.sleep(0)
        before = list(heard)
        graph.publish("numbers", Number(data=-1))
        await asyncio.sleep(1)
        assert heard == [*before, PublisherMatched("/latched", 1, 1, 1, 1)]


@virtual_time
async def test_timers_begin_again_and_their_account_goes_on():
    async with graph_of(supervised(Counting, restart="on-failure")) as graph:
        await asyncio.sleep(0.6)
        graph.publish("numbers", Number(data=-1))
        await asyncio.sleep(0.1 + 0.26)
        [told] = graph.report().timers
        assert told.fired == 3, "at 0.25, at 0.5, and 0.25 after the restart at 0.7"


@virtual_time
async def test_each_timer_continues_its_own_account():
    class Blinking(Counting):
        @timer(0.5)
        def blink(self) -> None: ...

    async with graph_of(supervised(Blinking, restart="on-failure")) as graph:
        await asyncio.sleep(0.6)
        graph.publish("numbers", Number(data=-1))
        await asyncio.sleep(0.1 + 0.51)
        assert {each.name: each.fired for each in graph.report().timers} == {"tick": 4, "blink": 2}


class Configured(Parameters):
    rate_hz: float = 4.0


class Tuned(Node):
    parameters: Configured

    def declare(self) -> None:
        if self.parameters.rate_hz > 5:
            self.create_publisher(Number, "fast")
        else:
            self.create_subscription(Number, "slow", lambda _message: None)

    @subscription("crash")
    def crash(self, _number: Number) -> None:
        raise ValueError


@virtual_time
async def test_a_restarted_node_uses_its_current_parameters():
    async with graph_of(supervised(Tuned(rate_hz=1), restart="on-failure")) as graph:
        graph.publish("slow", Number())
        graph.set_parameters(Tuned, rate_hz=9)
        graph.publish("crash", Number())
        await asyncio.sleep(0.2)
        node = graph.node(Tuned)
        assert node.parameters.rate_hz == 9
        assert [each.topic for each in node._runtime.endpoints.publishers] == ["/fast"]
        assert graph.bus.topics["/slow"].subscriptions == []
        assert state(graph, "/tuned").parameters_set == 1
    assert balanced(graph)


@virtual_time
async def test_random_numbers_differ_by_life_not_by_run():
    async def drawn(seed):
        numbers = []

        class Drawing(Node):
            async def run(self) -> None:
                numbers.append(self.rng.random())
                raise ValueError

        graph = graph_of(supervised(Drawing, restart=RestartPolicy("on-failure", most=2)), seed=seed)
        with pytest.raises(NodeFailed):
            async with graph:
                await asyncio.sleep(10)
        return numbers

    first, again, other = await drawn(1), await drawn(1), await drawn(2)
    assert first == again
    assert len({*first, *other}) == 6


@pytest.mark.parametrize("where", ["start", "run", "handler", "timer"])
@virtual_time
async def test_a_node_failing_too_often_ends_the_run(where):
    lives, log = [], []

    class Hopeless(Node):
        async def start(self) -> None:
            lives.append(self.clock.seconds())
            if where == "start":
                raise ValueError(where)

        async def run(self) -> None:
            if where == "run":
                raise ValueError(where)

        @timer(0.001)
        def tick(self) -> None:
            if where == "timer":
                raise ValueError(where)
            if where == "handler":
                self.numbers.publish(Number())

        numbers = publisher(Number, "numbers")

        @subscription("numbers")
        def hear(self, _number: Number) -> None:
            raise ValueError(where)

    policy = RestartPolicy("on-failure", most=2, first_s=1, longest_s=10, window_s=60)
    graph = graph_of(supervised(Hopeless, restart=policy), Counting, sinks=(log.append,))
    with pytest.raises(NodeFailed, match=f"ValueError: {where}"):
        async with graph:
            await asyncio.sleep(100)
    assert [round(at, 1) for at in lives] == [0, 1, 3]
    told = state(graph, "/hopeless")
    assert (told.state, told.restarts, told.failures) == ("failed", 2, 3)
    assert state(graph, "/counting").state == "stopped"
    assert any(" 2 restarts " in record.event and " 60 s" in record.event for record in log)
    assert graph.exit_code == 1
    assert balanced(graph)


@virtual_time
async def test_a_failed_rebuild_counts_towards_the_restart_limit():
    built = []

    class Once(Node):
        def declare(self) -> None:
            built.append(self)
            if 1 < len(built) < 4:
                raise ValueError("not again")

        @subscription("crash")
        def crash(self, _number: Number) -> None:
            raise ValueError

    graph = graph_of(supervised(Once, restart="on-failure"))
    async with graph:
        graph.publish("crash", Number())
        await asyncio.sleep(1)
        assert (len(built), state(graph, "/once").restarts, state(graph, "/once").state) == (4, 3, "running")
        assert graph.node(Once) is built[-1]
        [line] = [line for line in graph.bus.ledger() if line.topic == "/crash"]
        assert line.delivered == 1
    assert balanced(graph)


@virtual_time
async def test_life_that_fails_while_connecting_loses_no_count():
    built: list[Node] = []

    class Unlucky(Counting):
        def declare(self) -> None:
            built.append(self)
            if len(built) == 2:
                self.create_publisher(Int64, "numbers")
            self.create_publisher(Number, "extra")

    graph = graph_of(supervised(Unlucky, restart="on-failure"))
    async with graph:
        graph.publish("numbers", Number(data=1))
        graph.publish("numbers", Number(data=-1))
        await asyncio.sleep(1)
        assert (len(built), state(graph, "/unlucky").restarts) == (3, 2)
        graph.publish("numbers", Number(data=3))
        await asyncio.sleep(0)
        assert built[-1].seen == [3]
        [line] = [line for line in graph.bus.ledger() if line.topic == "/numbers"]
        assert (line.published, line.delivered) == (3, 3)
        assert [len(graph.bus.topics[each].publishers) for each in ("/latched", "/extra")] == [1, 1]
    assert balanced(graph)


@virtual_time
async def test_always_restarts_a_returned_node_until_the_limit(golden):
    lives = []

    class Short(Node):
        async def run(self) -> None:
            lives.append(self.clock.seconds())

    policy = RestartPolicy("always", most=3, first_s=1, longest_s=1)
    with golden.raises(NodeFailed):
        async with graph_of(supervised(Short, restart=policy)):
            await asyncio.sleep(100)
    assert lives == [0, 1, 2, 3]


@virtual_time
async def test_a_pause_is_of_the_run_s_clock():
    policy = RestartPolicy("on-failure", first_s=3600, longest_s=3600)
    async with graph_of(supervised(Counting, restart=policy)) as graph:
        graph.publish("numbers", Number(data=-1))
        await asyncio.sleep(3599)
        assert state(graph, "/counting").state == "restarting"
        await asyncio.sleep(2)
        assert state(graph, "/counting").state == "running"


@pytest.mark.parametrize("waits", ["a pause", "a start", "another node"])
@virtual_time
async def test_a_run_stops_though_a_node_waits(waits):
    class Waiting(Node):
        async def start(self) -> None:
            if waits == "a start":
                await asyncio.Event().wait()
            if waits == "a pause":
                raise ValueError

    class Silent(Node):
        numbers = publisher(Number, "numbers")

        @timer(1)
        def tick(self) -> None: ...

    needs = {"silent": "first_message"} if waits == "another node" else {}
    policy = RestartPolicy("on-failure", first_s=1000, longest_s=1000)
    graph = graph_of(supervised(Waiting, restart=policy, depends_on=needs), Silent)
    starting = asyncio.create_task(graph.start())
    await asyncio.sleep(1)
    expected = {"a pause": "restarting", "a start": "starting", "another node": "waiting"}
    assert state(graph, "/waiting").state == expected[waits]
    await graph.stop()
    await starting
    assert asyncio.get_running_loop().time() == 1
    assert state(graph, "/waiting").state == "stopped"


# Who waits for whom.


class First(Node):
    numbers = publisher(Number, "first")
    told: ClassVar[list[str]] = []

    async def start(self) -> None:
        First.told = ["first begins"]
        await asyncio.sleep(1)
        First.told.append("first is ready")

    @timer(1)
    def tick(self) -> None:
        First.told.append("first speaks")
        self.numbers.publish(Number())


class Second(Node):
    async def start(self) -> None:
        First.told.append("second")


@pytest.mark.parametrize(("condition", "after"), [("started", 1), ("ready", 2), ("first_message", 3)])
@virtual_time
async def test_a_node_starts_when_its_conditions_are_met(condition, after):
    async with graph_of(supervised(Second, depends_on={"first": condition}), First):
        await asyncio.sleep(1.5)
    assert First.told[:4].index("second") == after


@virtual_time
async def test_nodes_stop_before_those_they_depend_on():
    order = []

    class Named(Node):
        async def stop(self) -> None:
            order.append(self.name)

    async with graph_of(
        supervised(Named(name="a"), depends_on={"b": "ready"}), Named(name="b"), Named(name="c"), Named(name="d")
    ):
        pass
    assert order == ["d", "c", "a", "b"]


@virtual_time
async def test_a_node_that_waits_in_vain_fails(golden):
    class Mute(Node):
        numbers = publisher(Number, "numbers")

        async def run(self) -> None: ...

    class Other(Node):
        @timer(1)
        def tick(self) -> None: ...

    graph = graph_of(Mute, Other, supervised(Second, depends_on={"mute": "first_message"}, restart="always"))
    with golden.raises(NodeFailed):
        await graph.start()


@pytest.mark.parametrize(
    ("needs", "said"),
    [
        ({"a": {"c": "ready"}}, "/a depends on /c, which is not a node or program of this graph"),
        ({"a": {"a": "ready"}}, "/a waits for /a: none of them would ever start"),
        ({"a": {"b": "ready"}, "b": {"a": "started"}}, "/a waits for /b waits for /a: none of them would ever start"),
        ({"a": {"b": "first_message"}}, "/a waits for the first message of /b, which publishes nothing"),
    ],
)
@virtual_time
async def test_impossible_condition_is_reported_before_the_start(needs, said):
    nodes = [supervised(Second(name=name), depends_on=needs.get(name)) for name in ("a", "b")]
    with pytest.raises(LaunchError) as caught:
        await graph_of(*nodes).start()
    assert said in str(caught.value)


@virtual_time
async def test_unrestartable_class_is_reported_before_the_start(golden):
    class Particular(Node):
        def __init__(self, port):
            super().__init__()
            self.port = port

    with golden.raises(LaunchError):
        await graph_of(supervised(Particular(5), restart="always")).start()


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"restart": "sometimes"}, "restart is one of never, on-failure, always, got 'sometimes'"),
        ({"on_exit": "stop"}, "on_exit is one of ignore, shutdown, got 'stop'"),
        ({"depends_on": {"a": "redy"}}, "depends_on a is one of started, ready, first_message, got 'redy'"),
    ],
)
def test_unknown_words_are_refused(how, said):
    with pytest.raises(InvalidDeclaration, match=said):
        supervised(Second, **how)


# What an end means.


@virtual_time
async def test_a_run_ends_when_every_node_has():
    class Short(Node):
        async def run(self) -> None:
            self.spawn(asyncio.sleep(2), name="more")
            await asyncio.sleep(1)

    graph = graph_of(Short, Short(name="other"))
    await graph.start()
    await graph.wait()
    assert (graph.exit_code, asyncio.get_running_loop().time()) == (0, 2)


@virtual_time
async def test_a_node_with_live_endpoints_keeps_running():
    class Reacting(Node):
        async def run(self) -> None: ...

        @subscription("numbers")
        def hear(self, _number: Number) -> None: ...

    class Serving(Node):
        latched = publisher(Number, "latched", qos=QoS(durability="transient_local"))

        async def run(self) -> None: ...

    async with graph_of(Reacting, Serving) as graph:
        await asyncio.sleep(1)
        assert {node.state for node in graph.report().nodes} == {"running"}


@virtual_time
async def test_one_node_s_end_can_end_the_run():
    class Mission(Node):
        numbers = publisher(Number, "numbers")

        async def run(self) -> None:
            await asyncio.sleep(5)
            self.numbers.publish(Number(data=1))

    heard = []

    class Listener(Node):
        @subscription("numbers")
        def hear(self, number: Number) -> None:
            heard.append(number.data)

    graph = graph_of(supervised(Mission, on_exit="shutdown"), Listener)
    await graph.start()
    await graph.wait()
    assert (graph.exit_code, heard, asyncio.get_running_loop().time()) == (0, [1], 5)


# Any order of events.


class Fragile(Node):
    """Relays numbers, and fails whenever its generator says so."""

    out = publisher(Number, "relayed", qos=QoS(durability="transient_local", depth=3))

    async def start(self) -> None:
        if self.rng.random() < 0.2:
            raise ValueError("start")
        await asyncio.sleep(0)

    @subscription("numbers", qos=QoS(depth=4))
    def relay(self, number: Number) -> None:
        if self.rng.random() < 0.15:
            raise ValueError("handler")
        self.out.publish(number)

    @subscription("numbers", qos=QoS(depth=2, overflow="drop_newest"))
    async def slowly(self, _number: Number) -> None:
        await asyncio.sleep(0.03)
        if self.rng.random() < 0.1:
            raise ValueError("async handler")

    @timer(0.1)
    def tick(self) -> None:
        if self.rng.random() < 0.1:
            raise ValueError("timer")

    async def stop(self) -> None:
        if self.rng.random() < 0.1 and self.clock.seconds() < 1:
            raise ValueError("stop")


class Talking(Node):
    numbers = publisher(Number, "numbers")

    @timer(0.01)
    def tick(self) -> None:
        self.numbers.publish(Number(data=self.tick.fired))


@explore(schedules=20)
async def test_any_order_of_failures_accounts_for_every_message():
    policy = RestartPolicy("on-failure", most=1000, first_s=0.01, longest_s=0.05)
    lab = harness(supervised(Fragile, restart=policy), supervised(Fragile(name="second"), restart=policy), Talking)
    async with lab:
        relayed = lab.subscribe(Number, "relayed", qos=QoS(depth=1000))
        lab.delay("numbers", 0.005)
        await lab.advance(1)
        assert len(lab.received("numbers")) in (99, 100)
        for line in lab.ledger:
            assert line.published == line.delivered + line.dropped + line.queued
            assert line.queued <= line.depth + 2, "what is on its way is queued, too"
        names = {node.name: node for node in lab.graph.report().nodes}
        assert names["/fragile"].restarts > 1
        assert {node.state for node in names.values()} <= {"running", "restarting", "starting"}
        values = [message.data for message in lab.received("relayed")]
        assert relayed.published == len(values)
        assert lab.graph.bus.topics["/numbers"].publishers[0].subscription_count == 4
    assert lab.graph.exit_code == 0
