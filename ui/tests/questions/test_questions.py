"""What pages send and are answered, without a run.

Of `allowance.py`, `arguments.py`, `cited_pages.py`, `followed.py`, `frames.py`, `graph_answer.py` and `session.py`.
What needs a run (`run_questions.py`, `steering.py`, `heartbeat.py`, `last_errors.py`, `page_recorder.py`) is asked
in `page_server/test_page_server.py`, `assistant_questions.py` in `page_server/test_asking.py`, and `page_goals.py` in
`page_server/test_goals.py`.
"""

import asyncio
import json
import threading
from collections.abc import Awaitable, Callable, Mapping
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.errors import InspectionUnavailable, MalformedMessage, NoSuchTarget, NotAllowed
from busflow.wire.client.graph_view import view
from busflow.wire.zenoh.keys import Token, TokenKind
from busflow_ui import timeouts
from busflow_ui.questions import arguments, frames
from busflow_ui.questions.allowance import Allowance
from busflow_ui.questions.cited_pages import CitedPages
from busflow_ui.questions.followed import Changed, NewLines
from busflow_ui.questions.graph_answer import Moment, graph_answer
from busflow_ui.questions.heartbeat import Heartbeat
from busflow_ui.questions.run_questions import RunQuestions
from busflow_ui.questions.session import AskingOnly, Question, Session
from tests.golden import Golden

PATIENCE_S = 60.0

# Frames.


def test_own_frames_are_read():
    ask = {"op": "busflow/ask", "id": 3, "question": "graph", "arguments": {"node": "/a"}}
    assert frames.read(json.dumps(ask)) == frames.Ask(3, "graph", {"node": "/a"})
    assert frames.read('{"op":"busflow/hello","token":"x"}') == frames.Hello("x")
    follow = {"question": "log", "on": True, "op": "busflow/follow"}
    assert frames.read(json.dumps(follow)) == frames.Follow("log", on=True)


@pytest.mark.parametrize("message", ['{"op":"subscribe"}', b"\x01busflow/", '{"op":"setParameters","x":"busflow/"}'])
def test_frames_of_the_protocol_are_passed_on(message: str | bytes):
    assert frames.read(message) is None


@pytest.mark.parametrize(
    "message",
    [
        '{"op":"busflow/ask","id":-1,"question":"graph"}',
        '{"op":"busflow/ask","id":true,"question":"graph"}',
        '{"op":"busflow/ask","id":1,"question":"graph","arguments":[]}',
        '{"op":"busflow/hello","token":7}',
        '{"op":"busflow/other"}',
        '{"op":"busflow/ask"',
        '{"op":"busflow/' + "x" * 2_000_000 + '"}',
        '{"busflow/":' + "[" * 100_000 + "}",
    ],
)
def test_a_malformed_frame_is_refused(message: str):
    with pytest.raises(MalformedMessage):
        frames.read(message)


@given(st.text() | st.dictionaries(st.text(), st.integers() | st.text()).map(json.dumps))
def test_every_frame_is_read_or_refused(text: str):
    try:
        frames.read(f"busflow/{text}")
        frames.read(text)
    except MalformedMessage:
        pass


def test_numbers_that_json_lacks_are_text():
    assert json.loads(frames.answer(1, {"range": [0.0, float("inf")]}))["answer"] == {"range": [0.0, ".inf"]}


# Arguments.


def test_arguments_are_checked():
    assert arguments.digits({"stamp_ns": "1795501648996846647"}, "stamp_ns") == 1795501648996846647
    assert arguments.texts({}, "nodes") is None
    assert arguments.number({"rate": 2}, "rate", above=0, most=100, default=1) == 2.0
    assert arguments.whole_number({}, "count", least=1, most=9, default=5) == 5


@pytest.mark.parametrize(
    "check",
    [
        lambda: arguments.text({"node": 1}, "node"),
        lambda: arguments.texts({"nodes": ["/a", 1]}, "nodes"),
        lambda: arguments.mapping({"values": []}, "values"),
        lambda: arguments.flag({"on": 1}, "on"),
        lambda: arguments.whole_number({"count": True}, "count", least=0, most=9),
        lambda: arguments.digits({"stamp_ns": "²"}, "stamp_ns"),
        lambda: arguments.digits({"stamp_ns": "9" * 30}, "stamp_ns"),
        lambda: arguments.number({"rate": float("nan")}, "rate", above=0, most=9, default=1),
        lambda: arguments.number({"rate": True}, "rate", above=0, most=9, default=1),
        lambda: arguments.one_of({"order": "kill"}, "order", ("start", "stop")),
    ],
)
def test_wrong_arguments_are_refused(check: Callable[[], object]):
    with pytest.raises(MalformedMessage):
        check()


