"""Exploration: races that a plain run misses are found, replayed alone, and told by the order that matters."""

import asyncio
import random
import re
import subprocess
import sys
from pathlib import Path

import pytest

from busflow import Node, publisher, subscription, timer
from busflow.errors import BusflowError, InvalidDeclaration, NodeFailed
from busflow.msgs.std_msgs import Int64
from busflow.runner.loops.schedule import Lever, Schedule
from busflow.runner.loops.virtual import VirtualLoop
from busflow.runner.loops.virtual_test import run_virtual
from busflow.testing import explore, harness, virtual_time
from busflow.testing.exploration import minimised


class Sensors(Node):
    """Publishes a body's turn and its joints, in this order."""

    imu = publisher(Int64, "imu/data")
    joints = publisher(Int64, "joint_states")

    async def start(self) -> None:
        self.count = 0

    @timer(0.1)
    def tick(self) -> None:
        self.count += 1
        self.imu.publish(Int64(data=self.count))
        self.joints.publish(Int64(data=self.count))


class Fusion(Node):
    """Wrong: takes for granted that the IMU's message of a tick comes before the joints'."""

    async def start(self) -> None:
        self.newest = 0

    @subscription("imu/data")
    def on_imu(self, number: Int64) -> None:
        self.newest = number.data

    @subscription("joint_states")
    def on_joints(self, number: Int64) -> None:
        assert self.newest == number.data, "the joints were first"


async def assumed_order_of_two_topics():
    async with harness(Sensors, Fusion) as lab:
        await lab.advance(0.5)


class Account(Node):
    """Wrong: reads its total before an await and writes it afterwards."""

    async def start(self) -> None:
        self.total = 0

    @subscription("imu/data")
    async def on_imu(self, _number: Int64) -> None:
        await self.add()

    @subscription("joint_states")
    async def on_joints(self, _number: Int64) -> None:
        for _ in range(5):  # it is some steps behind, so in the plain order the other one has long finished
            await asyncio.sleep(0)
        await self.add()

    async def add(self) -> None:
        seen = self.total
        await asyncio.sleep(0)
        self.total = seen + 1


async def lost_update_across_an_await():
    async with harness(Sensors, Account) as lab:
        await lab.advance(0.5)
        assert lab.node(Account).total == 10


def listener(name, order):
    class Listener(Node):
        @subscription("imu/data")
        def on_imu(self, _number: Int64) -> None:
            order.append(name)

    return Listener(name=name)


async def one_order_of_five_handlers():
    order = []
    async with harness(Sensors, *(listener(name, order) for name in "abcde")) as lab:
        for _ in range(5):
            order.clear()
            await lab.advance(0.1)
            assert "".join(order) != "dbeac", "the one order of 120 that breaks it"


class First(Node):
    first = publisher(Int64, "first")

    @timer(0.1)
    def tick(self) -> None:
        self.first.publish(Int64())


class Second(Node):
    second = publisher(Int64, "second")

    @timer(0.1)
    def tick(self) -> None:
        self.second.publish(Int64())


class Latch(Node):
    """Wrong: takes for granted that of two nodes' timers of one period the first node's comes first."""

    async def start(self) -> None:
        self.armed = False

    @subscription("first")
    def on_first(self, _message: Int64) -> None:
        self.armed = True

    @subscription("second")
    def on_second(self, _message: Int64) -> None:
        assert self.armed
        self.armed = False


async def assumed_order_of_two_timers():
    async with harness(First, Second, Latch) as lab:
        await lab.advance(0.5)


RACES = [
    assumed_order_of_two_topics,
    lost_update_across_an_await,
    one_order_of_five_handlers,
    assumed_order_of_two_timers,
]


def found(test, **options):
    """The failure that exploring a test ends with."""
    with pytest.raises((AssertionError, NodeFailed)) as caught:
        explore(schedules=300, **options)(test)()
    return caught.value


@pytest.mark.parametrize("race", RACES)
def test_a_plain_run_misses_the_race(race):
    for _ in range(20):
        virtual_time(race)()


@pytest.mark.parametrize("race", RACES)
def test_exploring_finds_the_race(race, monkeypatch, golden):
    error = found(race)
    seed = error.__notes__[0].split("BUSFLOW_SEED=")[1].split()[0]
    golden(error.__notes__[0])
    monkeypatch.setenv("BUSFLOW_SEED", seed)
    assert found(race).__notes__ == error.__notes__
    monkeypatch.setenv("BUSFLOW_SEED", "0")
    explore(race)()


