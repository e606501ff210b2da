"""The assistant answers over its service, in a graph on virtual time."""

from pathlib import Path

import pytest

from busflow.cli import main
from busflow.recording.bag import Bag
from busflow.testing import harness, replay, virtual_time
from busflow_assistant import timeouts
from busflow_assistant.assistant import Assistant
from busflow_assistant.messages import AnswerPart, AskText, Exchange
from busflow_assistant.page_index import PageIndex

ROOT = Path(__file__).parents[2]
PAGE = Path(__file__).parent / "pages/lab1.md"
TEXTBOOK = ROOT / "configs/textbook.yaml"
QUESTION = "What does the sensor processor node do?"


def nodes(**parameters):
    return PageIndex(pages=[str(PAGE)]), Assistant(**parameters)


@virtual_time
async def test_answer_cites_the_page_by_its_offsets():
    async with harness(*nodes()) as lab:
        await lab.advance(1)
        response = await lab.call(AskText, "assistant/ask", AskText.Request(question=QUESTION, page="lab1.md"))
    source = PAGE.read_text(encoding="utf-8")
    assert (response.answered, response.scope, response.engine) == (True, "page", "extractive")
    assert [source[each.start : each.end] for each in response.citations] == [each.text for each in response.citations]


@virtual_time
async def test_first_question_waits_until_pages_are_read():
    async with harness(*nodes()) as lab:
        response = await lab.call(AskText, "assistant/ask", AskText.Request(question=QUESTION, page="lab1.md"))
    assert response.answered, response.answer


@virtual_time
async def test_without_pages_a_question_is_refused(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(timeouts, "current", timeouts.Timeouts())
    async with harness(Assistant()) as lab:
        response = await lab.call(
            AskText, "assistant/ask", AskText.Request(question=QUESTION, page="lab1.md"), timeout=20.0
        )
    assert response.reason == "unknown_page"


@virtual_time
async def test_answer_streams_with_its_id():
    async with harness(*nodes()) as lab:
        await lab.advance(1)
        asked = AskText.Request(question="What topics does this lab use for communication?", page="lab1.md", id="q1")
        response = await lab.call(AskText, "assistant/ask", asked)
        parts = lab.received("assistant/tokens", AnswerPart)
    assert {each.id for each in parts} == {response.id} == {"q1"}
    assert "".join(each.text for each in parts) == response.answer
    assert [each.number for each in parts] == list(range(len(parts)))
    assert [each.last for each in parts] == [False] * (len(parts) - 1) + [True]


@virtual_time
async def test_refusal_has_a_reason_and_no_citation():
    async with harness(*nodes()) as lab:
        await lab.advance(1)
        response = await lab.call(
            AskText, "assistant/ask", AskText.Request(question="Which GPU does the lab need?", page="lab1.md")
        )
    assert not response.answered
    assert response.citations == ()
    assert response.reason in {"not_said", "off_topic"}
    assert "It speaks of" in response.answer


@pytest.mark.parametrize(("keep", "kept"), [(False, 0), (True, 1)])
def test_questions_are_kept_only_on_request(keep, kept):
    @virtual_time
    async def asked() -> list[Exchange]:
        async with harness(*nodes(keep_questions=keep)) as lab:
            await lab.advance(1)
            await lab.call(AskText, "assistant/ask", AskText.Request(question=QUESTION, page="lab1.md"))
            return lab.received("assistant/log", Exchange)

    assert [each.question for each in asked()] == [QUESTION] * kept


@virtual_time
async def test_same_question_has_the_same_answer():
    async with harness(*nodes()) as lab:
        await lab.advance(1)
        asked = AskText.Request(question=QUESTION, page="lab1.md", id="same")
        first = await lab.call(AskText, "assistant/ask", asked)
        assert await lab.call(AskText, "assistant/ask", asked) == first


@virtual_time
async def test_changed_page_changes_the_answer(tmp_path: Path):
    page = tmp_path / "pump.md"
    page.write_text("# Pump\n\nThe pump runs at 20 Hz.\n")
    async with harness(PageIndex(pages=[str(page)]), Assistant()) as lab:
        await lab.advance(1)
        asked = AskText.Request(question="How often does the pump run?", page="pump.md")
        assert "20 Hz" in (await lab.call(AskText, "assistant/ask", asked)).answer
        page.write_text("# Pump\n\nThe pump runs at 30 Hz now.\n")
        await lab.advance(1)
        assert "30 Hz" in (await lab.call(AskText, "assistant/ask", asked)).answer


@virtual_time
async def test_pasted_text_is_answered_without_an_index(ros2_lab: str):
    async with harness(Assistant) as lab:
        response = await lab.call(AskText, "assistant/ask", AskText.Request(question=QUESTION, selection=ros2_lab))
    assert (response.answered, response.scope) == (True, "selection")


@virtual_time
async def test_textbook_answers_beside_the_running_lab():
    args = {"pages": [str(PAGE)]}
    async with harness(TEXTBOOK, args=args) as lab:
        await lab.advance(10)
        response = await lab.call(AskText, "assistant/ask", AskText.Request(question=QUESTION, page="lab1.md"))
        assert response.answered
        assert len(lab.received("imu/data")) == 100
    assert lab.ledger.dropped == 0


def test_textbook_has_no_problem(capsys: pytest.CaptureFixture[str]):
    assert main(["check", str(TEXTBOOK), "--strict"]) == 0
    assert capsys.readouterr().out == "no problems\n"


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of two questions with their answers."""
    path = tmp_path_factory.mktemp("recording") / "asked.mcap"

    @virtual_time
    async def asked() -> None:
        record = {"to": str(path)}
        async with harness(*nodes(keep_questions=True), record=record) as lab:
            await lab.advance(1)
            for question in (QUESTION, "Which GPU does the lab need?"):
                await lab.call(AskText, "assistant/ask", AskText.Request(question=question, page="lab1.md"))
                await lab.advance(1)

    asked()
    return path


def test_replay_of_the_same_assistant_is_the_same(recording: Path):
    replayed = replay(str(recording), Assistant)
    replayed.assert_same()
    assert [each.question for each in replayed.outputs["/assistant/log"]] == [QUESTION, "Which GPU does the lab need?"]


def test_replay_shows_an_answer_that_changed(recording: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("busflow_assistant.refuse.LEAST_SCORE", 99.0)
    replayed = replay(str(recording), Assistant)
    assert not replayed.same
    assert "/assistant/log" in str(replayed.differences)


def test_recording_without_the_assistant_has_no_question(tmp_path: Path):
    path = tmp_path / "quiet.mcap"

    @virtual_time
    async def asked() -> None:
        record = {"to": str(path), "exclude": ["/assistant/**"]}
        async with harness(*nodes(keep_questions=True), record=record) as lab:
            await lab.advance(1)
            await lab.call(AskText, "assistant/ask", AskText.Request(question=QUESTION, page="lab1.md"))

    asked()
    with Bag(str(path)) as bag:
        assert [channel.topic for channel in bag.channels if "assistant/" in channel.topic] == []
        assert QUESTION.encode() not in b"".join(bytes(entry.payload) for entry in bag.entries())