# What is followed.


def test_an_unchanged_answer_is_sent_once():
    changed = Changed()
    assert [changed.of(each) for each in ({"a": 1}, {"a": 1}, {"a": 2})] == [{"a": 1}, None, {"a": 2}]


def test_each_line_is_sent_once():
    def line(number: int) -> dict[str, Any]:
        return {"stamp_ns": number, "node": "/a", "text": "x"}

    new = NewLines()
    assert new.of({"lines": []}) == {"lines": []}
    assert new.of({"lines": [line(1), line(2)]}) == {"lines": [line(1), line(2)]}
    assert new.of({"lines": [line(2), line(3)]}) == {"lines": [line(3)]}
    assert new.of({"lines": [line(3)]}) is None


# The graph.


def end(kind: TokenKind, node: str, number: int) -> Token:
    return Token("ab", 0, number, kind, "/left", node, "/x", "std_msgs/msg/String", "RIHS01_0", "::,7:,:,:,,")


def looked(published: int, dropped: int) -> Any:
    qos = {"depth": 1}
    line = {"published": published, "delivered": published - dropped, "dropped": dropped, "queued": 0, "depth": 1}
    drops = {"drops": {"overflow": dropped, "expired": 0}, "overflow": "drop_oldest", "deadlines_missed": 0}
    subscription = {"node": "/left/b", "qos": qos, "origin": "B.on_x", **line, **drops}
    publisher = {"node": "/left/a", "qos": qos, "origin": "A.x", "published": published}
    topic = {"name": "/x", "type": "std_msgs/msg/String", "published": published, "losses": {"lost": 0, "early": 2}}
    timer = {"node": "/left/a", "name": "tick", "period_s": 0.1, "fired": 3, "missed": 0}
    node = {"name": "/left/a", "state": "running", "plugin": "a", "restarts": 0, "failures": []}
    answer = {
        "process": "arm:eyes",
        "pid": 7,
        "elapsed_s": 2.0,
        "clock": "system",
        "inbox": {"dropped": 0, "refused": 0},
        "nodes": [node],
        "timers": [timer],
        "services": [],
        "topics": [{**topic, "publishers": [publisher], "subscriptions": [subscription]}],
    }
    kinds = (TokenKind.PUBLISHER, "a"), (TokenKind.SUBSCRIPTION, "b")
    return view([end(*each, number) for number, each in enumerate(kinds)], [answer])


def test_the_graph_has_counts_rates_and_timers():
    before, now = Moment(looked(10, 0), 1.0), Moment(looked(30, 4), 3.0)
    found = graph_answer(now, before, {"/left/a": "a.py:3"})
    (topic,) = found["topics"]
    assert (topic["published"], topic["rate_hz"], topic["losses"]) == (30, 10.0, {"early": 2})
    (subscription,) = topic["subscriptions"]
    assert (subscription["delivered"], subscription["dropped"], subscription["reasons"]) == (26, 4, {"overflow": 4})
    nodes = {each["name"]: each for each in found["nodes"]}
    own = nodes["/left/a"]
    assert (own["machine"], own["process"], own["namespace"], own["source"]) == ("arm", "eyes", "/left", "a.py:3")
    assert own["timers"] == [{"name": "tick", "period_s": 0.1, "fired": 3, "missed": 0}]
    assert own["publishers"] == ["/x"]
    assert not nodes["/left/b"]["is_busflow"]


def test_an_action_stands_for_its_services():
    names = {"send_goal": "lab/action/Move_SendGoal", "get_result": "lab/action/Move_GetResult"}
    ends = [
        Token("ab", 0, at, TokenKind.SERVICE, "/", "arm", f"/arm/move/_action/{part}", type_, "RIHS01_0", "::,7:,:,:,,")
        for at, (part, type_) in enumerate(names.items())
    ]
    goals = {"node": "/arm", "received": 2, "succeeded": 1, "running": 1}
    answer = looked(0, 0).processes[0]
    line = {"name": "/arm/move/_action/send_goal", "servers": [goals], "clients": []}
    services = graph_answer(Moment(view(ends, [{**answer, "services": [line]}]), 1.0), None, {})["services"]
    shown = [each for each in services if not each["hidden"]]
    kind = {"name": "/arm/move", "type": "lab/action/Move", "is_action": True, "hidden": False}
    assert shown == [{**kind, "servers": [goals], "clients": []}]
    assert [each["name"] for each in services if each["hidden"]] == ["/arm/move/_action/get_result"]


