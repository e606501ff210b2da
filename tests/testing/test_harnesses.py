"""The harness: time passes as told, everything published is seen, and harm is done with the ledger still balanced."""

import asyncio
import socket

import anyio
import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow import Node, Parameters, QoS, publisher, subscription, timer
from busflow.bus.events import DeadlineMissed
from busflow.clock import SIM_EPOCH_NS
from busflow.errors import (
    BusflowError,
    Deadlock,
    IncompatibleType,
    InvalidDeclaration,
    InvalidParameter,
    LaunchError,
    NodeFailed,
    NotRunning,
    StartTimeout,
)
from busflow.msgs.std_msgs import Float64, Int64
from busflow.node.handlers import on_event
from busflow.testing import NotSeen, explore, harness, virtual_time
from plugins.sensor_processor import SensorProcessor
from plugins.sensor_publisher import SensorPublisher

LAB = "configs/lab1.yaml"


class CounterParameters(Parameters):
    rate_hz: float = 10.0


class Counter(Node):
    parameters: CounterParameters
    numbers = publisher(Int64, "numbers")

    async def start(self) -> None:
        self.count = 0

    @timer(hz="rate_hz")
    def tick(self) -> None:
        self.count += 1
        self.numbers.publish(Int64(data=self.count))


class Doubler(Node):
    doubles = publisher(Int64, "doubles")

    @subscription("numbers")
    def on_number(self, number: Int64) -> None:
        self.doubles.publish(Int64(data=2 * number.data))


class Slow(Node):
    """Takes 20 ms for each number."""

    done = publisher(Int64, "done")

    @subscription("numbers")
    async def on_number(self, number: Int64) -> None:
        await asyncio.sleep(0.02)
        self.done.publish(number)


class Sink(Node):
    async def start(self) -> None:
        self.got: list[int] = []

    @subscription("numbers")
    def on_number(self, number: Int64) -> None:
        self.got.append(number.data)


class PunctualCounter(Counter):
    numbers = publisher(Int64, "numbers", qos=QoS(deadline_s=0.25))


class Supervisor(Sink):
    """Hears of it when nothing comes for a quarter of a second."""

    async def start(self) -> None:
        await super().start()
        self.missed = 0

    @subscription("numbers", qos=QoS(deadline_s=0.25))
    def on_number(self, number: Int64) -> None:
        self.got.append(number.data)

    @on_event("numbers")
    def on_silence(self, event: DeadlineMissed) -> None:
        self.missed = event.count


class Fragile(Node):
    @subscription("numbers")
    def on_number(self, number: Int64) -> None:
        if number.data == 3:
            raise ArithmeticError("three is too much")


def data(messages):
    return [message.data for message in messages]


# Time


@virtual_time
async def test_ten_minutes_of_the_lab():
    async with harness(LAB, seed=1) as lab:
        await lab.advance(600)
        assert len(lab.received("balance_state")) == 6000
        assert lab.node(SensorProcessor).status == "All sensors operational"
        assert lab.node("sensor_processor") is lab.node(SensorProcessor)
        assert (lab.ledger.dropped, lab.ledger.queued) == (0, 0)
        assert lab.ledger.published == lab.ledger.delivered == 12_000
        assert lab.clock.seconds() == 600


@virtual_time
async def test_time_of_a_forgotten_harness_does_not_pass(golden):
    lab = harness(Counter)
    with golden.raises(NotRunning):
        await lab.advance(1)


@virtual_time
async def test_advance_includes_what_is_due_at_its_end():
    async with harness(Counter, Doubler) as lab:
        await lab.advance(0.3)  # 3 · 0.1 is a little more than 0.3 in floats
        assert data(lab.received("numbers")) == [1, 2, 3]
        assert data(lab.received("doubles")) == [2, 4, 6]


@virtual_time
async def test_advancing_adds_up_exactly():
    async with harness(Counter) as lab:
        for _ in range(10_000):
            await lab.advance(0.1)
        assert len(lab.received("numbers")) == 10_000
        assert lab.clock.seconds() == 1000


@virtual_time
async def test_longer_work_continues_in_the_next_advance():
    async with harness(Counter, Slow) as lab:
        await lab.advance(0.3)
        assert data(lab.received("done")) == [1, 2]
        await lab.advance(0.02)
        assert data(lab.received("done")) == [1, 2, 3]


