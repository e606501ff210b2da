"""Following `/clock`: a run's time is what a simulator says, with ROS 2's rules where it is set back."""

import asyncio
import json
import subprocess
import sys
from pathlib import Path

import anyio
import pytest

from busflow import Duration, Node, publisher, timer
from busflow.clock import Time
from busflow.errors import Deadlock, IncompatibleType, NotRunning
from busflow.msgs.builtin_interfaces import Time as TimeMsg
from busflow.msgs.rosgraph_msgs import Clock
from busflow.msgs.std_msgs import Int64
from busflow.testing import harness, virtual_time

follows = virtual_time(follows=True)


class Ticker(Node):
    """Keeps the stamp of each of its ticks, one a second."""

    async def start(self) -> None:
        self.ticks: list[float] = []

    @timer(1)
    def tick(self) -> None:
        self.ticks.append(self.clock.now().nanoseconds / 1e9)


async def tell(lab, seconds):
    """Let the simulator say how late it is."""
    lab.publish("/clock", Clock(clock=Time(seconds=seconds).to_msg()))
    await lab.settle()


@follows
async def test_time_is_zero_before_the_first_message():
    """Case rcl_ros_clock/106."""
    async with harness(Ticker) as lab:
        await lab.settle()
        assert lab.clock.now() == Time(0)
        assert lab.node(Ticker).ticks == []


@follows
async def test_first_message_sets_stamps_without_passing_time():
    async with harness(Ticker) as lab:
        await tell(lab, 1000)
        assert lab.clock.now() == Time(seconds=1000)
        assert (lab.node(Ticker).ticks, lab.clock.seconds()) == ([], 0)
        await tell(lab, 1001)
        assert lab.node(Ticker).ticks == [1001]


@follows
async def test_source_sim_follows_clock():
    """Case source/sim_follows_clock: 0 to 4 s are published, and it is never earlier or later."""
    async with harness(Ticker) as lab:
        for second in range(5):
            await tell(lab, second)
            assert lab.clock.now() == Time(seconds=second)
        assert lab.node(Ticker).ticks == [1, 2, 3, 4]


@follows
async def test_forward_jump_fires_due_timers_once():
    """Case rcl/sim_wakes_wait."""
    async with harness(Ticker) as lab:
        await tell(lab, 0)
        await tell(lab, 3.5)
        assert lab.node(Ticker).ticks == [3.5]
        await tell(lab, 3.9)
        assert lab.node(Ticker).ticks == [3.5]
        await tell(lab, 4)
        assert lab.node(Ticker).ticks == [3.5, 4]
        (statistics,) = lab.graph.report().timers
        assert (statistics.fired, statistics.missed) == (2, 2)


@follows
async def test_each_step_back_is_reported():
    """Case source/backward_jump: 6, 5, 4, 3, 2 are published; each step back is told with its size."""
    async with harness(Ticker) as lab:
        jumps = []
        lab.clock.on_jump.append(jumps.append)
        for second in (6, 5, 4, 3, 2):
            await tell(lab, second)
        assert jumps == [Duration(seconds=-1)] * 4
        assert lab.node(Ticker).ticks == []
        assert lab.clock.now() == Time(seconds=2)


@follows
async def test_long_jump_back_restarts_the_timer():
    async with harness(Ticker) as lab:
        for second in (10, 11, 11.5, 5.25):
            await tell(lab, second)
        assert lab.node(Ticker).ticks == [11]
        await tell(lab, 6.2)
        assert lab.node(Ticker).ticks == [11]
        await tell(lab, 6.25)
        assert lab.node(Ticker).ticks == [11, 6.25]


@follows
async def test_short_jump_back_keeps_the_next_stamp():
    async with harness(Ticker) as lab:
        for second in (10, 11, 11.75, 11.5, 11.25, 11.9):
            await tell(lab, second)
        assert lab.node(Ticker).ticks == [11]
        await tell(lab, 12)
        assert lab.node(Ticker).ticks == [11, 12]


@follows
async def test_steps_back_add_up():
    async with harness(Ticker) as lab:
        for second in (10, 11, 11.5, 11.2, 10.9, 11.8):
            await tell(lab, second)
        assert lab.node(Ticker).ticks == [11], "11.5 to 10.9 is beyond the tick at 11, so the next one is at 11.9"
        await tell(lab, 11.9)
        assert lab.node(Ticker).ticks == [11, 11.9]


@follows
async def test_stopped_timer_ignores_jumps():
    async with harness(Ticker) as lab:
        await tell(lab, 10)
        lab.node(Ticker).tick.cancel()
        await tell(lab, 5)
        await tell(lab, 20)
        assert lab.node(Ticker).ticks == []
    assert lab.clock.on_jump == []


