"""A graph starts its nodes together, ends with whatever fails, and stops in order."""

import asyncio
import io
import itertools
import threading
from contextlib import suppress
from pathlib import Path

import anyio
import pytest

from busflow import (
    ActionType,
    BusflowError,
    Graph,
    Message,
    Node,
    NodeFailed,
    Parameters,
    QoS,
    launch,
    publisher,
    service,
    subscription,
    supervised,
    timer,
)
from busflow.bus.bus import BusObserver
from busflow.clock import SimClock
from busflow.errors import (
    ExitCode,
    IncompatibleType,
    InvalidDeclaration,
    LaunchError,
    NoSuchTarget,
    NotRunning,
    StartTimeout,
)
from busflow.log import LogRecord
from busflow.msgs.std_srvs import SetBool, Trigger
from busflow.testing import harness, virtual_time
from tests.actions.conftest import Arm, MoveTo

CONFIG = Path(__file__).parents[2] / "configs" / "lab1.yaml"


class Number(Message, package="test"):
    data: int


class TalkerParameters(Parameters):
    period_s: float = 0.1


class Talker(Node):
    parameters: TalkerParameters
    numbers = publisher(Number, "numbers")
    count = 0

    @timer("period_s")
    def talk(self) -> None:
        self.count += 1
        self.numbers.publish(Number(data=self.count))


class Listener(Node):
    async def start(self) -> None:
        self.received: list[int] = []

    @subscription("numbers")
    def on_number(self, number: Number) -> None:
        self.received.append(number.data)


class Failing(Node):
    @subscription("numbers")
    def on_number(self, number: Number) -> None:
        if number.data == 3:
            raise ValueError("three is too many")


def graph_of(*what, **options) -> tuple[Graph, list[LogRecord]]:
    """A graph on virtual time, and its log."""
    log: list[LogRecord] = []
    return Graph(what, clock=SimClock(), sinks=(log.append,), **options), log


@virtual_time
async def test_nodes_receive_every_message_within_the_block():
    graph, _ = graph_of(Talker, Listener)
    async with graph:
        await asyncio.sleep(1.05)
    assert graph.node(Listener).received == list(range(1, 11))
    assert graph.exit_code is ExitCode.OK


@virtual_time
async def test_messages_published_during_start_wait_in_queues():
    class Early(Node):
        numbers = publisher(Number, "numbers")

        async def start(self) -> None:
            for data in range(3):
                self.numbers.publish(Number(data=data))

    class Late(Listener):
        async def start(self) -> None:
            await super().start()
            await asyncio.sleep(5)
            self.received_in_start = list(self.received)

    graph, _ = graph_of(Early, Late)
    async with graph:
        await asyncio.sleep(0)
        late = graph.node(Late)
        await asyncio.sleep(0.01)
    assert late.received_in_start == []
    assert late.received == [0, 1, 2]


@virtual_time
async def test_failing_node_ends_block_with_its_cause(golden):
    graph, log = graph_of(Talker, Listener, Failing)
    with pytest.raises(NodeFailed) as caught:
        async with graph:
            await asyncio.sleep(1000)
    assert isinstance(caught.value.__cause__, ValueError)
    assert asyncio.get_running_loop().time() == pytest.approx(0.3)
    golden(str(caught.value))
    assert "on test/msg/Number: Number(data=3)" in str(caught.value)
    assert [record.node for record in log if record.level == "error"] == ["/failing"]
    assert graph.exit_code is ExitCode.FAILED
    assert {node.name: node.state for node in graph.report().nodes} == {
        "/talker": "stopped",
        "/listener": "stopped",
        "/failing": "failed",
    }


@virtual_time
async def test_ending_does_not_hide_the_block_s_error():
    graph, _ = graph_of(Talker)
    with pytest.raises(KeyError):
        async with graph:
            raise KeyError("mine")
    assert graph.report().nodes[0].state == "stopped"


@virtual_time
async def test_node_failure_does_not_replace_block_s_error():
    graph, _ = graph_of(Talker, Failing)

    async def block() -> None:
        async with graph:
            try:
                await asyncio.sleep(1000)
            finally:
                raise KeyError("mine")

    with pytest.raises(KeyError):
        await block()