@virtual_time
async def test_settling_moves_no_time():
    async with harness(Doubler) as lab:
        lab.publish("numbers", Int64(data=4))
        await lab.settle()
        assert data(lab.received("doubles")) == [8]
        assert lab.clock.seconds() == 0


@pytest.mark.parametrize("seconds", [-1, float("inf"), float("nan")])
def test_time_passes_forwards_and_by_a_finite_amount(seconds):
    @virtual_time
    async def main():
        async with harness(Counter) as lab:
            with pytest.raises(ValueError, match="forwards"):
                await lab.advance(seconds)

    main()


def test_without_virtual_time_there_is_no_harness(golden):
    async def main():
        with pytest.raises(NotRunning, match="@virtual_time"):
            harness(Counter)

    asyncio.run(main())
    with golden.raises(NotRunning):
        harness(Counter)


@virtual_time
async def test_plain_with_is_refused_in_words(golden):
    with golden.raises(NotRunning), harness(Counter):
        pass


# What happened


@virtual_time
async def test_one_node_alone_answers_what_the_test_publishes():
    async with harness(Doubler) as lab:
        lab.publish("numbers", Int64(data=21))
        assert (await lab.wait_for("doubles", Int64, timeout=1)).data == 42


@virtual_time
async def test_wait_for_returns_each_message_once():
    async with harness(Counter) as lab:
        await lab.advance(0.2)
        assert [(await lab.wait_for("numbers")).data for _ in range(3)] == [1, 2, 3]
        assert lab.clock.seconds() == pytest.approx(0.3)
        await lab.advance(0.2)
        assert (await lab.wait_for("numbers")).data == 4


@virtual_time
async def test_failed_wait_lists_publishers_and_waiting_tasks(golden):
    class Patient(Node):
        async def run(self) -> None:
            await asyncio.Event().wait()

    async with harness(Doubler, Counter(rate_hz=1), Patient) as lab:
        with pytest.raises(NotSeen) as caught:
            await lab.wait_for("doubles", timeout=0.5)
        text = str(caught.value)
        golden(text, mask={r"in \S+ at busflow/.*": "in busflow"})
        assert "await asyncio.Event().wait()" in text


@virtual_time
async def test_unknown_topic_is_reported_with_the_nearest_name(golden):
    async with harness(Counter) as lab:
        with golden.raises(NotSeen):
            lab.received("number")
        with golden.raises(IncompatibleType):
            await lab.wait_for("numbers", Float64)


@virtual_time
async def test_what_is_published_during_start_is_seen():
    class Early(Node):
        greeting = publisher(Int64, "greeting")

        async def start(self) -> None:
            self.greeting.publish(Int64(data=1))

    async with harness(Early) as lab:
        assert data(lab.received("greeting")) == [1]


@virtual_time
async def test_log_lines_keep_their_node():
    class Talker(Node):
        @timer(1)
        def tick(self) -> None:
            self.log.warning("tick", second=round(self.clock.seconds()))
            self.log.debug("unheard")

    async with harness(Talker) as lab:
        await lab.advance(2)
        assert [(line.node, line.level, line.event, line.values) for line in lab.log] == [
            ("/talker", "warning", "tick", {"second": 1}),
            ("/talker", "warning", "tick", {"second": 2}),
        ]
        assert lab.log[0].stamp_ns == SIM_EPOCH_NS + 10**9


@virtual_time
async def test_log_keeps_the_newest_lines():
    class Talker(Node):
        async def start(self) -> None:
            for number in range(10_003):
                self.log.info("line", number=number)

    async with harness(Talker) as lab:
        assert len(lab.log) == 10_000
        assert [lab.log[place].values["number"] for place in (0, -1)] == [3, 10_002]


@virtual_time
async def test_a_launch_file_takes_its_arguments():
    async with harness(LAB, args={"rate_hz": 50}) as lab:
        await lab.advance(1)
        assert len(lab.received("imu/data")) == 50


def test_seed_of_the_test_beats_the_environment(monkeypatch, golden):
    def seed_of(**options):
        @virtual_time
        async def main():
            async with harness(LAB, **options) as lab:
                return lab.graph.seed

        return main()

    assert seed_of() == 0
    monkeypatch.setenv("BUSFLOW_SEED", "7")
    assert (seed_of(), seed_of(seed=3)) == (7, 3)
    monkeypatch.setenv("BUSFLOW_SEED", "seven")
    with golden.raises(BusflowError):
        seed_of()


