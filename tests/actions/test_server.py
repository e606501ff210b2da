"""A server ends each goal exactly once, whatever comes."""

import asyncio
import re

import pytest

import busflow
from busflow import (
    ActionGone,
    GoalAborted,
    GoalCanceled,
    GoalRejected,
    GoalState,
    GoalTimeout,
    Node,
    RunningGoal,
    action,
    action_client,
    supervised,
)
from busflow.actions.results import RESULT_KEPT_S, RESULTS_KEPT
from busflow.bus.qos import ACTION_STATUS_DEFAULT
from busflow.errors import IncompatibleType, NotRunning, ServiceUnavailable
from busflow.msgs.action_msgs import CancelGoal, GoalInfo, GoalStatusArray
from busflow.msgs.unique_identifier_msgs import UUID
from busflow.testing import harness, virtual_time
from tests.actions.conftest import Arm, Boss, MoveTo, balanced


def serving(**options):
    """A kind of arm with these options of `@action`."""

    class Other(Arm):
        @action(MoveTo, "~/move", **options)
        async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
            await self.clock.sleep(goal.request.angle)
            return MoveTo.Result(angle=goal.request.angle)

    return Other(name="arm")


async def outcome(client, angle, **options):
    """What became of a goal: the angle that it reached, or the kind of its error."""
    try:
        return (await client.run(MoveTo.Goal(angle=angle), **options)).angle
    except Exception as error:  # noqa: BLE001  # whichever it is
        return type(error).__name__


async def outcomes(lab, *angles):
    """What becomes of goals that are sent a tenth of a second after each other."""
    tasks = []
    for angle in angles:
        tasks.append(asyncio.ensure_future(outcome(lab.node(Boss).move, angle)))
        await lab.advance(0.1)
    return await asyncio.gather(*tasks)


def states(lab):
    """The states of all goals, each time that they were published."""
    return [[each.status for each in message.status_list] for message in lab.received("arm/move/_action/status")]


@virtual_time
async def test_goal_that_returns_has_succeeded():
    async with harness(Arm, Boss) as lab:
        assert await outcome(lab.node(Boss).move, 3) == 3
        assert (lab.clock.seconds(), states(lab)) == (3, [[GoalState.EXECUTING], [GoalState.SUCCEEDED]])
        assert balanced(lab)


async def last_states(graph):
    """The states that a late joiner gets at once."""
    topic = graph.subscribe(GoalStatusArray, "/arm/move/_action/status", qos=ACTION_STATUS_DEFAULT)
    async with asyncio.timeout(9):
        return [GoalState(each.status) for each in (await anext(topic)).status_list]


@virtual_time
async def test_unheard_states_are_kept_for_late_joiners():
    async def fail():
        raise ValueError("broken")

    async with busflow.launch(supervised(Arm, restart="on-failure"), Boss) as graph:
        boss = graph.node(Boss)
        await boss.move.run(MoveTo.Goal())
        status = graph.node(Arm).move.endpoints.status
        assert (status.statistics().published, status.statistics().kept) == (2, 1)
        assert await outcome(boss.move, -1) == "GoalAborted"
        async with boss.move.send(MoveTo.Goal(angle=9)) as going:
            graph.node(Arm).spawn(fail())
            with pytest.raises(ActionGone):
                await going.result()
        await boss.move.ready()
        assert await last_states(graph) == [GoalState.SUCCEEDED, GoalState.ABORTED, GoalState.ABORTED]


@virtual_time
async def test_goals_in_a_row_run_in_one_task():
    tasks = []

    class Quick(Arm):
        @action(MoveTo, "~/move", when_busy="queue")
        async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
            tasks.append(asyncio.current_task())
            await asyncio.sleep(0)
            if goal.request.angle == 2:
                await asyncio.Event().wait()
            return MoveTo.Result()

    async with harness(Quick(name="arm"), Boss) as lab:
        move = lab.node(Boss).move
        await move.run(MoveTo.Goal())
        await move.run(MoveTo.Goal(angle=1))
        async with move.send(MoveTo.Goal(angle=2)) as going:
            await going.cancel()
        await move.run(MoveTo.Goal(angle=3))
        first, second, canceled, last = tasks
        assert first is second is canceled
        assert last is not canceled, "a task that was cancelled runs no further goal"


