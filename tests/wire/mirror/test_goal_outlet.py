"""A node sends goals to a node of another process as to one of its own, and a lost client leaves no goal behind."""

import asyncio
import math

import pytest
import zenoh

from busflow import (
    ActionGone,
    ActionType,
    ActionUnavailable,
    Message,
    Node,
    action_client,
)
from busflow.interfaces.action import derived_types
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.unique_identifier_msgs import UUID
from busflow.wire.client.client import join
from busflow.wire.zenoh.keys import Attachment, topic_key
from tests.actions.conftest import Boss, MoveTo
from tests.wire.mirror.processes import PATIENCE_S, second_process

FOR_EVER = 90_000.0


@pytest.fixture
def arm(robots):
    return robots("arm.py", "arm").ready()


@pytest.mark.asyncio
async def test_goal_of_a_lost_client_is_canceled(arm):
    async with second_process(Boss) as (graph, close):
        boss = graph.node(Boss)
        await boss.move.ready(timeout=PATIENCE_S)
        going = boss.move.send(MoveTo.Goal(angle=FOR_EVER))
        await going.__aenter__()  # its block is never left: what is seen is that the process is there no more
        close()
        assert "client has gone" in await asyncio.to_thread(arm.wait_for, str(going.id))


@pytest.mark.asyncio
async def test_killed_server_is_noticed_at_once(arm):
    async with second_process(Boss) as (graph, _):
        boss = graph.node(Boss)
        await boss.move.ready(timeout=PATIENCE_S)
        async with boss.move.send(MoveTo.Goal(angle=FOR_EVER)) as going:
            arm.kill()
            with pytest.raises(ActionGone, match="/arm/move"):
                await going.result()


class Watcher(Node):
    """Sends goals to the flood."""

    move = action_client(MoveTo, "flood/move")

    async def small_goals(self):
        """Send goals until the feedback of one has come, and with it the way is open; return how many.

        The first messages that a process sends to a new one wait, no more of them than the queue there has room for.
        """
        await self.move.ready(timeout=PATIENCE_S)
        goals, found = 0, []
        while not found:
            async with self.move.send(MoveTo.Goal(angle=1)) as going:
                found = [each.left async for each in going]
            goals += 1
        assert found == [0]
        return goals


@pytest.mark.asyncio
@pytest.mark.usefixtures("arm")
async def test_flood_of_feedback_is_accounted_for():
    async with second_process(Watcher) as (graph, _):
        watcher = graph.node(Watcher)

        def seen():
            feedback = watcher.move.endpoints.feedback.statistics()
            (topic,) = [each for each in graph.report().topics if each.name == "/flood/move/_action/feedback"]
            return feedback.delivered + feedback.dropped + topic.losses.get("lost", 0)

        await watcher.small_goals()
        before = seen()
        async with watcher.move.send(MoveTo.Goal(angle=20_000), depth=3) as going:
            assert (await going.result()).angle == 20_000
            left = [each.left async for each in going]
        goals = await watcher.small_goals()  # its feedback's number shows the gaps before it
        feedback = watcher.move.endpoints.feedback.statistics()
        assert len(left) >= 3
        assert left == sorted(left)
        assert seen() - before == 20_000 + goals
        assert 0 < watcher.move.statistics().feedback_dropped <= feedback.delivered - len(left) - 1


@pytest.mark.asyncio
@pytest.mark.usefixtures("arm")
async def test_feedback_before_the_result_comes_before_it(limits):
    limits(late_feedback=math.inf)
    async with second_process(Watcher) as (graph, _):
        watcher = graph.node(Watcher)
        await watcher.small_goals()
        for _ in range(100):
            async with watcher.move.send(MoveTo.Goal(angle=10)) as going:  # as many as the queue has room for
                assert [each.left async for each in going] == [*range(10)]


class Old:
    """What the arm's action is in a process of another version."""

    class MoveTo(ActionType, package="my_robot"):
        """Moves to a whole number of degrees."""

        class Goal(Message):
            angle: int = 0

        class Result(Message):
            """Nothing."""

        class Feedback(Message):
            """Nothing."""


class OldBoss(Node):
    """Sends goals of that version."""

    move = action_client(Old.MoveTo, "arm/move")


@pytest.mark.asyncio
@pytest.mark.usefixtures("arm")
async def test_goal_of_another_definition_is_not_sent(golden):
    warned: asyncio.Event = asyncio.Event()
    said = []

    def log(record):
        said.append(record.event)
        if "in another process serves" in record.event:
            warned.set()

    async with second_process(OldBoss, log) as (graph, _):
        await warned.wait()
        with pytest.raises(ActionUnavailable, match="/arm/move"):
            await graph.node(OldBoss).move.run(Old.MoveTo.Goal(angle=1))
    (line,) = [each for each in said if "/arm in another process serves" in each]
    golden(line)


def test_goal_of_a_ros_client_outlives_it(arm):
    """What rmw_zenoh sends: no parameters, and a gid of its own; the reply's attachment has 33 bytes, as it expects."""
    types = derived_types(MoveTo)

    def asked(session, service_type, suffix, request, beside=b"", parameters=""):
        support = TypeSupport(service_type)
        key = topic_key(f"/arm/move/_action/{suffix}", support.name, support.type_hash)
        (reply,) = session.get(
            key + parameters,
            payload=TypeSupport(service_type.Request).encode(request),
            attachment=Attachment(1, 0, bytes(range(16))).encode(),
            target=zenoh.QueryTarget.ALL_COMPLETE,
        )
        assert reply.ok.attachment.to_bytes()[33:] == beside
        return TypeSupport(service_type.Response).decode(reply.ok.payload.to_bytes())

    goal_id = UUID(uuid=[7] * 16)
    with join() as peer:
        request = types.send_goal.Request(goal_id=goal_id, goal=MoveTo.Goal(angle=20))
        assert asked(peer.session, types.send_goal, "send_goal", request).accepted
        assert not asked(peer.session, types.send_goal, "send_goal", request).accepted
    with join() as peer:
        result = asked(peer.session, types.get_result, "get_result", types.get_result.Request(goal_id=goal_id))
        assert (result.status, result.result.angle) == (4, 20)
        for parameters, beside in (("?remarks=1", b""), ("?remarks=2", b"\x0020")):  # of busflow's 0.1.0, and of this
            request = types.get_result.Request(goal_id=goal_id)
            asked(peer.session, types.get_result, "get_result", request, beside, parameters)
    assert "stopped" not in arm.end()[1]
