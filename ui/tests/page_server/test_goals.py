"""Goals that a page sends, through `busflow ui` itself, while a node with an action runs. Of `page_goals.py`."""

import base64
import re
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from busflow import GoalState
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.action_msgs import GoalStatusArray
from busflow.msgs.example_interfaces import Fibonacci
from tests.golden import Golden
from ui.tests.page_server.conftest import Page

LABS = Path(__file__).parents[1] / "labs"
ACTION = "/counter/count"


@pytest.fixture(scope="module")
def environment(stand: Callable[..., Any]) -> dict[str, str]:
    """That of a run with the node."""
    place, run = stand(LABS / "counting.yaml")
    run.wait_for("it counts")
    found: dict[str, str] = place.environment
    return found


@pytest.fixture(scope="module")
def serving(show: Callable[..., Any], environment: dict[str, str]) -> Any:
    return show("--allow-origin", "http://panel.lab:8080", environment=environment)


@pytest.fixture
def page(serving: Any) -> Iterator[Page]:
    """A page that is sent the states of the goals; it goes with the test."""
    with serving.pages:
        page = serving.page()
        page.subscribe(f"{ACTION}/_action/status")
        yield page


def written(order: int) -> str:
    """A goal as the page writes it."""
    return base64.b64encode(TypeSupport(Fibonacci.Goal).encode(Fibonacci.Goal(order=order))).decode()


def begun(page: Page, order: int = 0, **options: Any) -> str:
    """Send a goal; return its identifier."""
    page.send(
        "busflow/ask", id=900, question="send_goal", arguments={"action": ACTION, "goal": written(order), **options}
    )
    return str(page.until(lambda frame: frame["op"] == "busflow/part" and frame["id"] == 900)["part"]["id"])


def end_of(page: Page) -> dict[str, Any]:
    return page.until(lambda frame: frame["op"] == "busflow/answer" and frame["id"] == 900)


def wait_for_state(page: Page, goal_id: str, state: GoalState) -> None:
    """Wait until the server says that a goal has this state."""
    type_ = TypeSupport(GoalStatusArray)
    while True:
        for each in type_.decode(page.message()["payload"]).status_list:
            if bytes(each.goal_info.goal_id.uuid) == uuid.UUID(goal_id).bytes and each.status == state:
                return


def test_a_goal_has_feedback_and_a_result(page: Page):
    types = page.answer("action", action="counter/count")
    assert types["type"] == "example_interfaces/action/Fibonacci"
    assert types["goal"]["schema"].strip() == "int32 order"
    page.subscribe(f"{ACTION}/_action/feedback", 2)
    page.send("busflow/ask", id=900, question="send_goal", arguments={"action": ACTION, "goal": written(3)})
    frames: list[dict[str, Any]] = []
    answer = page.until(lambda frame: frames.append(frame) or frame["op"] == "busflow/answer")["answer"]
    assert (answer["state"], answer["reason"]) == (GoalState.SUCCEEDED, "")
    result = TypeSupport(Fibonacci.Result).decode(base64.b64decode(answer["result"]))
    assert list(result.sequence) == [1, 2, 3]
    (goal_id,) = [frame["part"]["id"] for frame in frames if frame["op"] == "busflow/part"]
    feedback = [frame["payload"] for frame in frames if frame.get("subscription") == 2]
    while len(feedback) < 2:  # it may come after the result, which takes another way
        feedback.append(page.message(2)["payload"])
    assert len(feedback) == 2
    assert all(uuid.UUID(goal_id).bytes in each for each in feedback)


def test_a_refused_goal_has_the_reason(page: Page, golden: Golden):
    golden(page.ask("send_goal", action=ACTION, goal=written(-7))["error"])


def test_a_goal_is_canceled_by_any_page(serving: Any, page: Page, golden: Golden):
    goal_id = begun(page)
    other = serving.page()
    assert other.answer("cancel_goal", action=ACTION, id=goal_id) == {"canceling": [goal_id]}
    assert end_of(page)["answer"]["state"] == GoalState.CANCELED
    golden(other.ask("cancel_goal", action=ACTION, id=goal_id)["error"])


def test_all_goals_are_canceled_together(serving: Any, page: Page):
    goal_id = begun(page)
    other = serving.page()
    assert other.answer("cancel_goal", action=ACTION) == {"canceling": [goal_id]}
    assert end_of(page)["answer"]["state"] == GoalState.CANCELED
    assert other.answer("cancel_goal", action=ACTION) == {"canceling": []}


def test_a_goal_beyond_its_limit_is_canceled(page: Page, golden: Golden):
    page.send("busflow/ask", id=900, question="send_goal",
              arguments={"action": ACTION, "goal": written(0), "limit_s": 0.05})  # fmt: skip
    found: dict[str, Any] = {}

    def are_both_there(frame: dict[str, Any]) -> bool:
        """In either order: on a busy machine the limit is over before the goal is accepted."""
        if frame["op"] in ("busflow/part", "busflow/answer") and frame["id"] == 900:
            found[frame["op"]] = frame
        return len(found) == 2

    page.until(are_both_there)
    golden(found["busflow/answer"]["error"])
    wait_for_state(page, found["busflow/part"]["part"]["id"], GoalState.CANCELED)


def test_a_page_that_goes_leaves_no_goal(serving: Any, page: Page):
    leaving = serving.page()
    goal_id = begun(leaving)
    wait_for_state(page, goal_id, GoalState.EXECUTING)
    leaving.socket.close()
    wait_for_state(page, goal_id, GoalState.CANCELED)


def test_a_page_has_so_many_goals(page: Page, golden: Golden):
    for _ in range(8):
        begun(page)
    golden(page.ask("send_goal", action=ACTION, goal=written(3))["error"])
    assert len(page.answer("cancel_goal", action=ACTION)["canceling"]) == 8


@pytest.mark.parametrize(
    ("question", "arguments"),
    [
        ("action", {"action": "/counter/coun"}),
        ("send_goal", {"action": ACTION, "goal": "%"}),
        ("send_goal", {"action": ACTION, "goal": "AAEA"}),
        ("send_goal", {"action": ACTION, "goal": "", "limit_s": -1}),
        ("cancel_goal", {"action": ACTION, "id": "7"}),
    ],
)
def test_what_is_no_goal_is_refused(page: Page, question: str, arguments: dict[str, Any], golden: Golden):
    golden(page.ask(question, **arguments)["error"])


def test_a_page_that_looks_sends_no_goal(serving: Any, page: Page, golden: Golden):
    goal_id = begun(page)
    (token,) = re.findall(r"with the token (\S+)", serving.process.stdout.readline())
    looking = serving.page(token=token)
    looking.subscribe(f"{ACTION}/_action/status")
    wait_for_state(looking, goal_id, GoalState.EXECUTING)
    for question in ("send_goal", "cancel_goal"):
        golden(looking.ask(question, action=ACTION, goal=written(3), id=goal_id)["error"], question)
    assert page.answer("cancel_goal", action=ACTION) == {"canceling": [goal_id]}
