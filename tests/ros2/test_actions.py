"""Actions between a run and nodes of ROS 2 that keep to the sources of `rcl_action` and `rmw_zenoh`."""

import asyncio
from collections.abc import Callable
from typing import Any
from uuid import UUID

import pytest

from busflow import (
    ActionGone,
    GoalCanceled,
    GoalRejected,
    Node,
    RunningGoal,
    action,
    action_client,
    launch,
)
from busflow.cli import main
from busflow.msgs.example_interfaces import Fibonacci
from tests.golden import Golden
from tests.ros2.rmw_action import (
    CANCELED,
    CANCELING,
    EXECUTING,
    SUCCEEDED,
    FibonacciClient,
    FibonacciServer,
)
from tests.ros2.rmw_node import RmwNode
from tests.ros2.sessions import PATIENCE_S, arrived, free_port, rmw_session, ros2_at, until

GOAL, OTHER = bytes(range(16)), bytes(range(16, 32))
FOR_EVER = 1000


class Counter(Node):
    """Counts up to a goal's order once it may, and for ever for a large one."""

    async def start(self) -> None:
        self.may_count = asyncio.Event()

    @action(Fibonacci, "/count", when_busy="parallel")
    async def count(self, goal: RunningGoal[Fibonacci]) -> Fibonacci.Result:
        await self.may_count.wait()
        sequence: list[int] = []
        while len(sequence) < goal.request.order:
            sequence.append(len(sequence))
            goal.feedback(Fibonacci.Feedback(sequence=sequence))
            await asyncio.sleep(1 if goal.request.order == FOR_EVER else 0)
        return Fibonacci.Result(sequence=sequence)

    @count.accepts
    def is_small(self, request: Fibonacci.Goal) -> bool:
        return 0 <= request.order <= FOR_EVER


class Boss(Node):
    count = action_client(Fibonacci, "/count")


def to_loop(queue: asyncio.Queue[Any]) -> Callable[..., None]:
    """A function for Zenoh's threads that puts its arguments into a queue of the loop."""
    loop = asyncio.get_running_loop()
    return lambda *items: loop.call_soon_threadsafe(queue.put_nowait, items if len(items) > 1 else items[0])


async def in_thread(act: Callable[..., Any], *arguments: Any) -> Any:
    async with asyncio.timeout(PATIENCE_S):
        return await asyncio.to_thread(act, *arguments)


async def client_of(session: Any, events: asyncio.Queue[Any], *, humble: bool = False) -> FibonacciClient:
    """An action client of ROS 2 that sees busflow's server."""
    ros = RmwNode(session, "ros", humble=humble)
    for part in ("send_goal", "get_result", "cancel_goal"):
        await in_thread(ros.sees, "/SS/", f"%count%_action%{part}/")
    for part in ("feedback", "status"):
        await in_thread(ros.sees, "/MP/", f"%count%_action%{part}/")
    return FibonacciClient(ros, "/count", to_loop(events))


async def until_state(events: asyncio.Queue[Any], goal: bytes, state: int) -> list[Any]:
    """The events until a goal is in a state, that one included."""
    found: list[Any] = []
    while not found or found[-1][0] != "status" or found[-1][1].get(goal) != state:
        found.append(await arrived(events))
    return found


@pytest.mark.asyncio
@pytest.mark.parametrize("humble", [False, True])
async def test_a_client_of_ros2_gets_feedback_and_result(humble: bool):
    port, events = free_port(), asyncio.Queue[Any]()
    async with launch(ros2_at(port), Counter, inspect="counted") as graph:
        with rmw_session(port) as session:
            client = await client_of(session, events, humble=humble)
            assert await in_thread(client.send, GOAL, 3)
            await until_state(events, GOAL, EXECUTING)
            waiting = asyncio.create_task(in_thread(client.result, GOAL))
            graph.node(Counter).may_count.set()
            assert await waiting == (SUCCEEDED, [0, 1, 2])
            seen = [await arrived(events) for _ in range(4)]  # each topic has a thread of its own
            assert ("status", {GOAL: SUCCEEDED}) in seen
            assert [each for each in seen if each[0] == "feedback"] == [
                ("feedback", GOAL, list(range(length))) for length in (1, 2, 3)
            ]
            assert await in_thread(client.result, GOAL) == (SUCCEEDED, [0, 1, 2]), "it is kept for a while"
            assert not await in_thread(client.send, GOAL, 3), "the identifier was sent already"
            assert not await in_thread(client.send, OTHER, -1)


@pytest.mark.asyncio
async def test_a_client_of_ros2_cancels_goals():
    port, events = free_port(), asyncio.Queue[Any]()
    async with launch(ros2_at(port), Counter, inspect="counted") as graph:
        graph.node(Counter).may_count.set()
        with rmw_session(port) as session:
            client = await client_of(session, events)
            assert await in_thread(client.cancel, GOAL) == (2, []), "ERROR_UNKNOWN_GOAL_ID"
            assert await in_thread(client.result, GOAL) == (0, []), "STATUS_UNKNOWN"
            for goal in (GOAL, OTHER):
                assert await in_thread(client.send, goal, FOR_EVER)
            assert await in_thread(client.cancel, GOAL) == (0, [GOAL])
            assert await in_thread(client.result, GOAL) == (CANCELED, [])
            seen = [each[1] for each in await until_state(events, GOAL, CANCELED) if each[0] == "status"]
            assert CANCELING in [each.get(GOAL) for each in seen]
            assert await in_thread(client.cancel, GOAL) == (3, []), "ERROR_GOAL_TERMINATED"
            assert await in_thread(client.cancel) == (0, [OTHER]), "zeros mean all goals"
            assert (await in_thread(client.result, OTHER))[0] == CANCELED


