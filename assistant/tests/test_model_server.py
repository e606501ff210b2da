"""A model on a server, over a real socket: it writes, and the assistant shows what the page supports."""

import asyncio
import json
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

import busflow
from busflow_assistant.assistant import Assistant
from busflow_assistant.messages import AnswerPart, AskText, AssistantState
from busflow_assistant.page_index import PageIndex

KEY = "secret-of-the-test"
PAGE = "# Pump\n\nThe pump runs at 20 Hz.\n\nA worn seal is not repaired, it is replaced.\n"


class ScriptedServer:
    """Answers each request with the same pieces, and keeps what it was sent."""

    def __init__(self, pieces: Sequence[str], *, status: int = 200, stall: bool = False, raw: bytes = b"") -> None:
        self.pieces, self.status, self.stall, self.raw = pieces, status, stall, raw
        self.requests: list[tuple[str, dict]] = []

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = (await reader.readuntil(b"\r\n\r\n")).decode()
        size = int(next(line for line in head.lower().splitlines() if line.startswith("content-length")).split(":")[1])
        self.requests.append((head, json.loads(await reader.readexactly(size))))
        writer.write(
            f"HTTP/1.1 {self.status} X\r\nContent-Type: text/event-stream\r\nConnection: close\r\n\r\n".encode()
        )
        for piece in self.pieces:
            event = {"choices": [{"delta": {"content": piece}}]}
            writer.write(f"data: {json.dumps(event)}\n\n".encode())
            await writer.drain()
        writer.write(self.raw or b"data: [DONE]\n\n")
        await writer.drain()
        if self.stall:
            await reader.read()  # until the client has had enough
        writer.close()


@asynccontextmanager
async def asked_beside(server: ScriptedServer, page: Path, **endpoint) -> AsyncIterator[busflow.Graph]:
    """A graph whose assistant has read the page and asks the server."""
    listening = await asyncio.start_server(server.serve, "127.0.0.1", 0)
    port = listening.sockets[0].getsockname()[1]
    given = {"url": f"http://127.0.0.1:{port}/v1", "model": "tiny", "timeout_s": 5, **endpoint}
    async with listening, busflow.launch(PageIndex(pages=[str(page)]), Assistant(endpoint=given)) as graph:
        await graph.node(Assistant).pages_read.wait()
        yield graph


@pytest.fixture
def page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ASSISTANT_TEST_KEY", KEY)
    path = tmp_path / "pump.md"
    path.write_text(PAGE)
    return path


def ask(server: ScriptedServer, page: Path, question: str = "How often does the pump run?", **endpoint):
    async def answered():
        async with asked_beside(server, page, **endpoint) as graph:
            parts = graph.subscribe(AnswerPart, "assistant/tokens")
            response = await graph.call(AskText, "assistant/ask", AskText.Request(question=question, page="pump.md"))
            said = []
            async for part in parts:
                said.append(part.text)
                if part.last:
                    break
            return response, "".join(said)

    return asyncio.run(answered())


def test_supported_sentences_are_shown_and_streamed(page: Path):
    server = ScriptedServer(["The pump ru", "ns at 20 Hz. ", "It is made in Italy."])
    response, streamed = ask(server, page)
    assert response.answer == streamed == "The pump runs at 20 Hz."
    assert response.engine.startswith("tiny at 127.0.0.1:")
    assert "20 Hz" in response.citations[0].text


@pytest.mark.parametrize(
    ("server", "endpoint"),
    [
        (ScriptedServer(["The pump runs at 50 Hz."]), {}),
        (ScriptedServer([], status=500), {}),
        (ScriptedServer([], raw=b"data: {no json\n\n"), {}),
        (ScriptedServer(["x" * 70_000]), {}),
        (ScriptedServer([], stall=True, raw=b": wait\n\n"), {"timeout_s": 0.2}),
    ],
    ids=["unsupported", "status", "no-json", "too-much", "silent"],
)
def test_page_answers_where_the_model_fails(page: Path, server: ScriptedServer, endpoint):
    response, streamed = ask(server, page, **endpoint)
    assert server.requests
    assert response.engine == "extractive"
    assert response.answer.startswith("The pump runs at 20 Hz.")
    assert streamed == response.answer


def test_question_without_an_answer_is_not_sent(page: Path):
    server = ScriptedServer(["Paris."])
    response, _ = ask(server, page, "What is the capital of France?")
    assert (response.answered, server.requests) == (False, [])


def test_key_goes_to_the_server_alone(page: Path):
    server = ScriptedServer(["The pump runs at 20 Hz."])

    async def looked() -> str:
        async with asked_beside(server, page, api_key_env="ASSISTANT_TEST_KEY") as graph:
            asked = AskText.Request(question="How often does the pump run?", page="pump.md")
            response = await graph.call(AskText, "assistant/ask", asked)
            state = await anext(aiter(graph.subscribe(AssistantState, "assistant/state", qos=busflow.TRANSIENT_LOCAL)))
            return repr((response, state, graph.node(Assistant).parameters, graph.node(Assistant).server.address))

    shown = asyncio.run(looked())
    assert f"Bearer {KEY}" in server.requests[0][0]
    assert KEY not in shown


def test_request_holds_only_question_and_citations(page: Path):
    server = ScriptedServer(["The pump runs at 20 Hz."])
    ask(server, page)
    (_, body) = server.requests[0]
    assert (body["model"], body["stream"], body["max_tokens"]) == ("tiny", True, 300)
    assert "How often does the pump run?" in body["messages"][1]["content"]
    assert "worn seal" not in json.dumps(body)


def test_budget_ends_the_requests(page: Path):
    server = ScriptedServer(["The pump runs at 20 Hz."])

    async def twice() -> list[str]:
        async with asked_beside(server, page, requests_per_hour=1) as graph:
            asked = AskText.Request(question="How often does the pump run?", page="pump.md")
            return [(await graph.call(AskText, "assistant/ask", asked)).engine for _ in range(2)]

    first, second = asyncio.run(twice())
    assert first.startswith("tiny")
    assert (second, len(server.requests)) == ("extractive", 1)
