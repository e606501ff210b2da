"""A client learns of each end of its goals, and leaves none behind."""

import asyncio

import pytest

from busflow import (
    ActionGone,
    ActionUnavailable,
    GoalAborted,
    Node,
    RunningGoal,
    ServiceFailed,
    action,
    action_client,
    client,
    service,
)
from busflow.errors import IncompatibleType, NotRunning
from busflow.msgs.std_srvs import Trigger
from busflow.testing import harness, virtual_time
from tests.actions.conftest import Arm, Boss, MoveTo, balanced


@virtual_time
async def test_two_tasks_share_the_feedback():
    async with harness(Arm, Boss) as lab, lab.node(Boss).move.send(MoveTo.Goal(angle=4)) as going:
        readers = [asyncio.ensure_future(anext(going)) for _ in range(2)]
        await lab.advance(2)
        assert [each.result().left for each in readers] == [3, 2]


@virtual_time
async def test_feedback_of_other_goals_is_not_seen():
    class Twins(Arm):
        @action(MoveTo, "~/move", when_busy="parallel")
        async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
            for _ in range(3):
                await self.clock.sleep(1)
                goal.feedback(MoveTo.Feedback(left=goal.request.angle))
            return MoveTo.Result()

    async with harness(Twins(name="arm"), Boss) as lab:
        move = lab.node(Boss).move
        async with move.send(MoveTo.Goal(angle=1)) as one, move.send(MoveTo.Goal(angle=2)) as two:
            assert [each.left async for each in two] == [2, 2, 2]
            assert [each.left async for each in one] == [1, 1, 1]


@virtual_time
async def test_flood_of_feedback_drops_and_counts():
    class Chatty(Arm):
        async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
            for left in range(5000):
                goal.feedback(MoveTo.Feedback(left=left))
                if left % 5 == 0:
                    await asyncio.sleep(0)
            return MoveTo.Result()

    async with harness(Chatty(name="arm"), Boss) as lab:
        async with lab.node(Boss).move.send(MoveTo.Goal(), depth=3) as going:
            await lab.advance(1)
            assert [each.left async for each in going] == [4997, 4998, 4999]
        (line,) = [each for each in lab.ledger if each.topic.endswith("/feedback")]
        assert line.published == line.delivered + line.dropped == 5000
        assert lab.node(Boss).move.statistics().feedback_dropped == line.delivered - 3


@virtual_time
async def test_leaving_the_block_cancels():
    async with harness(Arm, Boss) as lab:
        with pytest.raises(KeyError):
            async with lab.node(Boss).move.send(MoveTo.Goal(angle=9)):
                raise KeyError
        await lab.settle()
        assert lab.node(Arm).move.statistics().canceled == 1
        assert lab.node(Boss).move.statistics().left == 1
        assert balanced(lab)


@virtual_time
async def test_cancelled_task_cancels_its_goal():
    async with harness(Arm, Boss) as lab:
        task = asyncio.ensure_future(lab.node(Boss).move.run(MoveTo.Goal(angle=9)))
        await lab.advance(1)
        task.cancel()
        await lab.settle()
        assert lab.node(Arm).move.statistics().canceled == 1
        assert balanced(lab)


@virtual_time
async def test_task_cancelled_while_sending_leaves_none():
    async with harness(Arm, Boss) as lab:
        for turns in range(6):
            task = asyncio.ensure_future(lab.node(Boss).move.run(MoveTo.Goal(angle=9)))
            for _ in range(turns):
                await asyncio.sleep(0)
            task.cancel()
            await lab.settle()
            assert lab.node(Arm).move.goals == ()
        assert balanced(lab)


@virtual_time
async def test_limit_on_a_result_ends_no_goal():
    async with harness(Arm, Boss) as lab, lab.node(Boss).move.send(MoveTo.Goal(angle=4)) as going:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1):
                await going.result()
        assert (await going.result()).angle == 4


@virtual_time
async def test_cancel_of_an_ended_goal_is_false():
    async with harness(Arm, Boss) as lab, lab.node(Boss).move.send(MoveTo.Goal(angle=1)) as going:
        await going.result()
        assert not await going.cancel()
        assert (await going.result()).angle == 1