@follows
async def test_sleep_keeps_its_length_over_jumps():
    async with harness(Ticker) as lab:
        await tell(lab, 10)
        woken = []

        async def sleep():
            await asyncio.sleep(2)
            woken.append(("asyncio", lab.clock.now().sec))

        async def move_on():
            with anyio.move_on_after(3):
                await anyio.sleep_forever()
            woken.append(("anyio", lab.clock.now().sec))

        async def sleep_until():
            await lab.clock.sleep_until(Time(seconds=12))
            woken.append(("until", lab.clock.now().sec))

        async with asyncio.TaskGroup() as group:
            for each in (sleep, move_on, sleep_until):
                group.create_task(each())
            await lab.settle()
            for second in (11, 5, 6, 7, 11, 12):
                await tell(lab, second)
        assert woken == [("asyncio", 6), ("anyio", 7), ("until", 12)]


@follows
async def test_the_stamps_of_nodes_are_the_simulator_s():
    class Stamper(Node):
        stamps = publisher(TimeMsg, "stamps")

        @timer(0.5)
        def tick(self) -> None:
            self.stamps.publish(self.clock.now().to_msg())

    async with harness(Stamper) as lab:
        for second in (100, 100.5, 101):
            await tell(lab, second)
        assert [stamp.sec * 2 + stamp.nanosec // 500_000_000 for stamp in lab.received("stamps")] == [201, 202]


def wait_for_nobody():
    @follows
    async def main():
        async with harness(Ticker) as lab:
            await tell(lab, 1)
            await asyncio.sleep(1)

    with pytest.raises(Deadlock, match="simulator"):
        main()


def test_wait_without_a_simulator_is_a_deadlock():
    # In a process of its own: any thread that another test's fixture has started could be a simulator.
    script = "from test_following import wait_for_nobody; wait_for_nobody()"
    subprocess.run([sys.executable, "-c", script], check=True, timeout=60, cwd=Path(__file__).parent)


def test_a_clock_of_another_type_is_refused():
    class Wrong(Node):
        clocks = publisher(Int64, "/clock")

    @follows
    async def main():
        async with harness(Wrong):
            pass

    with pytest.raises(IncompatibleType, match="/clock carries std_msgs/msg/Int64"):
        main()


SIMULATOR = '''
"""A simulator that computes in a thread, at its own pace, and says how late it is."""

from busflow import Duration, Node, Time, publisher, timer
from busflow.msgs.rosgraph_msgs import Clock


class Simulator(Node):
    clocks = publisher(Clock, "/clock")

    async def run(self) -> None:
        now = Time(seconds=5000)
        while True:
            await self.run_sync(sum, range(10_000))
            now += Duration(seconds=0.05)
            self.clocks.publish(Clock(clock=now.to_msg()))


class Follower(Node):
    @timer(1)
    def tick(self) -> None:
        self.log.info("tick", second=self.clock.now().sec)
'''


def test_launch_file_follows_its_own_simulator_node(tmp_path):
    (tmp_path / "simulator.py").write_text(SIMULATOR)
    (tmp_path / "follow.yaml").write_text(
        "plugins: [.]\nclock:\n  mode: follow\n"
        "nodes:\n  simulator:\n    plugin: simulator:Simulator\n  follower:\n    plugin: simulator:Follower\n"
    )
    command = [sys.executable, "-m", "busflow", "run", "follow.yaml", "--for", "3s", "--log-format", "json"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert [json.loads(line)["second"] for line in done.stderr.splitlines()] == [5001, 5002, 5003]
    assert "of sim time" in done.stdout


def test_harness_of_following_file_needs_follows_option(tmp_path):
    (tmp_path / "simulator.py").write_text(SIMULATOR)
    path = tmp_path / "follow.yaml"
    path.write_text("plugins: [.]\nclock:\n  mode: follow\nnodes:\n  follower:\n    plugin: simulator:Follower\n")

    async def main():
        async with harness(path) as lab:
            await tell(lab, 7)
            return lab.clock.now()

    with pytest.raises(NotRunning, match=r"write @virtual_time\(follows=True\)"):
        virtual_time(main)()
    assert follows(main)() == Time(seconds=7)


@pytest.mark.parametrize("key", ["start: 5", "rate: 2"])
def test_what_a_simulator_decides_cannot_be_set(tmp_path, key, golden):
    from busflow.errors import LaunchError
    from busflow.launchfile.load.load import load

    (tmp_path / "follow.yaml").write_text(f"clock:\n  mode: follow\n  {key}\nnodes:\n  a:\n    plugin: b\n")
    with golden.raises(LaunchError):
        load(tmp_path / "follow.yaml")