@virtual_time
async def test_handler_that_raises_aborts_its_goal_alone():
    async with harness(Arm, Boss) as lab:
        with pytest.raises(GoalAborted, match="no way back") as caught:
            await lab.node(Boss).move.run(MoveTo.Goal(angle=-1))
        assert caught.value.result == MoveTo.Result()
        (line,) = [each for each in lab.log if each.level == "error"]
        assert re.search(r"Arm\.move .*/arm/move/_action/send_goal.* ValueError: no way back", line.event)
        assert await outcome(lab.node(Boss).move, 1) == 1
        assert balanced(lab)


@virtual_time
async def test_handler_that_returns_nothing_aborts():
    class Silent(Arm):
        async def move(self, goal: RunningGoal[MoveTo]) -> None:
            """Return nothing."""

    async with harness(Silent(name="arm"), Boss) as lab:
        with pytest.raises(GoalAborted, match=r"my_robot/action/MoveTo_Result, .* None"):
            await lab.node(Boss).move.run(MoveTo.Goal())


@virtual_time
async def test_handler_that_cancels_itself_aborts():
    class Confused(Arm):
        async def move(self, _goal: RunningGoal[MoveTo]) -> MoveTo.Result:
            raise asyncio.CancelledError

    async with harness(Confused(name="arm"), Boss) as lab:
        assert await outcome(lab.node(Boss).move, 1) == "GoalAborted"
        assert balanced(lab)


@virtual_time
async def test_cancel_keeps_the_result_of_the_handler():
    async with harness(Arm, Boss) as lab:
        async with lab.node(Boss).move.send(MoveTo.Goal(angle=9)) as going:
            await lab.advance(2.5)
            assert await going.cancel()
            with pytest.raises(GoalCanceled) as caught:
                await going.result()
        assert caught.value.result == MoveTo.Result(angle=2)
        assert states(lab)[-2:] == [[GoalState.CANCELING], [GoalState.CANCELED]]
        assert balanced(lab)


@virtual_time
async def test_cancel_without_a_result_has_the_default():
    async with harness(serving(), Boss) as lab:
        async with lab.node(Boss).move.send(MoveTo.Goal(angle=9)) as going:
            await going.cancel()
            with pytest.raises(GoalCanceled) as caught:
                await going.result()
        assert caught.value.result == MoveTo.Result()


@virtual_time
async def test_cancel_before_the_first_step_counts():
    async with harness(Arm, Boss) as lab:
        arm, client = lab.node(Arm), lab.node(Boss).move
        going = client.send(MoveTo.Goal(angle=9))
        async with going:
            (goal,) = arm.move.goals
            arm.move.on_cancel(CancelGoal.Request(goal_info=GoalInfo(goal_id=goal.info.goal_id)))
            assert goal.is_canceling
            with pytest.raises(GoalCanceled):
                await going.result()
        assert balanced(lab)


@virtual_time
async def test_unaccepted_goal_is_rejected_with_the_reason(golden):
    async with harness(Arm, Boss) as lab:
        with golden.raises(GoalRejected):
            await lab.node(Boss).move.run(MoveTo.Goal(angle=999))
        assert balanced(lab)


@pytest.mark.parametrize("answer", [False, None])
def test_only_true_accepts_a_goal(answer):
    class Picky(Arm):
        def reachable(self, _request: MoveTo.Goal) -> bool:
            return answer

    @virtual_time
    async def rejected():
        async with harness(Picky(name="arm"), Boss) as lab:
            with pytest.raises(GoalRejected):
                await lab.node(Boss).move.run(MoveTo.Goal())

    rejected()