@virtual_time
async def test_missing_server_is_said_at_once():
    async with harness(Boss) as lab:
        with pytest.raises(ActionUnavailable, match=r"^/arm/move "):
            await lab.node(Boss).move.run(MoveTo.Goal())
        with pytest.raises(ActionUnavailable):
            await lab.node(Boss).move.ready(timeout=1)
        assert lab.clock.seconds() == 1
        assert lab.node(Boss).move.statistics().lost == 1


class Leaving(Node):
    """Accepts a goal, and ends before its client knows."""

    @action(MoveTo, "/arm/move")
    async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
        raise NotImplementedError

    @move.accepts
    def leave(self, _: MoveTo.Goal) -> bool:
        asyncio.get_running_loop().call_soon(self.move.endpoints.results.close)
        return True


@virtual_time
async def test_server_gone_after_accepting_is_said():
    async with harness(Leaving, Boss) as lab:
        with pytest.raises(ActionGone, match=r"^/arm/move: "):
            await lab.node(Boss).move.run(MoveTo.Goal())


@virtual_time
async def test_goal_of_another_type_is_refused():
    async with harness(Arm, Boss) as lab:
        with pytest.raises(IncompatibleType, match=r"^Boss.move .* /arm/move .* my_robot/action/MoveTo_Goal, .* 3$"):
            await lab.node(Boss).move.run(3)


@virtual_time
async def test_result_is_known_in_the_block_only(golden):
    async with harness(Arm, Boss) as lab:
        going = lab.node(Boss).move.send(MoveTo.Goal())
        with golden.raises(NotRunning):
            await going.result()
        async with going:
            await going.result()
        with golden.raises(NotRunning):
            async with going:
                pass


@virtual_time
async def test_circle_of_goal_and_call_is_named(golden):
    class Circular(Node):
        move = action_client(MoveTo, "~/move_it")
        ask = client(Trigger, "~/ask")

        @action(MoveTo, "~/move_it")
        async def move_it(self, _goal: RunningGoal[MoveTo]) -> MoveTo.Result:
            await self.ask.call(timeout=None)
            return MoveTo.Result()

        @service(Trigger, "~/ask")
        async def on_ask(self, _request: Trigger.Request) -> Trigger.Response:
            await self.move.run(MoveTo.Goal())
            return Trigger.Response()

    async with harness(Circular) as lab:
        with golden.raises(ServiceFailed):
            await lab.call(Trigger, "circular/ask", timeout=None)
        assert balanced(lab)


@virtual_time
async def test_goal_behind_itself_is_a_deadlock():
    class Recursive(Node):
        again = action_client(MoveTo, "~/move")

        @action(MoveTo, "~/move", when_busy="queue")
        async def move(self, _goal: RunningGoal[MoveTo]) -> MoveTo.Result:
            return await self.again.run(MoveTo.Goal())

    async with harness(Recursive) as lab:
        with pytest.raises(GoalAborted, match="DeadlockError"):
            await lab.node(Recursive).again.run(MoveTo.Goal())


def identifiers(seed):
    """The identifiers of a boss's first goals in a run with a seed."""
    found = []

    @virtual_time
    async def drawn():
        async with harness(Arm, Boss, seed=seed) as lab:
            found.extend(str(lab.node(Boss).move.send(MoveTo.Goal()).id) for _ in range(3))

    drawn()
    return found


def test_identifiers_follow_the_seed():
    assert identifiers(1) == identifiers(1)
    assert len({*identifiers(1), *identifiers(2)}) == 6


@virtual_time
async def test_goals_that_end_at_once_lose_no_result():
    class Quick(Arm):
        @action(MoveTo, "~/move", when_busy="parallel", at_most=100)
        async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
            return MoveTo.Result(angle=goal.request.angle)

    async with harness(Quick(name="arm"), Boss) as lab:
        goals = [lab.node(Boss).move.run(MoveTo.Goal(angle=each)) for each in range(10)]
        results = await asyncio.gather(*goals)
        for start in range(10, 100, 10):
            goals = [lab.node(Boss).move.run(MoveTo.Goal(angle=each)) for each in range(start, start + 10)]
            results += await asyncio.gather(*goals)
        assert [each.angle for each in results] == [*range(100)]
        assert balanced(lab)