def test_another_order_keeps_the_nodes_seed(monkeypatch):
    """BUSFLOW_SEED is the order then; a run that it replays must not have other random numbers, too."""
    monkeypatch.setenv("BUSFLOW_SEED", "7")
    seeds = []

    @explore
    async def main():
        async with harness(LAB) as lab:
            seeds.append(lab.graph.seed)

    main()
    assert seeds == [0]


@virtual_time
async def test_keep_limits_messages_to_the_newest():
    async with harness(Counter, keep=3) as lab:
        await lab.advance(0.5)
        assert data(lab.received("numbers")) == [3, 4, 5]
        assert (await lab.wait_for("numbers")).data == 3
        await lab.advance(0.3)
        assert [(await lab.wait_for("numbers")).data for _ in range(4)] == [6, 7, 8, 9]


@virtual_time
async def test_messages_beyond_the_limit_are_asked_in_vain(golden):
    async with harness(Counter) as lab:
        await lab.advance(1000)
        assert len(lab.received("numbers")) == 10_000
        await lab.advance(0.1)
        with golden.raises(NotSeen):
            lab.received("numbers")
        with golden.raises(NotSeen):
            await lab.wait_for("numbers")


# Failures


def test_failing_node_fails_the_test(golden):
    reached = []

    @virtual_time
    async def main():
        async with harness(Counter, Fragile) as lab:
            await lab.advance(1)
            reached.append("the end")

    with golden.raises(NodeFailed):
        main()
    assert reached == []


@virtual_time
async def test_test_goes_on_after_an_expected_failure(golden):
    async with harness(Counter, Fragile, expect_failure=Fragile) as lab:
        await lab.advance(1)
        assert lab.graph.failures[0].node == "/fragile"
        golden(lab.log[-1].event)
        assert data(lab.received("numbers")) == [1, 2, 3]


def test_missing_expected_failure_fails_the_test(golden):
    @virtual_time
    async def main():
        async with harness(Counter, expect_failure=Counter) as lab:
            await lab.advance(1)

    with golden.raises(NotSeen):
        main()


def test_unexpected_failure_fails_the_test(golden):
    @virtual_time
    async def main():
        async with harness(Counter, Fragile, expect_failure=Counter) as lab:
            await lab.advance(1)

    with golden.raises(NotSeen):
        main()


def test_launch_error_is_no_expected_failure(golden):
    @virtual_time
    async def main():
        async with harness(Counter, Counter, expect_failure=Counter):
            pass

    with golden.raises(LaunchError):
        main()


def test_wrong_parameter_is_reported_before_the_run():
    with pytest.raises(InvalidParameter, match="rate"):
        harness(Counter(rate=3))


def test_error_of_the_test_is_the_one_raised():
    @virtual_time
    async def main():
        async with harness(Counter):
            raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        main()


def test_a_node_made_to_fail_fails_the_test(golden):
    @virtual_time
    async def main():
        async with harness(Counter) as lab:
            lab.fail(Counter, OSError("the cable is out"))
            await lab.advance(1)

    with golden.raises(NodeFailed):
        main()


@virtual_time
async def test_a_node_made_to_fail_as_expected():
    async with harness(Counter, Doubler, expect_failure="counter") as lab:
        await lab.advance(0.2)
        lab.fail("counter", OSError("the cable is out"))
        await lab.advance(1)
        assert data(lab.received("numbers")) == [1, 2]
        assert lab.ledger.published == lab.ledger.delivered == 2


# Faults


def balanced(lab):
    return all(line.published == line.delivered + line.dropped + line.queued for line in lab.ledger)


@virtual_time
async def test_lost_message_is_a_drop_with_reason():
    async with harness(Counter, Sink) as lab:
        lab.drop("numbers", every=3)
        await lab.advance(1)
        assert lab.node(Sink).got == [1, 2, 4, 5, 7, 8, 10]
        assert [line.drops for line in lab.ledger] == [{"injected": 3}]
        assert balanced(lab)
        assert len(lab.received("numbers")) == 10, "published they were"


@virtual_time
async def test_drop_counts_messages_from_its_call():
    async with harness(Counter, Sink) as lab:
        lab.drop("numbers", every=3)
        await lab.advance(0.2)
        lab.drop("numbers", every=3)
        await lab.advance(0.4)
        assert lab.node(Sink).got == [1, 2, 3, 4, 6]