@virtual_time
async def test_failing_question_rejects_and_is_logged():
    class Broken(Arm):
        def reachable(self, _request: MoveTo.Goal) -> bool:
            raise KeyError("joint")

    async with harness(Broken(name="arm"), Boss) as lab:
        with pytest.raises(GoalRejected, match="KeyError: 'joint'"):
            await lab.node(Boss).move.run(MoveTo.Goal())
        assert [each.level for each in lab.log] == ["error", "info"]


# What a busy server does.


@pytest.mark.parametrize(
    ("options", "angles", "ends", "seconds"),
    [
        ({}, (3, 1), [3, "GoalRejected"], 3),
        ({"when_busy": "queue", "at_most": 2}, (3, 1, 2, 4), [3, 1, 2, "GoalRejected"], 6),
        ({"when_busy": "parallel", "at_most": 2}, (3, 2, 1), [3, 2, "GoalRejected"], 3),
    ],
    ids=["reject", "queue", "parallel"],
)
@virtual_time
async def test_busy_server_does_as_declared(options, angles, ends, seconds):
    async with harness(serving(**options), Boss) as lab:
        assert await outcomes(lab, *angles) == ends
        assert lab.clock.seconds() == seconds
        assert balanced(lab)


@virtual_time
async def test_busy_server_replaces_the_goal_before():
    async with harness(serving(when_busy="replace"), Boss) as lab:
        async with lab.node(Boss).move.send(MoveTo.Goal(angle=9)) as going:
            await lab.advance(1)
            assert await outcome(lab.node(Boss).move, 2) == 2
            with pytest.raises(GoalAborted):
                await going.result()
        assert balanced(lab)


@virtual_time
async def test_new_goal_waits_for_the_replaced_one():
    class Careful(Arm):
        @action(MoveTo, "~/move", when_busy="replace")
        async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
            try:
                await self.clock.sleep(goal.request.angle)
            finally:
                await self.clock.sleep(1)
            return MoveTo.Result(angle=goal.request.angle)

    async with harness(Careful(name="arm"), Boss) as lab:
        assert await outcomes(lab, 9, 8, 2) == ["GoalAborted", "GoalAborted", 2]
        assert lab.clock.seconds() == pytest.approx(0.1 + 1 + 2 + 1)
        assert balanced(lab)


# Cancels.


@virtual_time
async def test_waiting_goal_is_canceled_at_once():
    async with harness(serving(when_busy="queue"), Boss) as lab:
        client = lab.node(Boss).move
        async with client.send(MoveTo.Goal(angle=9)), client.send(MoveTo.Goal(angle=9)) as second:
            await second.cancel()
            assert await asyncio.wait_for(asyncio.gather(second.result(), return_exceptions=True), 0.1)
            assert [each.state for each in lab.node("arm").move.goals] == [GoalState.EXECUTING]
        assert balanced(lab)


@virtual_time
async def test_handler_that_goes_on_is_named():
    class Stubborn(Arm):
        @action(MoveTo, "~/move", cancel_within=0.5)
        async def move(self, _goal: RunningGoal[MoveTo]) -> MoveTo.Result:
            try:
                await self.clock.sleep(9)
            except asyncio.CancelledError:
                await self.clock.sleep(3)
            return MoveTo.Result(angle=1)

    async with harness(Stubborn(name="arm"), Boss) as lab:
        async with lab.node(Boss).move.send(MoveTo.Goal()) as going:
            await lab.advance(1)
            await going.cancel()
            with pytest.raises(GoalCanceled):
                await going.result()
        (line,) = [each for each in lab.log if each.level == "warning"]
        assert re.search(r" /arm/move .* 0.5 s .* \S*test_server.py:\d+", line.event)
        assert lab.clock.seconds() == 4


