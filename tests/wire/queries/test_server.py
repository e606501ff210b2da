"""What a run answers to good questions and to bad ones; and that it goes on after any."""

import json
import threading

import pytest
import zenoh

from busflow import Node, publisher
from busflow.errors import BusflowError, InspectionUnavailable, NoSuchTarget
from busflow.msgs.std_msgs import Int64
from busflow.wire.queries import server as answers_module
from busflow.wire.zenoh.keys import QUERY_PREFIX

pytestmark = pytest.mark.asyncio


class Talker(Node):
    numbers = publisher(Int64, "numbers")


def raw(peer, question, payload, **words):
    """The replies to a question as it is, each decoded from JSON."""
    replies = peer.session.get(f"{QUERY_PREFIX}/main/{question}", payload=payload, timeout=60, **words)
    return [json.loads(reply.ok.payload.to_bytes()) for reply in replies if reply.ok is not None]


@pytest.mark.parametrize(
    ("question", "payload", "kind", "error"),
    [
        ("graph", b"not json", "JSONDecodeError", "Expecting value"),
        ("graph", b"\xff\xff", "UnicodeDecodeError", "decode"),
        ("graph", b"[]", "TypeError", "arguments are a JSON object"),
        ("graph", b"[" * 100_000, "RecursionError", ""),
        ("graph", b'{"a": "' + b"x" * (1 << 20) + b'"}', "ValueError", "at most 1048576 are read"),
        ("grpah", b"{}", "ValueError", "there is no question 'grpah'; did you mean 'graph'?"),
        ("history", b"{}", "ValueError", "history needs the argument 'topic'"),
        ("history", b'{"topic": "/nubmers"}', "NoSuchTarget", "did you mean '/numbers'"),
        ("history", b'{"topic": ["/numbers"]}', "TypeError", ""),
        ("history", b'{"topic": "/numbers", "count": "many"}', "ValueError", "many"),
        ("history", b'{"topic": "/numbers", "count": 1e999}', "OverflowError", ""),
        ("history", b'{"topic": "/numbers", "count": {}}', "TypeError", ""),
        ("measure", b'{"topic": "/numbers"}', "ValueError", "measure needs the argument 'reader'"),
        ("types", b'{"names": "std_msgs"}', "ValueError", "names is a list of type names"),
        ("types", b'{"names": 7}', "ValueError", "names is a list of type names"),
    ],
)
async def test_a_bad_query_is_answered_with_its_error(looked_at, question, payload, kind, error):
    async with looked_at(Talker) as looked:
        (told,) = await looked.ask(raw, looked.peer, question, payload)
        assert error in told["error"]
        assert kind in told["kind"]
        assert (await looked.ask(looked.peer.ask, "run"))[0]["nodes"] == 1


async def test_a_peer_raises_the_runs_error(looked_at):
    async with looked_at(Talker) as looked:
        with pytest.raises(NoSuchTarget, match="/nubmers"):
            await looked.ask(looked.peer.ask, "history", topic="/nubmers")
        with pytest.raises(BusflowError, match="names"):
            await looked.ask(looked.peer.ask, "types", names=7)


async def test_fault_in_an_answer_reaches_both_sides(looked_at, monkeypatch, capsys):
    async with looked_at(Talker) as looked:
        monkeypatch.setattr(type(looked.graph), "report", lambda _graph: [].nothing)
        (told,) = await looked.ask(raw, looked.peer, "report", b"{}")
        assert told["kind"] == "AttributeError"
        monkeypatch.undo()
        assert (await looked.ask(looked.peer.ask, "report"))[0]["name"] == "graph"
    assert "the question report " in capsys.readouterr().err


@pytest.mark.parametrize("question", ["*", "**", "a/b", "g$*"])
async def test_a_question_to_everything_harms_nothing(looked_at, question):
    async with looked_at(Talker) as looked:
        await looked.ask(raw, looked.peer, question, b"{}")
        assert (await looked.ask(looked.peer.ask, "run"))[0]["nodes"] == 1


async def test_queries_waiting_for_a_busy_loop_are_bounded(looked_at):
    async with looked_at(Talker) as looked:
        ended, answered = threading.Semaphore(0), []
        count = answers_module._MOST_WAITING + 50

        def flood():
            for _ in range(count):
                heard = zenoh.handlers.Callback(answered.append, drop=ended.release, indirect=False)
                looked.peer.session.get(f"{QUERY_PREFIX}/main/run", heard, timeout=60)
            # The loop is held up by this very wait: what was not taken comes back at once.
            for _ in range(50):
                assert ended.acquire(timeout=60)

        flood()
        await looked.until(lambda: len(answered) >= answers_module._MOST_WAITING // 2)
        assert (await looked.ask(looked.peer.ask, "run"))[0]["nodes"] == 1


async def test_a_blocked_runs_graph_is_still_seen(looked_at):
    async with looked_at(Talker) as looked:
        looked.peer._patience_s = 0.2
        with pytest.raises(InspectionUnavailable, match="looked"):
            looked.peer.ask("graph")  # on the loop itself, which waits for the answer
        nodes = {token.node_name for token in looked.peer.tokens()}
        assert {"/talker"} <= nodes