@virtual_time
async def test_failed_node_receives_no_more_messages():
    class Twice(Node):
        received = 0

        @subscription("numbers")
        def fail(self, number: Number) -> None:
            raise ValueError(number.data)

        @subscription("numbers")
        def on_number(self, number: Number) -> None:
            self.received += number.data

    class Slow(Node):
        numbers = publisher(Number, "numbers")

        async def stop(self) -> None:
            self.numbers.publish(Number(data=5))
            await asyncio.sleep(0.1)

    graph, _ = graph_of(Twice, Slow)
    await graph.start()
    graph.publish("numbers", Number(data=1))
    with pytest.raises(NodeFailed):
        await graph.wait()
    assert graph.node(Twice).received == 0


@virtual_time
async def test_no_handler_runs_once_stop_has_begun():
    class Closing(Listener):
        async def stop(self) -> None:
            self.received_before = list(self.received)
            await asyncio.sleep(0.1)

    graph, _ = graph_of(Closing)
    async with graph:
        graph.publish("numbers", Number(data=1))
        await asyncio.sleep(0.01)
        graph.ask_to_stop()
        await asyncio.sleep(0.01)
        graph.publish("numbers", Number(data=2))
    closing = graph.node(Closing)
    assert closing.received == closing.received_before == [1]


@virtual_time
async def test_node_failing_during_start_never_ticks():
    class Doomed(Talker):
        async def start(self) -> None:
            self.spawn(self.fail())
            await asyncio.sleep(1)

        async def fail(self) -> None:
            raise ValueError("no")

    graph, _ = graph_of(Doomed(period_s=0.001))
    with pytest.raises(NodeFailed):
        await graph.start()
    assert graph.report().timers[0].fired == 0


@virtual_time
async def test_publish_after_the_end_raises(golden):
    graph, _ = graph_of(Talker)
    async with graph:
        talker = graph.node(Talker)
    with golden.raises(NotRunning):
        talker.numbers.publish(Number(data=1))


@virtual_time
async def test_message_that_crashed_handler_counts_as_delivered():
    graph, _ = graph_of(Failing)
    await graph.start()
    for data in range(5):
        graph.publish("numbers", Number(data=data))
    with pytest.raises(NodeFailed):
        await graph.wait()
    line = next(iter(graph.bus.ledger()))
    assert (line.published, line.delivered, line.dropped, line.queued) == (5, 4, 0, 1)


@pytest.mark.parametrize("hook", ["start", "run", "stop"])
@virtual_time
async def test_raising_hook_is_named_in_the_failure(hook, golden):
    class Raising(Node):
        async def start(self) -> None:
            self.raise_in("start")

        async def run(self) -> None:
            self.raise_in("run")

        async def stop(self) -> None:
            self.raise_in("stop")

        def raise_in(self, name: str) -> None:
            if name == hook:
                raise RuntimeError(f"in {name}")

    graph, _ = graph_of(Raising)
    with golden.raises(NodeFailed):
        async with graph:
            await asyncio.sleep(1)


@virtual_time
async def test_stop_is_called_after_a_failed_start():
    closed: list[str] = []

    class Half(Node):
        async def start(self) -> None:
            closed.append("opened")
            raise OSError("no such device")

        async def stop(self) -> None:
            closed.append("closed")

    graph, _ = graph_of(Half)
    with pytest.raises(NodeFailed):
        await graph.start()
    assert closed == ["opened", "closed"]


@virtual_time
async def test_nodes_stop_in_reverse_launch_order():
    order: list[str] = []

    class Ordered(Node):
        async def stop(self) -> None:
            await asyncio.sleep(0.01)
            order.append(self.name)

    graph, _ = graph_of(Ordered(name="a"), Ordered(name="b"), Ordered(name="c"))
    async with graph:
        pass
    assert order == ["c", "b", "a"]


@virtual_time
async def test_nodes_without_stop_end_together():
    graph, _ = graph_of(*(Node(name=f"node{number}") for number in range(100)))
    loop, turns = asyncio.get_running_loop(), itertools.count()

    def turn() -> None:
        next(turns)
        loop.call_soon(turn)

    async with graph:
        turn()
    assert next(turns) < 20, "as many turns of the loop as nodes, each of which takes long where they are busy"


