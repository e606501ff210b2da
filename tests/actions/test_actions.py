"""What a class says of actions is checked when it is created, and their accounts reach the report.

Tests of `accounts.py`, `declarations.py`, `endpoints.py`, `goal.py`, `identifiers.py`, `names.py`, `open_goals.py`,
`results.py` and `statistics.py`; see the servers and clients beside it for the rest.
"""

import asyncio

import pytest

import busflow
from busflow import ActionType, GoalTimeout, Message, Node, RunningGoal, action, action_client
from busflow.bus.qos import Durability, Reliability
from busflow.errors import IncompatibleType, InvalidDeclaration, LaunchError, Severity
from busflow.msgs.std_srvs import Trigger
from busflow.testing import harness, virtual_time
from tests.actions.conftest import Arm, Boss, MoveTo


def declared(**options):
    """A class body with an action that has these options."""

    @action(MoveTo, "~/move", **options)
    async def move(_self, _goal: RunningGoal[MoveTo]) -> MoveTo.Result:
        return MoveTo.Result()

    return move


def without_a_goal():
    @action(MoveTo, "~/move")
    async def move(_self) -> MoveTo.Result:
        return MoveTo.Result()


def async_question():
    @declared().accepts
    async def reachable(_self, _request: MoveTo.Goal) -> bool:
        return True


MISTAKES = {
    "an unknown word": lambda: declared(when_busy="quue"),
    "no goals": lambda: declared(at_most=0),
    "a bool for a number": lambda: declared(at_most=True),
    "no time for a cancel": lambda: declared(cancel_within=0),
    "a handler without a goal": without_a_goal,
    "an async question": async_question,
    "a service": lambda: action(Trigger, "move"),
    "a message": lambda: action(MoveTo.Goal, "move"),
    "a number": lambda: action(3, "move"),
    "a client of a service": lambda: action_client(Trigger, "move"),
    "no name": lambda: action(MoveTo),
}


@pytest.mark.parametrize("declare", MISTAKES.values(), ids=MISTAKES.keys())
def test_mistake_in_a_declaration_is_refused(declare, golden):
    with golden.raises(InvalidDeclaration):
        declare()


def test_plain_handler_is_refused_with_the_reason(golden):
    with golden.raises(InvalidDeclaration):

        class Plain(Node):
            @action(MoveTo, "~/move")
            def move(self, _goal: RunningGoal[MoveTo]) -> MoveTo.Result:
                return MoveTo.Result()


def test_two_servers_of_an_action_are_refused():
    with pytest.raises(LaunchError) as caught:
        asyncio.run(busflow.launch(Arm, _same_name()).start())
    assert [each.code for each in caught.value.problems] == ["two-servers"]


def _same_name():
    class Second(Node):
        @action(MoveTo, "/arm/move")
        async def move(self, _goal: RunningGoal[MoveTo]) -> MoveTo.Result:
            return MoveTo.Result()

    return Second


@virtual_time
async def test_endpoints_are_those_of_ros():
    """Names, types and QoS, as `rcl_action` creates them."""
    async with harness(Arm) as lab:
        assert lab.node(Arm).move.action == "/arm/move"
        bus = lab.graph.bus
        services = {name: each.type.__ros_name__ for name, each in bus.services.items()}
        assert services == {
            "/arm/move/_action/send_goal": "my_robot/action/MoveTo_SendGoal",
            "/arm/move/_action/cancel_goal": "action_msgs/srv/CancelGoal",
            "/arm/move/_action/get_result": "my_robot/action/MoveTo_GetResult",
        }
        (feedback,) = bus.topics["/arm/move/_action/feedback"].publishers
        (status,) = bus.topics["/arm/move/_action/status"].publishers
        assert feedback.type.__ros_name__ == "my_robot/action/MoveTo_FeedbackMessage"
        assert status.type.__ros_name__ == "action_msgs/msg/GoalStatusArray"
        qos = [(each.reliability, each.durability, each.depth) for each in (feedback.endpoint.qos, status.endpoint.qos)]
        assert qos == [
            (Reliability.RELIABLE, Durability.VOLATILE, 10),
            (Reliability.RELIABLE, Durability.TRANSIENT_LOCAL, 1),
        ]