def test_the_first_look_has_no_rate():
    assert graph_answer(Moment(looked(10, 0), 1.0), None, {})["topics"][0]["rate_hz"] is None


# The heartbeat.


def test_a_long_silence_ends_with_an_answer(monkeypatch: pytest.MonkeyPatch):
    """The question that was asked during the silence fails; a later one is answered."""
    monkeypatch.setattr(timeouts, "current", timeouts.current._replace(silence=0.1))
    answers_again = threading.Event()

    class Run:
        asked = 0

        def ask(self, _question: str) -> list[int]:
            self.asked += 1
            if self.asked == 1:
                answers_again.wait(PATIENCE_S)
                raise InspectionUnavailable("it does not answer")
            return [1]

    async def main() -> list[float | None]:
        said: list[float | None] = []
        over = asyncio.Event()

        def on_change(silent_s: float | None) -> None:
            said.append(silent_s)
            if silent_s is None:
                over.set()
            else:
                answers_again.set()

        peer: Any = Run()
        heartbeat = Heartbeat(peer, lambda: True, on_change)
        beating = asyncio.create_task(heartbeat.keep())
        async with asyncio.timeout(PATIENCE_S):
            await over.wait()
        beating.cancel()
        heartbeat.close()
        return said

    *silent, last = asyncio.run(main())
    assert last is None
    assert silent
    assert all(silent)


# Sessions.


def answered(*sent: Mapping[str, Any], read_only: bool = False, **questions: Any) -> list[dict[str, Any]]:
    """The frames that a page is sent after its own."""
    frames_sent: list[dict[str, Any]] = []

    async def main() -> None:
        session = Session(
            questions, lambda text: frames_sent.append(json.loads(text)), read_only=read_only, print_message=print
        )
        for each in sent:
            session.take(json.dumps(each))
        for _ in range(20):
            await asyncio.sleep(0)
        session.close()

    asyncio.run(main())
    return frames_sent


def saying(found: object) -> Callable[[Mapping[str, Any]], Awaitable[object]]:
    async def answer(_arguments: Mapping[str, Any]) -> object:
        if isinstance(found, Exception):
            raise found
        return found

    return answer


def asked(question: str, id_: int = 1) -> dict[str, Any]:
    return {"op": "busflow/ask", "id": id_, "question": question}


def test_a_question_is_answered_under_its_number():
    (found,) = answered(asked("graph", 9), graph=Question(saying({"nodes": []})))
    assert found == {"op": "busflow/answer", "id": 9, "answer": {"nodes": []}}


def test_an_error_is_one_sentence():
    (found,) = answered(asked("order"), order=Question(saying(NoSuchTarget("no /x\x1b[2J"))))
    assert found["error"] == r"no /x\x1b[2J"


def test_a_mistake_of_ours_is_answered_too(capsys: pytest.CaptureFixture[str]):
    (found,) = answered(asked("graph"), graph=Question(saying(ZeroDivisionError("secret"))))
    assert "secret" not in found["error"]
    assert "please report it" in capsys.readouterr().out


def test_a_page_that_looks_changes_nothing(golden: Golden):
    done: list[int] = []

    async def order(_arguments: Mapping[str, Any]) -> object:
        done.append(1)
        return {}

    questions = {"order": Question(order, changes=lambda _: True)}
    (found,) = answered(asked("order"), read_only=True, **questions)
    golden(found["error"])
    assert not done
    answered(asked("order"), read_only=False, **questions)
    assert done


def test_an_unknown_question_names_the_nearest(golden: Golden):
    (found,) = answered(asked("grap"), graph=Question(saying({})))
    golden(found["error"])


def test_waiting_questions_of_a_page_are_bounded():
    async def forever(_arguments: Mapping[str, Any]) -> object:
        return await asyncio.get_running_loop().create_future()

    found = answered(*(asked("graph", id_) for id_ in range(20)), graph=Question(forever))
    assert [each["id"] for each in found] == [16, 17, 18, 19]
    assert "ask again" in found[0]["error"]