@virtual_time
async def test_run_is_cancelled_unless_it_has_returned():
    class Returning(Node):
        async def run(self) -> None:
            self.ran = True

    class Endless(Node):
        async def run(self) -> None:
            try:
                await asyncio.Event().wait()
            finally:
                self.cancelled = True

    graph, _ = graph_of(Returning, Endless)
    async with graph:
        await asyncio.sleep(1)
    assert graph.node(Returning).ran
    assert graph.node(Endless).cancelled


@virtual_time
async def test_failing_spawned_task_fails_its_node(golden):
    class Spawning(Node):
        async def start(self) -> None:
            self.spawn(self.work())

        async def work(self) -> None:
            await asyncio.sleep(1)
            raise ValueError("no more work")

    graph, _ = graph_of(Spawning)
    with golden.raises(NodeFailed):
        async with graph:
            await asyncio.sleep(5)


@virtual_time
async def test_handler_that_exits_is_a_failure():
    class Exiting(Node):
        @subscription("numbers")
        def on_number(self, number: Number) -> None:
            raise SystemExit(number.data)

    graph, _ = graph_of(Talker, Exiting)
    with pytest.raises(NodeFailed) as caught:
        async with graph:
            await asyncio.sleep(5)
    assert isinstance(caught.value.__cause__, SystemExit)


@virtual_time
async def test_self_feeding_node_does_not_delay_timers():
    class Greedy(Node):
        numbers = publisher(Number, "own")
        ticks = 0

        async def start(self) -> None:
            self.numbers.publish(Number(data=0))

        @subscription("own")
        async def on_number(self, number: Number) -> None:
            await asyncio.sleep(0.0001)
            self.numbers.publish(number)

        @timer(0.1)
        def tick(self) -> None:
            self.ticks += 1

    graph, _ = graph_of(Greedy)
    async with graph:
        await asyncio.sleep(1.05)
    assert graph.node(Greedy).ticks == 10


def test_endless_start_is_given_up_in_wall_time(limits):
    class Stuck(Node):
        async def start(self) -> None:
            await asyncio.Event().wait()

    limits(start=0.05)

    async def main() -> None:
        with pytest.raises(NodeFailed, match=r"Stuck.start") as caught:
            await launch(Stuck).start()
        assert isinstance(caught.value.__cause__, StartTimeout)

    asyncio.run(main())


@virtual_time
async def test_every_problem_is_reported_before_the_start():
    class Wordy(Node):
        words = publisher(Number, "numbers", qos=QoS(reliability="best_effort"))
        started = False

        async def start(self) -> None:
            Wordy.started = True

    graph, _ = graph_of(Wordy, Listener)
    with pytest.raises(LaunchError, match="reliability"):
        await graph.start()
    assert not Wordy.started


@virtual_time
async def test_warnings_of_the_pre_flight_are_logged(golden):
    graph, log = graph_of(Listener)
    async with graph:
        pass
    assert [(record.level, record.node) for record in log] == [("warning", "busflow")]
    golden(log[0].event)


@virtual_time
async def test_a_graph_runs_once(golden):
    graph, _ = graph_of(Talker)
    async with graph:
        with golden.raises(NotRunning):
            await graph.start()


@virtual_time
async def test_a_graph_that_is_not_started_says_so(golden):
    graph, _ = graph_of(Talker)
    for use in (graph.wait, lambda: graph.publish("x", Number(data=1)), lambda: graph.subscribe(Number, "x")):
        with golden.raises(NotRunning):
            await (use() or asyncio.sleep(0))


@virtual_time
async def test_the_program_around_publishes_and_receives():
    graph, _ = graph_of(Listener)
    async with graph:
        outside = graph.subscribe(Number, "numbers")
        graph.publish("numbers", Number(data=7))
        assert (await anext(outside)).data == 7
    assert graph.node("listener").received == [7]
    assert [each async for each in outside] == []


@virtual_time
async def test_a_misspelt_topic_is_answered_with_the_nearest(golden):
    graph, _ = graph_of(Listener)
    async with graph:
        for use in (lambda: graph.publish("numbesr", Number(data=1)), lambda: graph.subscribe(Number, "numbesr")):
            with golden.raises(NoSuchTarget):
                use()
        graph.advertise(Number, "numbesr")
        graph.publish("numbesr", Number(data=7))