@virtual_time
async def test_remap_renames_all_of_an_action(tmp_path):
    (tmp_path / "arm.py").write_text(
        "from tests.actions.conftest import Arm as Base\n\n\nclass Arm(Base):\n    '''An arm.'''\n"
    )
    file = tmp_path / "graph.yaml"
    file.write_text("plugins: [.]\nnodes:\n  arm:\n    plugin: arm\n    remap: {~/move: /left/move}\n")
    async with harness(file) as lab:
        assert sorted(lab.graph.bus.services) == [
            f"/left/move/_action/{each}" for each in ("cancel_goal", "get_result", "send_goal")
        ]


@virtual_time
async def test_harness_sends_goals_from_outside():
    async with harness(Arm) as lab:
        left = []
        goal = MoveTo.Goal(angle=3)
        result = await lab.run_action(MoveTo, "arm/move", goal, on_feedback=lambda each: left.append(each.left))
        assert (result.angle, left, lab.clock.seconds()) == (3, [2, 1, 0], 3)
        with pytest.raises(GoalTimeout):
            await lab.run_action(MoveTo, "arm/move", MoveTo.Goal(angle=9), timeout=2)
        async with lab.action_client(MoveTo, "arm/move").send(MoveTo.Goal(angle=9)) as going:
            await lab.advance(1)
            await going.cancel()
        with pytest.raises(IncompatibleType, match=r"my_robot/action/MoveTo, .* my_robot/action/Other"):
            lab.action_client(Other, "arm/move")


class Other(ActionType, package="my_robot"):
    """Another action."""

    class Goal(Message):
        """Nothing."""

    class Result(Message):
        """Nothing."""

    class Feedback(Message):
        """Nothing."""


@virtual_time
async def test_account_is_in_the_report():
    async with harness(Arm, Boss) as lab:
        await lab.node(Boss).move.run(MoveTo.Goal(angle=1))
        (found,) = lab.graph.report().as_json()["actions"]
    ends = dict.fromkeys(("rejected", "aborted", "canceled", "running"), 0)
    assert found == {
        "name": "/arm/move",
        "type": "my_robot/action/MoveTo",
        "servers": [{"node": "/arm", "received": 1, "succeeded": 1, "queued": 0, **ends}],
        "clients": [{"node": "/boss", "sent": 1, "succeeded": 1, "left": 0, "lost": 0, "feedback_dropped": 0, **ends}],
    }


@virtual_time
async def test_table_of_a_run_has_actions(capsys):
    from busflow.cli.terminal.run_summary import print_summary

    async with harness(Arm, Boss) as lab:
        await lab.node(Boss).move.run(MoveTo.Goal(angle=1))
        print_summary(lab.graph.report())
    table = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["/arm/move", "my_robot/action/MoveTo"] in table
    assert ["←", "/arm", "1", "0", "1", "0", "0", "0", "0"] in table
    assert ["→", "/boss", "1", "0", "1", "0", "0", "0", "0", "0"] in table
    assert not any(line[:1] == ["/arm/move/_action/send_goal"] for line in table)


SECOND = """
from tests.actions.conftest import Arm, Boss, MoveTo
from tests.actions.test_actions import Other
from busflow import Node, action, action_client


class Second(Node):
    move = {what}
"""


@pytest.mark.parametrize(
    "what",
    [
        'action_client(MoveTo, "arm/mov")',
        'action_client(Other, "arm/move")',
        'action(MoveTo, "/arm/move")(Arm.move.function)',
    ],
    ids=["no-server", "other-type", "two-servers"],
)
def test_check_finds_mistakes_with_their_places(tmp_path, monkeypatch, golden, what):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "second.py").write_text(SECOND.format(what=what))
    source = "from tests.actions import conftest\n\n\nclass Arm(conftest.Arm):\n    'An arm.'\n"
    (tmp_path / "arm.py").write_text(source)
    text = "plugins: [.]\nnodes:\n  arm:\n    plugin: arm\n  second: {plugin: second}\n"
    (tmp_path / "graph.yaml").write_text(text)
    problems = [each for each in busflow.launch("graph.yaml").plan().problems if each.severity is not Severity.INFO]
    golden("\n".join(each.render() for each in problems))