@pytest.mark.asyncio
async def test_a_goal_outlives_its_client_of_ros2():
    port, events = free_port(), asyncio.Queue[Any]()
    async with launch(ros2_at(port), Counter, inspect="counted") as graph:
        counter, services = graph.node(Counter), graph.bus.services
        with rmw_session(port) as session:
            client = await client_of(session, events)
            assert await in_thread(client.send, GOAL, 3)
            asking = asyncio.create_task(in_thread(client.result, GOAL))
            (goal,) = counter.count.goals
            await until(lambda: goal.asked)
        with pytest.raises(ValueError, match="unpack"):
            await asking  # its session is closed: no answer
        await until(lambda: not services["/count/_action/send_goal"].clients)
        with rmw_session(port) as session:
            client = await client_of(session, events)
            assert counter.count.goals == (goal,)
            counter.may_count.set()
            assert await in_thread(client.result, GOAL) == (SUCCEEDED, [0, 1, 2])


@pytest.mark.asyncio
async def test_goals_reach_a_server_of_ros2():
    port, goals = free_port(), asyncio.Queue[Any]()
    async with launch(ros2_at(port), Boss, inspect="boss") as graph:
        boss = graph.node(Boss)
        with rmw_session(port) as session:
            server = FibonacciServer(RmwNode(session, "ros"), "/count", to_loop(goals))
            await boss.count.ready(timeout=PATIENCE_S)
            await until(lambda: graph.bus.topics["/count/_action/feedback"].publishers)
            async with boss.count.send(Fibonacci.Goal(order=3), timeout=PATIENCE_S) as going:
                goal, order = await arrived(goals)
                assert (goal, order) == (going.id.bytes, 3)
                server.feedback(OTHER, [9])
                server.feedback(goal, [0, 1])
                assert (await anext(going)).sequence.tolist() == [0, 1]
                server.finish(goal, SUCCEEDED, [0, 1, 2])
                assert (await going.result()).sequence.tolist() == [0, 1, 2]
            with pytest.raises(GoalRejected):
                await boss.count.run(Fibonacci.Goal(order=-1), timeout=PATIENCE_S)
            async with boss.count.send(Fibonacci.Goal(order=4), timeout=PATIENCE_S) as going:
                goal, _ = await arrived(goals)
                assert await going.cancel()
                assert server.states[goal] == CANCELING
                server.finish(goal, CANCELED, [7])
                with pytest.raises(GoalCanceled) as caught:
                    await going.result()
                assert caught.value.result.sequence.tolist() == [7]
                assert not await going.cancel(), "ERROR_GOAL_TERMINATED"
            async with boss.count.send(Fibonacci.Goal(order=5), timeout=PATIENCE_S):
                goal, _ = await arrived(goals)
            await until(lambda: server.states[goal] == CANCELING)
        ends = boss.count.statistics()
        assert (ends.succeeded, ends.rejected, ends.canceled, ends.left) == (1, 1, 1, 1)


@pytest.mark.asyncio
@pytest.mark.parametrize("accepted", [True, False])
async def test_a_goal_ends_with_its_server_of_ros2(accepted: bool, golden: Golden):
    port, goals = free_port(), asyncio.Queue[Any]()
    async with launch(ros2_at(port), Boss, inspect="boss") as graph:
        boss, take = graph.node(Boss), to_loop(goals)
        with rmw_session(port) as session:
            ros = RmwNode(session, "ros")

            def on_goal(goal: bytes, order: int) -> None:
                if not accepted:
                    ros.leave()
                take(goal, order)

            server = FibonacciServer(ros, "/count", on_goal)
            await boss.count.ready(timeout=PATIENCE_S)
            running = asyncio.create_task(boss.count.run(Fibonacci.Goal(order=3), timeout=PATIENCE_S))
            goal, _ = await arrived(goals)
            if accepted:
                await until(lambda: server.is_asked_for(goal))
                ros.leave()
            with golden.raises(ActionGone):
                await running


@pytest.mark.asyncio
@pytest.mark.parametrize("humble", [False, True])
async def test_commands_send_goals_to_a_server_of_ros2(capsys: pytest.CaptureFixture[str], humble: bool):
    port, goals = free_port(), asyncio.Queue[Any]()
    async with launch(ros2_at(port), Boss, inspect="boss") as graph:
        with rmw_session(port) as session:
            server = FibonacciServer(RmwNode(session, "ros", humble=humble), "/count", to_loop(goals))
            await graph.node(Boss).count.ready(timeout=PATIENCE_S)
            words = ["action", "send_goal", "-f", "--run", "boss", "/count", "example_interfaces/action/Fibonacci"]
            sending = asyncio.create_task(in_thread(main, [*words, "{order: 3}"]))
            goal, _ = await arrived(goals)
            server.feedback(goal, [0, 1])
            server.finish(goal, SUCCEEDED, [0, 1, 2])
            assert await sending == 0
            assert "SUCCEEDED" in capsys.readouterr().out
            sending = asyncio.create_task(in_thread(main, [*words, "{order: 4}"]))
            goal, _ = await arrived(goals)
            assert await in_thread(main, ["action", "cancel", "--run", "boss", "/count", str(UUID(bytes=goal))]) == 0
            server.finish(goal, CANCELED)
            assert await sending == 1
            assert await in_thread(main, ["action", "goals", "--run", "boss", "/count"]) == 0
            assert "SUCCEEDED" in (out := capsys.readouterr().out)
            assert "CANCELED" in out