@virtual_time
async def test_a_fresh_topic_like_no_other_is_created():
    graph, _ = graph_of(Listener)
    async with graph:
        own = graph.subscribe(Number, "something/else")
        graph.publish("something/else", Number(data=7))
        assert (await anext(own)).data == 7


@virtual_time
async def test_node_is_found_by_class_or_name(golden):
    graph, _ = graph_of(Talker(name="left"), Talker(name="right"))
    async with graph:
        assert graph.node("/left").name == "left"
        with golden.raises(BusflowError):
            graph.node(Talker)
        with golden.raises(BusflowError):
            graph.node("rigth")


@virtual_time
async def test_two_graphs_in_one_process_never_meet():
    first, _ = graph_of(Talker)
    second, _ = graph_of(Listener)
    async with first, second:
        await asyncio.sleep(1)
    assert second.node(Listener).received == []


@virtual_time
async def test_stop_without_a_block_ends_a_graph():
    graph, _ = graph_of(Talker)
    await graph.start()
    await asyncio.sleep(0.25)
    await graph.stop()
    await graph.wait()
    report = graph.report()
    assert report.duration_s == pytest.approx(0.25)
    assert report.timers[0].fired == 2


@virtual_time
async def test_a_launch_file_and_classes_make_one_graph():
    graph, _ = graph_of(CONFIG, Listener, args={"rate_hz": 50})
    async with graph:
        await asyncio.sleep(1)
    assert graph.name == "lab1"
    assert [node.name for node in graph.report().nodes] == ["/sensor_publisher", "/sensor_processor", "/listener"]
    assert graph.report().timers[0].period_s == 0.02


def test_non_node_is_refused_by_its_repr():
    with pytest.raises(InvalidDeclaration, match="42"):
        launch(42)  # type: ignore[arg-type]  # that is the test


def test_messages_from_threads_are_ordered_and_counted():
    class Driver(Node):
        numbers = publisher(Number, "numbers", qos=QoS(depth=2000))

        async def run(self) -> None:
            await self.run_sync(self.read)

        def read(self) -> None:
            for data in range(1000):
                self.numbers.publish(Number(data=data))

    class Counter(Node):
        async def start(self) -> None:
            self.received: list[int] = []
            self.complete = asyncio.Event()

        @subscription("numbers", qos=QoS(depth=2000))
        def on_number(self, number: Number) -> None:
            self.received.append(number.data)
            if number.data == 999:
                self.complete.set()

    async def main() -> None:
        async with launch(Driver, Counter) as graph:
            counter = graph.node(Counter)
            async with asyncio.timeout(60):
                await counter.complete.wait()
            assert counter.received == list(range(1000))
        report = graph.report()
        assert (report.topics[0].published, report.dropped) == (1000, 0)

    asyncio.run(main())


def test_graph_runs_in_another_thread():
    graph = launch(Talker(period_s=0.001), Listener)
    received: list[int] = []

    async def main() -> None:
        async with graph, asyncio.timeout(60):
            async for number in graph.subscribe(Number, "numbers"):
                received.append(number.data)
                if len(received) == 3:
                    break

    thread = threading.Thread(target=lambda: asyncio.run(main()))
    thread.start()
    thread.join(60)
    assert received == [1, 2, 3]


# Within a program that has cancellations of its own.


class Slow(Node):
    """A node whose `start` and `stop` take their time, and tell when they are through."""

    started = stopped = False

    async def start(self) -> None:
        await asyncio.sleep(1)
        self.started = True

    async def stop(self) -> None:
        await asyncio.sleep(0.1)
        self.stopped = True


@virtual_time
async def test_first_of_two_failures_ends_the_block(golden):
    graph, _ = graph_of(Talker, Failing(name="one"), Failing(name="two"))
    with golden.raises(NodeFailed):
        async with graph:
            await asyncio.sleep(1000)
    assert [failure.node for failure in graph.failures] == ["/one", "/two"]