@virtual_time
async def test_dropped_topic_misses_deadlines_until_healed():
    async with harness(PunctualCounter, Supervisor) as lab:
        await lab.advance(0.1)
        lab.drop("numbers")
        await lab.advance(0.5)
        assert (lab.node(Supervisor).got, lab.node(Supervisor).missed) == ([1], 2)
        lab.heal("numbers")
        await lab.advance(0.1)
        assert (lab.node(Supervisor).got, lab.node(Supervisor).missed) == ([1, 7], 2)


@virtual_time
async def test_delayed_messages_count_as_queued_and_stay_ordered():
    async with harness(Counter, Sink) as lab:
        lab.delay("numbers", 0.25)
        await lab.advance(0.3)
        assert (lab.node(Sink).got, lab.ledger.queued) == ([], 3)
        await lab.advance(0.05)
        assert (lab.node(Sink).got, lab.ledger.queued) == ([1], 2)
        lab.heal("numbers")
        await lab.advance(0.06)  # 4 is published at 0.4 s and overtakes neither 2 nor 3
        assert lab.node(Sink).got == [1]
        await lab.advance(0.14)
        assert (lab.node(Sink).got, lab.ledger.queued) == ([1, 2, 3, 4, 5], 0)
        assert balanced(lab)


@virtual_time
async def test_blocking_subscription_counts_delayed_messages():
    async with harness(Doubler) as lab:
        inbox = lab.subscribe(Int64, "doubles", qos=QoS(depth=2, overflow="block"))
        source = lab.advertise(Int64, "doubles")
        lab.delay("doubles", 1)
        await source.send(Int64(data=1))
        await source.send(Int64(data=2))
        with anyio.move_on_after(0.5) as patience:
            await source.send(Int64(data=3))
        assert patience.cancelled_caught
        assert (inbox.queued, inbox.full) == (2, True)
        await lab.advance(1)
        assert (await anext(inbox)).data == 1
        await source.send(Int64(data=3))
        assert [(await anext(inbox)).data for _ in range(2)] == [2, 3]


@virtual_time
async def test_late_subscription_gets_its_topic_s_faults():
    async with harness(Counter) as lab:
        lab.drop("numbers", every=2)
        late = lab.subscribe(Int64, "numbers")
        await lab.advance(0.4)
        assert [(await anext(late)).data for _ in range(2)] == [1, 3]


@virtual_time
async def test_delayed_messages_of_ended_subscription_stay_counted():
    async with harness(PunctualCounter, Supervisor) as lab:
        lab.delay("numbers", 0.25)
        await lab.advance(0.2)
    assert [(line.published, line.queued) for line in lab.ledger] == [(2, 2)]
    await lab.advance(1)
    assert [line.deadlines_missed for line in lab.ledger] == [0]


@pytest.mark.parametrize("every", [0, -1])
def test_a_fault_that_cannot_be_is_refused(every):
    @virtual_time
    async def main():
        async with harness(Counter) as lab:
            with pytest.raises(ValueError, match="every "):
                lab.drop("numbers", every=every)
            with pytest.raises(ValueError, match="finite"):
                lab.delay("numbers", -1)
            with pytest.raises(NotSeen, match="/numbers"):
                lab.delay("numberz", 1)

    main()


STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("advance"), st.sampled_from([0, 0.05, 0.1, 0.33])),
        st.tuples(st.just("delay"), st.sampled_from([0, 0.01, 0.25, 1])),
        st.tuples(st.just("drop"), st.integers(1, 4)),
        st.tuples(st.just("heal"), st.none()),
        st.tuples(st.just("publish"), st.integers(1, 30)),
    ),
    max_size=30,
)


@given(STEPS)
def test_the_ledger_is_balanced_after_whatever_harm(steps):
    @virtual_time
    async def main():
        async with harness(Counter, Sink, Slow, Doubler) as lab:
            for name, value in steps:
                if name == "advance":
                    await lab.advance(value)
                elif name == "delay":
                    lab.delay("numbers", value)
                elif name == "drop":
                    lab.drop("numbers", every=value)
                elif name == "heal":
                    lab.heal("numbers")
                else:
                    for _ in range(value):
                        lab.publish("numbers", Int64(data=0))
                assert balanced(lab)

    main()