WHAT_MATTERS = {
    assumed_order_of_two_topics: ["`/joint_states` before `/imu/data`"],
    assumed_order_of_two_timers: ["the timer `tick` of `/second` before the timer `tick` of `/first`"],
    lost_update_across_an_await: [
        "the task `/account.Account.on_joints` before the task `/account.Account.on_imu`",
    ],
    one_order_of_five_handlers: ["`/d` before `/a` and `/b` and `/c`", "`/b` before `/a`", "`/e` before `/a` and `/c`"],
}


@pytest.mark.parametrize("race", RACES)
def test_choices_that_matter_are_reported_briefly(race):
    text = [
        re.sub(r"^what matters of it: |^  then |( at t = 0\.\d s)( \(5 times\))?$", "", note) for note in notes(race)
    ]
    assert text == WHAT_MATTERS[race]


def notes(race):
    return found(race).__notes__[1:]


class OfDeliveries(Schedule):
    """Varies only what the dispatcher asks."""

    def step(self, _ready):
        return 0


class OfTasks(Schedule):
    """Varies only what the loop asks."""

    def pick(self, _ready):
        return 0

    def share(self, most):
        return most

    def rests(self):
        return False


@pytest.mark.parametrize(
    ("race", "lever", "other"),
    [
        (assumed_order_of_two_topics, OfDeliveries, OfTasks),
        (one_order_of_five_handlers, OfDeliveries, OfTasks),
        (lost_update_across_an_await, OfTasks, OfDeliveries),
        (assumed_order_of_two_timers, OfTasks, OfDeliveries),
    ],
)
def test_each_lever_finds_what_the_other_one_cannot(race, lever, other):
    def failures(kind):
        return sum(_fails(race, kind(seed)) for seed in range(1, 101))

    assert failures(lever) > 0
    assert failures(other) == 0


def _fails(race, schedule):
    try:
        run_virtual(race(), name="race", loop=VirtualLoop(schedule=schedule))
    except (AssertionError, NodeFailed):
        return True
    return False


def test_what_is_right_holds_under_every_order():
    runs = []

    @explore(schedules=50)
    async def test():
        runs.append(1)
        async with harness(Sensors, *(listener(name, []) for name in "abc")) as lab:
            await lab.advance(0.5)
            assert lab.ledger.published == lab.ledger.delivered == 15

    test()
    assert len(runs) == 50


def test_failure_under_plain_order_is_reported_at_once(golden):
    runs = []

    @explore
    async def test():
        runs.append(1)
        pytest.fail("always")

    with pytest.raises(pytest.fail.Exception, match="always") as caught:
        test()
    golden("\n".join(caught.value.__notes__))
    assert runs == [1]


def test_a_test_that_is_skipped_is_skipped():
    @explore
    async def test():
        pytest.skip("not here")

    with pytest.raises(pytest.skip.Exception):
        test()


def test_unrepeatable_failure_is_reported_as_such(golden):
    flips = iter([0] * 3 + [1] + [0] * 1000)

    @explore
    async def test():
        assert next(flips) == 0

    with pytest.raises(AssertionError) as caught:
        test()
    golden(caught.value.__notes__[1])


def test_the_arguments_reach_the_test():
    seen = []

    @explore(schedules=2)
    async def test(tmp_path, *, name):
        seen.append((tmp_path, name))

    test("here", name="me")
    assert seen == [("here", "me")] * 2
    assert test.__name__ == "test"


def test_no_order_at_all_is_refused(golden):
    with golden.raises(InvalidDeclaration):
        explore(schedules=0)


def test_a_seed_that_is_none_is_refused(monkeypatch, golden):
    monkeypatch.setenv("BUSFLOW_SEED", "-1")
    with golden.raises(BusflowError):
        explore(assumed_order_of_two_topics)()


@pytest.mark.long
def test_the_same_order_in_every_process():
    root = Path(__file__).parents[2]
    program = "from tests.testing.test_exploration import *; print([found(race).__notes__ for race in RACES[:2]])"
    outputs = {
        subprocess.run(
            [sys.executable, "-c", program], cwd=root, env={"PYTHONHASHSEED": seed}, capture_output=True, check=True
        ).stdout
        for seed in ("0", "1")
    }
    assert len(outputs) == 1


@pytest.mark.parametrize("seed", range(30))
def test_minimising_keeps_what_is_needed_and_nothing_else(seed):
    rng = random.Random(seed)
    recorded = Schedule(record=True)
    recorded.choices = {(number, Lever.PICK, 1): rng.randint(1, 9) for number in range(rng.randint(3, 100))}
    needed = set(rng.sample(list(recorded.choices), k=3))

    def fails(fewer):
        schedule = Schedule(record=True)
        schedule.choices = dict(fewer)
        return schedule if needed <= fewer.keys() else None

    assert set(minimised(recorded, fails).choices) == needed