@virtual_time
async def test_a_failure_leaves_no_cancellation_behind():
    task = asyncio.current_task()
    graph, _ = graph_of(Talker, Failing)
    with pytest.raises(NodeFailed):
        async with graph:
            await asyncio.sleep(1000)
    assert task.cancelling() == 0

    async def careless() -> None:
        graph, _ = graph_of(Talker, Failing)
        async with graph:
            with suppress(asyncio.CancelledError):
                await asyncio.sleep(1000)

    with pytest.raises(NodeFailed):
        await careless()
    assert task.cancelling() == 0


@virtual_time
async def test_cancelled_block_stops_nodes_and_stays_cancelled():
    slow = Slow()

    async def block() -> None:
        graph, _ = graph_of(slow)
        async with graph:
            await asyncio.sleep(1000)

    task = asyncio.create_task(block())
    await asyncio.sleep(2)
    task.cancel()
    await asyncio.wait([task])
    assert task.cancelled()
    assert slow.stopped


@virtual_time
async def test_block_cancelled_during_a_failure_stays_cancelled():
    async def block() -> None:
        async with graph:
            await asyncio.sleep(1000)

    graph, _ = graph_of(Talker, Failing)
    task = asyncio.create_task(block())
    asyncio.get_running_loop().call_at(0.3, task.cancel)
    await asyncio.wait([task])
    assert graph.failures
    assert task.cancelled()


@virtual_time
async def test_anyio_scope_ends_block_after_the_nodes():
    slow = Slow()
    graph, _ = graph_of(slow)
    with anyio.move_on_after(2):
        async with graph:
            await asyncio.sleep(1000)
    assert slow.stopped
    assert graph.report().nodes[0].state == "stopped"


@virtual_time
async def test_cancelled_start_leaves_no_nodes_running():
    async def with_asyncio(graph: Graph) -> None:
        async with asyncio.timeout(0.5), graph:
            raise AssertionError("it has not started")

    async def with_anyio(graph: Graph) -> None:
        with anyio.fail_after(0.5):
            async with graph:
                raise AssertionError("it has not started")

    for block in (with_asyncio, with_anyio):
        slow = Slow()
        graph, _ = graph_of(slow)
        with pytest.raises(TimeoutError):
            await block(graph)
        assert (slow.started, slow.stopped) == (False, True)
        assert graph.report().nodes[0].state == "stopped"


@virtual_time
async def test_failure_in_stop_is_raised_after_the_block(golden):
    class Leaking(Node):
        async def stop(self) -> None:
            raise OSError("cannot close")

    graph, _ = graph_of(Leaking)
    with golden.raises(NodeFailed):
        async with graph:
            pass
    assert asyncio.current_task().cancelling() == 0


@virtual_time
async def test_ended_graph_refuses_publish_and_subscribe(golden):
    graph, _ = graph_of(Talker)
    async with graph:
        graph.publish("numbers", Number(data=1))
    for use in (
        lambda: graph.publish("numbers", Number(data=1)),
        lambda: graph.publish("others", Number(data=1)),
        lambda: graph.subscribe(Number, "numbers"),
    ):
        with golden.raises(NotRunning):
            use()


def test_launch_logs_to_standard_error(monkeypatch):
    stream = io.StringIO()
    monkeypatch.setattr("sys.stderr", stream)

    class Chatty(Node):
        async def start(self) -> None:
            self.log.info("good morning")

    async def main() -> None:
        async with launch(Chatty):
            pass

    asyncio.run(main())
    assert "good morning" in stream.getvalue()


@pytest.mark.parametrize(("embedded", "level"), [(False, "warning"), (True, "debug")])
@virtual_time
async def test_topic_without_any_publisher_is_warned_about(embedded, level):
    log: list[LogRecord] = []
    async with Graph([Listener], clock=SimClock(), log_level="debug", sinks=(log.append,), embedded=embedded):
        pass
    assert [record.level for record in log if "has no publisher" in record.event] == [level]


def test_embedding_program_may_be_the_publisher(monkeypatch):
    stream = io.StringIO()
    monkeypatch.setattr("sys.stderr", stream)

    async def main() -> None:
        async with launch(Listener) as graph:
            graph.publish("numbers", Number(data=1))

    asyncio.run(main())
    assert stream.getvalue() == ""