@virtual_time
async def test_publish_without_receiver_names_the_nearest_topic(golden):
    async with harness(Doubler) as lab:
        with pytest.raises(NotSeen) as typo:
            lab.publish("number", Int64(data=4))
        golden(str(typo.value))
        with golden.raises(NotSeen):  # a node publishes there, and nobody receives
            lab.publish("doubles", Int64(data=4))
        lab.advertise(Int64, "number").publish(Int64(data=4))
        assert data(lab.received("number")) == [4]


@virtual_time
async def test_subscribe_refuses_a_misspelt_topic(golden):
    async with harness(Doubler) as lab:
        with golden.raises(NotSeen):
            lab.subscribe(Int64, "doublse")


@virtual_time
async def test_publish_reaches_own_and_later_subscriptions():
    async with harness(Doubler) as lab:
        own = lab.subscribe(Int64, "own")
        lab.publish("own", Int64(data=1))
        lab.node(Doubler).create_subscription(Int64, "late")
        lab.publish("late", Int64(data=2))
        await lab.settle()
        assert (own.latest, data(lab.received("late"))) == (Int64(data=1), [2])


@virtual_time
async def test_the_stamps_jump_and_time_does_not():
    async with harness(SensorPublisher) as lab:
        await lab.advance(1)
        before = await stamp(lab)
        lab.jump(-5)
        await lab.advance(0.1)
        assert await stamp(lab) - before == -4_900_000_000
        assert len(lab.received("imu/data")) == 11
        assert lab.clock.seconds() == pytest.approx(1.1)


async def stamp(lab):
    newest = lab.received("imu/data")[-1].header.stamp
    return newest.sec * 10**9 + newest.nanosec


# Limits in real time


@virtual_time
async def test_a_start_may_take_hours_of_virtual_time():
    class Warm(Node):
        async def start(self) -> None:
            await self.clock.sleep(7200)

        async def stop(self) -> None:
            await self.clock.sleep(7200)

    async with harness(Warm) as lab:
        assert lab.clock.seconds() == 7200
    assert lab.log == [], "stop was not given up"
    assert lab.clock.seconds() == 14400


@virtual_time
async def test_harness_waits_for_a_start_in_real_time():
    ours, theirs = socket.socketpair()
    ours.setblocking(False)

    class Driver(Node):
        async def start(self) -> None:
            loop = asyncio.get_running_loop()
            late = asyncio.ensure_future(asyncio.to_thread(theirs.send, b"ready"))
            assert await loop.sock_recv(ours, 5) == b"ready"
            await late

    with ours, theirs:
        async with harness(Driver):
            pass


def test_endless_start_is_a_deadlock_at_once(golden):
    class Forever(Node):
        async def start(self) -> None:
            await asyncio.Event().wait()

    @virtual_time
    async def main():
        async with harness(Forever):
            pass

    with golden.raises(NodeFailed) as caught:
        main()
    assert isinstance(caught.value.__cause__, StartTimeout)


@virtual_time
async def test_endless_stop_does_not_keep_others_from_stopping(golden):
    stopped = []

    class Stuck(Node):
        async def stop(self) -> None:
            await asyncio.Event().wait()

    class Clean(Node):
        async def stop(self) -> None:
            stopped.append("clean")

    lab = harness(Clean, Stuck)
    with golden.raises(NodeFailed):
        async with lab:
            pass
    assert stopped == ["clean"]
    assert [line.node for line in lab.log] == ["/stuck"]


def test_endless_wait_is_a_deadlock_with_names():
    @virtual_time
    async def main():
        async with harness(Doubler):
            await asyncio.Event().wait()

    with pytest.raises(Deadlock, match=r"asyncio.Event\(\).wait\(\)"):
        main()


@virtual_time
async def test_swapped_topic_and_type_are_explained(golden):
    async with harness(Counter, Doubler) as lab:
        for publish in (lab.publish, lab.graph.publish):
            with golden.raises(InvalidDeclaration):
                publish(Int64(data=1), "numbers")
            with golden.raises(IncompatibleType):
                publish("numbers", 1.0)
        with golden.raises(InvalidDeclaration):
            lab.received(Int64, "numbers")
        with golden.raises(InvalidDeclaration):
            lab.subscribe("numbers", Int64)