async def cancelled(lab, **info):
    """The answer to a request of `cancel_goal`."""
    request = CancelGoal.Request(goal_info=GoalInfo(**info))
    answer = await lab.call(CancelGoal, "arm/move/_action/cancel_goal", request)
    return answer.return_code, len(answer.goals_canceling)


@virtual_time
async def test_cancel_means_what_ros_says():
    async with harness(serving(when_busy="parallel"), Boss) as lab:
        client, zero = lab.node(Boss).move, UUID()
        assert await cancelled(lab) == (CancelGoal.Response.ERROR_REJECTED, 0)
        unknown = UUID(uuid=[7] * 16)
        assert await cancelled(lab, goal_id=unknown) == (CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID, 0)
        async with client.send(MoveTo.Goal(angle=50)):
            await lab.advance(1)
            async with client.send(MoveTo.Goal(angle=50)) as second:
                stamps = [each.info.stamp for each in lab.node("arm").move.goals]
                assert await cancelled(lab, goal_id=zero, stamp=stamps[0]) == (0, 1)
                await lab.settle()
                (goal,) = lab.node("arm").move.goals
                assert goal.id == second.id
                assert await cancelled(lab, goal_id=goal.info.goal_id) == (0, 1)
                await lab.settle()
                ended = CancelGoal.Response.ERROR_GOAL_TERMINATED
                assert await cancelled(lab, goal_id=goal.info.goal_id) == (ended, 0)


# Results.


async def asked(lab, goal_id):
    """The state in the answer to `get_result`."""
    from busflow.interfaces.action import derived_types

    types = derived_types(MoveTo)
    answer = await lab.call(types.get_result, "arm/move/_action/get_result", types.get_result.Request(goal_id=goal_id))
    return GoalState(answer.status)


@virtual_time
async def test_unknown_goal_is_answered_at_once():
    async with harness(Arm, Boss) as lab:
        assert await asked(lab, UUID(uuid=[1] * 16)) is GoalState.UNKNOWN
        assert lab.clock.seconds() == 0


@virtual_time
async def test_result_is_kept_for_ten_seconds():
    async with harness(Arm, Boss) as lab:
        await outcome(lab.node(Boss).move, 1)
        goal_id = lab.received("arm/move/_action/status")[-1].status_list[0].goal_info.goal_id
        await lab.advance(RESULT_KEPT_S - 0.01)
        assert await asked(lab, goal_id) is GoalState.SUCCEEDED
        await lab.advance(0.01)
        assert await asked(lab, goal_id) is GoalState.UNKNOWN


@virtual_time
async def test_results_kept_are_bounded():
    async with harness(Arm, Boss) as lab:
        for _ in range(RESULTS_KEPT + 5):
            await outcome(lab.node(Boss).move, 0)
        assert len(states(lab)[-1]) == RESULTS_KEPT


@virtual_time
async def test_same_identifier_twice_is_rejected():
    from busflow.interfaces.action import derived_types

    send_goal = derived_types(MoveTo).send_goal
    async with harness(Arm) as lab:
        request = send_goal.Request(goal_id=UUID(uuid=[5] * 16), goal=MoveTo.Goal(angle=1))
        answers = [await lab.call(send_goal, "arm/move/_action/send_goal", request) for _ in range(2)]
        assert [each.accepted for each in answers] == [True, False]
        (line,) = lab.log
        assert "05050505-0505-0505-0505-050505050505" in line.event


# Feedback.


@virtual_time
async def test_feedback_of_another_type_aborts():
    class Wrong(Arm):
        async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
            with pytest.raises(IncompatibleType, match=r"/arm/move .* my_robot/action/MoveTo_Feedback"):
                goal.feedback(MoveTo.Goal())
            return MoveTo.Result(angle=1)

    async with harness(Wrong(name="arm"), Boss) as lab:
        assert await outcome(lab.node(Boss).move, 1) == 1