def test_another_thread_may_be_the_first_to_publish():
    async def main() -> tuple[set[int], int]:
        threads: set[int] = set()

        class Watch(BusObserver):
            def publisher_added(self, _publisher: object) -> None:
                threads.add(threading.get_ident())

        async with launch(Listener) as graph:
            graph.bus.observe(Watch())

            def publish_from_there() -> None:
                for data in range(3):
                    graph.publish("numbers", Number(data=data))

            received = graph.subscribe(Number, "numbers")
            await asyncio.gather(*(asyncio.to_thread(publish_from_there) for _ in range(2)))
            assert sorted([(await anext(received)).data for _ in range(6)]) == [0, 0, 1, 1, 2, 2]
            return threads, len(graph.bus.topics["/numbers"].publishers)

    assert asyncio.run(main()) == ({threading.get_ident()}, 1)


@virtual_time
async def test_graph_starts_the_plan_it_returned():
    graph, _ = graph_of(Talker, Listener)
    assert graph.plan().errors == []
    async with graph:
        await asyncio.sleep(0.15)
    assert graph.node(Listener).received == [1]


@virtual_time
async def test_failing_sink_does_not_hide_a_failure():
    def broken(_record: LogRecord) -> None:
        raise KeyError("sink")

    graph = Graph([Talker, Failing, Listener], clock=SimClock(), sinks=(broken,))
    asyncio.get_running_loop().set_exception_handler(lambda *_: None)
    with pytest.raises(NodeFailed):
        async with graph:
            await asyncio.sleep(5)
    assert graph.exit_code is ExitCode.FAILED


@virtual_time
async def test_stop_before_start_stops_nothing():
    graph, _ = graph_of(Talker)
    await graph.stop()
    async with graph:
        assert graph.report().nodes[0].state == "running"


@virtual_time
async def test_end_asked_before_the_start_ends_it():
    graph = Graph([Talker()], clock=SimClock())
    graph.course.ask_to_stop_from_thread(ExitCode.TERMINATED)
    await graph.start()
    await graph.wait()
    assert graph.exit_code is ExitCode.TERMINATED


def test_end_asked_once_the_loop_is_closed_is_none():
    """A second signal may come at the very end, which another thread passes on."""
    made: list[Graph] = []

    async def run() -> None:
        made.append(Graph([Talker()]))
        async with made[0]:
            pass

    asyncio.run(run())
    made[0].course.ask_to_stop_from_thread(ExitCode.TERMINATED)
    assert made[0].exit_code is ExitCode.OK


@virtual_time
async def test_end_asked_before_the_start_ends_a_waiting_node_first():
    seen: list[str] = []

    class Needed(Node):
        async def start(self) -> None:
            await asyncio.Event().wait()

        async def stop(self) -> None:
            seen.append(graph.report().nodes[1].state)

    graph = Graph([Needed, supervised(Talker(), depends_on={"needed": "ready"})], clock=SimClock())
    graph.course.grace_s = 0.05
    graph.course.ask_to_stop_from_thread(ExitCode.TERMINATED)
    await graph.start()
    await graph.wait()
    assert seen == ["stopped"]


@virtual_time
async def test_run_without_last_moments_refuses_a_snapshot(golden):
    async with harness(Talker) as lab:
        with golden.raises(NoSuchTarget):
            lab.graph.snapshot()


class Lamp(Node):
    @service(Trigger, "~/toggle")
    def toggle(self, _request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=True)


class Turn(ActionType, package="my_robot"):
    class Goal(Message): ...

    class Result(Message): ...

    class Feedback(Message): ...


@virtual_time
async def test_program_uses_one_type_of_each_name(golden):
    async with harness(Lamp, Arm) as lab:
        assert (await lab.call(Trigger, "lamp/toggle")).success
        assert (await lab.call(Trigger, "lamp/toggle")).success
        with golden.raises(IncompatibleType):
            await lab.call(SetBool, "lamp/toggle")
        assert (await lab.run_action(MoveTo, "arm/move", MoveTo.Goal(angle=2.0))).angle == 2.0
        assert lab.action_client(MoveTo, "arm/move") is lab.action_client(MoveTo, "arm/move")
        with golden.raises(IncompatibleType):
            lab.action_client(Turn, "arm/move")
