"""Actions across the bridge, with a server and a client of DDS alone at the other end."""

import os
import signal
from collections.abc import Iterator

import pytest

from tests.dds.conftest import Stage, staged

ENDLESS = 1_000_000
SUCCEEDED, CANCELED = 4, 5
COUNTER = """
import asyncio, sys
import numpy as np
import busflow
from busflow import *
from busflow.msgs.example_interfaces import Fibonacci
from busflow.msgs.std_msgs import Int64

class Counter(Node):
    other = action_client(Fibonacci, "other")

    async def start(self) -> None:
        self.log.info("ready")

    @action(Fibonacci, "count")
    async def count(self, goal: RunningGoal[Fibonacci]) -> Fibonacci.Result:
        numbers = [0, 1]
        try:
            while len(numbers) <= goal.request.order:
                await self.clock.sleep(0.05)
                numbers.append((numbers[-1] + numbers[-2]) % 1_000_000)
                goal.feedback(Fibonacci.Feedback(sequence=np.array(numbers[-20:], np.int32)))
        except asyncio.CancelledError:
            self.log.info(f"stopped before {goal.request.order}")
            raise
        self.log.info(f"counted to {goal.request.order}")
        return Fibonacci.Result(sequence=np.array(numbers, np.int32))

    @count.accepts
    def in_range(self, request: Fibonacci.Goal) -> bool:
        return request.order >= 0

    @subscription("send")
    async def on_send(self, message: Int64) -> None:
        try:
            async with self.other.send(Fibonacci.Goal(order=message.data)) as sent:
                async for feedback in sent:
                    self.log.info(f"feedback {len(feedback.sequence)}")
                    if message.data > 1000:
                        self.log.info(f"canceled {await sent.cancel()}")
                        break
                result = await sent.result()
                self.log.info(f"result {result.sequence.tolist()}")
        except ActionError as error:
            self.log.info(f"no result: {type(error).__name__}")

sys.exit(busflow.run(Counter, inspect="robot"))
"""


@pytest.fixture(scope="module")
def stage() -> Iterator[Stage]:
    """A run whose node serves an action and is a client of another, with its bridge."""
    with staged("-c", COUNTER) as found:
        found.robot.wait_for("ready")
        found.bridge = found.open_bridge()
        yield found


def of_actions(stage, *options):
    return stage.peer(*options, program="action_peer.py")


@pytest.fixture(scope="module")
def client(stage):
    found = of_actions(stage)
    found.do("client_of_action", name="/count")
    found.said(found="reader", topic="rq/count/_action/get_resultRequest")
    return found


@pytest.fixture(scope="module")
def server(stage):
    found = of_actions(stage, "enclave=/;")
    found.do("serve_action", name="/other")
    found.do("advertise", topic="rt/send", kind="Int64", latched=True, depth=1)
    stage.until("Action servers: 1", "action", "info", "/other")
    return found


def send(client, order, *, seq):
    """Send a goal, and ask for its result once it is accepted; return its identifier.

    Replies reach all clients, so each test has a `seq` of its own.
    """
    goal = os.urandom(16).hex()
    client.do("send_goal", name="/count", goal=goal, order=order, seq=seq)
    assert client.said(part="send_goal", seq=seq)["accepted"]
    client.do("get_result", name="/count", goal=goal, seq=seq)
    return goal


def test_ends_of_an_action_have_ros2s_names(client):
    found = {
        "rq/count/_action/send_goalRequest": "example_interfaces::action::dds_::Fibonacci_SendGoal_Request_",
        "rq/count/_action/cancel_goalRequest": "action_msgs::srv::dds_::CancelGoal_Request_",
        "rq/count/_action/get_resultRequest": "example_interfaces::action::dds_::Fibonacci_GetResult_Request_",
    }
    for topic, kind in found.items():
        assert client.said(found="reader", topic=topic)["type"] == kind
    written = {
        "rt/count/_action/feedback": "example_interfaces::action::dds_::Fibonacci_FeedbackMessage_",
        "rt/count/_action/status": "action_msgs::msg::dds_::GoalStatusArray_",
    }
    for topic, kind in written.items():
        assert client.said(found="writer", topic=topic)["type"] == kind
    assert client.said(found="writer", topic="rt/count/_action/status")["latched"]