@virtual_time
async def test_feedback_after_the_end_is_refused():
    kept = []

    class Late(Arm):
        async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
            kept.append(goal)
            return MoveTo.Result()

    async with harness(Late(name="arm"), Boss) as lab:
        await outcome(lab.node(Boss).move, 1)
        with pytest.raises(NotRunning):
            kept[0].feedback(MoveTo.Feedback())


# Ends of nodes.


@virtual_time
async def test_end_of_the_server_reaches_clients_at_once():
    async with harness(supervised(Arm, restart="always"), Boss) as lab:
        async with lab.node(Boss).move.send(MoveTo.Goal(angle=9)) as going:
            await lab.advance(1)
            lab.fail("arm", RuntimeError("broken"))
            with pytest.raises(ActionGone, match=r"^/arm/move: "):
                await going.result()
        assert lab.clock.seconds() == 1
        await lab.advance(5)
        assert await outcome(lab.node(Boss).move, 2) == 2
        assert balanced(lab)


@virtual_time
async def test_end_of_the_client_cancels_its_goals():
    class Patient(Node):
        move = action_client(MoveTo, "arm/move")

        async def run(self) -> None:
            await self.move.run(MoveTo.Goal(angle=99))

    async with harness(Arm, Patient) as lab:
        await lab.advance(2)
        arm = lab.node(Arm)
        assert len(arm.move.goals) == 1
        (patient,) = [each for each in lab.graph.supervisors if each.name == "/patient"]
        await lab.graph.course.stop_by_hand([patient])
        await lab.settle()
        assert (arm.move.goals, arm.move.statistics().canceled) == ((), 1)
        assert balanced(lab)


@virtual_time
async def test_timeout_cancels_the_goal():
    async with harness(Arm, Boss) as lab:
        with pytest.raises(GoalTimeout, match=r" 1.5 s"):
            await lab.node(Boss).move.run(MoveTo.Goal(angle=9), timeout=1.5)
        await lab.settle()
        assert lab.node(Arm).move.goals == ()
        assert lab.node(Arm).move.statistics().canceled == 1
        assert balanced(lab)


@virtual_time
async def test_request_of_a_lost_client_begins_no_goal():
    """It waits for its turn when the client goes: nothing would ever cancel its goal."""
    async with harness(Arm, Boss) as lab:
        server, send = lab.node(Arm).move, lab.graph.bus.services["/arm/move/_action/send_goal"]
        request = send.type.Request(goal_id=UUID(uuid=[1] * 16), goal=MoveTo.Goal(angle=9))
        asked = asyncio.ensure_future(send.call(request, caller="a client of another process"))
        await asyncio.sleep(0)
        server.endpoints.goals.forget("a client of another process")
        with pytest.raises(ServiceUnavailable, match="a client of another process"):
            await asked
        await lab.settle()
        assert (server.goals, server.statistics().rejected, balanced(lab)) == ((), 1, True)


@virtual_time
async def test_all_goals_of_a_lost_client_end():
    """They are more than the requests to cancel that may wait."""
    async with harness(serving(when_busy="parallel", at_most=40), Boss) as lab:
        server, send = lab.node("arm").move, lab.graph.bus.services["/arm/move/_action/send_goal"]
        ids = [UUID(uuid=[number] * 16) for number in range(1, 31)]
        async with lab.node(Boss).move.send(MoveTo.Goal(angle=9)) as other:
            for goal_id in ids:
                request = send.type.Request(goal_id=goal_id, goal=MoveTo.Goal(angle=9))
                assert (await send.call(request, caller="a client of another process")).accepted
            goals = [each for each in server.goals if each.id != other.id]
            server.endpoints.goals.forget("a client of another process")
            await lab.advance(1)
            assert {each.state for each in goals} == {GoalState.CANCELED}
            assert (await other.result()).angle == 9
        assert (server.statistics().canceled, server.statistics().succeeded, balanced(lab)) == (30, 1, True)
        cancels = server.endpoints.cancels.statistics()
        assert (cancels.received, cancels.served, cancels.refused) == (30, 10, 20)