def test_a_followed_answer_is_sent_at_once(golden: Golden):
    follow = {"op": "busflow/follow", "question": "graph", "on": True}
    (found,) = answered(follow, follow, graph=Question(saying({"nodes": []}), remaining=Changed))
    assert found == {"op": "busflow/update", "question": "graph", "answer": {"nodes": []}}
    with golden.raises(MalformedMessage):
        answered(follow, graph=Question(saying({})))


# Of a run.


class TornBridge:
    """A run's bridge whose first graph is none: what is made of it fails, as by a mistake of ours."""

    def __init__(self) -> None:
        self.peer: Any = SimpleNamespace(run=SimpleNamespace(name="lab", card=SimpleNamespace(file="/nowhere.yaml")))
        self.catalogue = SimpleNamespace(channels={})
        self.graph: Any = None
        self.looked_s = 0.0

    async def ask(self, question: Callable[..., Any], *arguments: Any) -> Any:
        return question(*arguments)

    call = ask

    async def next_look(self) -> None:
        await asyncio.sleep(0)
        self.looked_s += 1.0
        self.graph = view([], []) if self.looked_s > 2 else None


def test_a_failed_answer_holds_up_no_later(capsys: pytest.CaptureFixture[str]):
    async def main() -> dict[str, Any]:
        bridge: Any = TornBridge()
        questions = RunQuestions(bridge, print_message=print)
        sent: asyncio.Queue[str] = asyncio.Queue()
        page: Any = SimpleNamespace(send=sent.put_nowait, read_only=True)
        questions.session(page).take('{"op":"busflow/follow","question":"graph","on":true}')
        keeping = asyncio.create_task(questions.keep())
        try:
            return json.loads(await asyncio.wait_for(sent.get(), PATIENCE_S))
        finally:
            keeping.cancel()
            questions.close()

    found = asyncio.run(main())
    assert found["question"] == "graph"
    assert found["answer"]["nodes"] == []
    assert "please report it" in capsys.readouterr().out


# The assistant.


def test_an_allowance_comes_back_with_time(golden: Golden):
    allowance = Allowance(3)
    for now_s in (0, 1, 2):
        allowance.take(now_s)
    for now_s in (2, 59.9):
        with golden.raises(NotAllowed):
            allowance.take(now_s)
    allowance.take(60)
    with golden.raises(NotAllowed):
        allowance.take(60)


class Pages(dict[str, str]):
    """A book of sources by name."""

    def names(self) -> list[str]:
        return list(self)

    def source(self, name: str) -> str:
        return self[name]


def cited(page: str, start: int, text: str) -> dict[str, Any]:
    return {"page": page, "start": start, "end": start + len(text), "text": text, "score": 1.0}


def test_the_same_text_is_the_same_page():
    pages = CitedPages(Pages({"lab1.md": "A b.", "new.md": "C"}), {"tutorial/lab1.md": "A b.", "lab1.md": "other"})
    assert pages.page_of("lab1.md") == "tutorial/lab1.md"
    assert pages.page_of("new.md") == ""
    assert pages.page_of("strange.md") == ""
    placed = pages.placed(cited("tutorial/lab1.md", 2, "b."))
    assert (placed["chapter"], placed["start"], placed["end"]) == ("lab1.md", 2, 4)


def test_a_citation_has_its_text_or_no_place():
    pages = CitedPages(Pages({"a.md": "New. A b."}), {"a.md": "A b. Gone.", "b.md": "x"})
    assert pages.page_of("a.md") == "a.md"
    assert pages.placed(cited("a.md", 2, "b."))["start"] == 7
    gone = pages.placed(cited("a.md", 5, "Gone."))
    assert (gone["chapter"], gone["start"], gone["end"]) == ("a.md", -1, -1)
    assert pages.placed(cited("b.md", 0, "x"))["chapter"] == ""
    assert pages.placed(cited("", 3, "of the selection"))["start"] == 3


@pytest.mark.parametrize("message", ['{"op":"subscribe","subscriptions":[]}', b"\x01\x00\x00\x00\x00"])
def test_asking_pages_may_not_look(message: str | bytes, golden: Golden):
    session = Session({}, lambda _: None, read_only=True, print_message=lambda _: None)
    with golden.raises(NotAllowed):
        AskingOnly(session).take(message)