def test_goal_of_a_neighbour_succeeds(client):
    goal = send(client, 7, seq=1)
    said = client.said(part="get_result", seq=1)
    assert (said["status"], said["sequence"]) == (SUCCEEDED, [0, 1, 1, 2, 3, 5, 8, 13])
    assert client.said(feedback=goal)["sequence"][:2] == [0, 1]
    client.said(state=SUCCEEDED, id=goal)


def test_neighbour_cancels_its_goal(stage, client):
    goal = send(client, ENDLESS, seq=2)
    client.said(feedback=goal)
    client.do("cancel_goal", name="/count", goal=goal, seq=2)
    assert client.said(part="cancel_goal", seq=2)["ending"] == [goal]
    assert client.said(part="get_result", seq=2)["status"] == CANCELED
    stage.robot.wait_for(f"stopped before {ENDLESS}")


def test_goal_of_a_neighbour_is_rejected(client):
    client.do("send_goal", name="/count", goal="ab" * 16, order=-1, seq=3)
    assert client.said(part="send_goal", seq=3)["accepted"] is False


@pytest.mark.long
def test_goal_outlives_a_killed_neighbour(stage, client):
    """As in ROS 2; the server goes on with the goals of others."""
    other = of_actions(stage)
    other.do("client_of_action", name="/count")
    other.said(found="reader", topic="rq/count/_action/get_resultRequest")
    goal = send(other, 43, seq=5)
    other.said(feedback=goal)
    other.end(signal.SIGKILL)
    stage.robot.wait_for("counted to 43")
    send(client, 3, seq=4)
    assert client.said(part="get_result", seq=4)["status"] == SUCCEEDED


@pytest.mark.long
def test_action_crosses_by_its_own_name(stage, other_domain):
    bridge = stage.open_bridge("--domain", str(other_domain), "--topics", "/count")
    there = stage.peer(domain=other_domain, program="action_peer.py")
    there.do("client_of_action", name="/count")
    there.said(found="reader", topic="rq/count/_action/get_resultRequest")
    goal = send(there, 4, seq=6)
    assert there.said(part="get_result", seq=6)["status"] == SUCCEEDED
    there.said(feedback=goal)
    there.said(state=SUCCEEDED, id=goal)
    bridge.end()


@pytest.mark.usefixtures("server")
def test_action_of_a_neighbour_is_listed(stage):
    assert "/other [example_interfaces/action/Fibonacci]" in stage.busflow("action", "list", "-t")


def test_node_is_listed_as_client_in_dds(server):
    asking = server.said(found="writer", topic="rq/other/_action/send_goalRequest")["gid"]
    answered = server.said(found="reader", topic="rr/other/_action/get_resultReply")["gid"]
    server.do("read_nodes")
    server.wait_for(lambda line: '"node": "counter"' in line and asking in line and answered in line)


def test_goal_for_a_neighbour_succeeds(stage, server):
    server.do("write", topic="rt/send", value=5)
    assert server.said(asked="/other", order=5)
    stage.robot.wait_for("feedback 3")
    stage.robot.wait_for("result [0, 1, 1, 2, 3, 5]")


def test_goal_for_a_neighbour_is_canceled(stage, server):
    server.do("write", topic="rt/send", value=ENDLESS)
    goal = server.said(asked="/other", order=ENDLESS)["id"]
    server.said(cancel="/other", id=goal)
    stage.robot.wait_for("canceled True")
    stage.robot.wait_for("no result: GoalCanceled")


def test_goal_is_rejected_by_a_neighbour(stage, server):
    server.do("write", topic="rt/send", value=-1)
    stage.robot.wait_for("no result: GoalRejected")


@pytest.mark.usefixtures("server")
def test_command_sends_a_goal_to_a_neighbour(stage):
    printed = stage.busflow("action", "send_goal", "-f", "/other", "example_interfaces/action/Fibonacci", "{order: 30}")
    assert "Feedback:" in printed
    assert "832040" in printed
    assert ": SUCCEEDED" in printed


@pytest.mark.long
def test_killed_server_ends_the_goal(stage, server):
    """DDS takes a participant for gone ten seconds after its last sign of life."""
    server.do("write", topic="rt/send", value=1000)
    stage.robot.wait_for("feedback 20")  # so the goal is accepted; one that is not answered ends in another way
    server.end(signal.SIGKILL)
    stage.robot.wait_for("no result: ActionGone")
    assert stage.bridge.process.poll() is None
