"""Tokens and queries reach the loop in order, each once as it is then, and never more than a run could have."""

import asyncio
from typing import Any

import pytest

from busflow.bus.bus import Bus
from busflow.clock import SystemClock
from busflow.wire.mirror import token_intake
from busflow.wire.mirror.token_intake import TokenIntake
from tests.golden import Golden

pytestmark = pytest.mark.asyncio


class Lines:
    """A log that keeps its warnings."""

    def __init__(self) -> None:
        self.warnings: list[str] = []

    def warning(self, text: str) -> None:
        self.warnings.append(text)


@pytest.fixture
def seen() -> list[Any]:
    return []


@pytest.fixture
def log() -> Lines:
    return Lines()


@pytest.fixture
def intake(seen: list[Any], log: Lines) -> TokenIntake:
    def on_loop(work: Any) -> None:
        asyncio.get_running_loop().call_soon_threadsafe(work)

    return TokenIntake(Bus(SystemClock()).dispatcher, on_loop, lambda *token: seen.append(token), log)


async def settled(intake: TokenIntake) -> None:
    """Wait until all that was handed over before has been handled."""
    done = asyncio.Event()
    intake.hand(done.set)
    await done.wait()


async def test_tokens_and_queries_keep_their_order(intake: TokenIntake, seen: list[Any]):
    intake.take("a", True)
    intake.hand(seen.append, "query")
    intake.take("b", True)
    await settled(intake)
    intake.take("a", False)
    await settled(intake)
    assert seen == [("a", True), "query", ("b", True), ("a", False)]


async def test_a_token_that_changes_is_handled_once(intake: TokenIntake, seen: list[Any]):
    errors: list[Any] = []
    asyncio.get_running_loop().set_exception_handler(lambda _loop, context: errors.append(context))
    for alive in (True, False) * 1000:
        intake.take("a", alive)
    intake.take("b", True)
    await settled(intake)
    assert seen == [("a", False), ("b", True)]
    assert errors == []


async def test_too_many_tokens_are_one_line(
    intake: TokenIntake, seen: list[Any], log: Lines, monkeypatch: pytest.MonkeyPatch, golden: Golden
):
    monkeypatch.setattr(token_intake, "MOST_TOKENS", 100)
    for number in range(1000):
        intake.take(str(number), True)
    await settled(intake)
    assert seen == [(str(number), True) for number in range(100)]
    assert intake.ignored == 900
    golden("\n".join(log.warnings))
    intake.take("500", False)
    intake.take("5", False)
    intake.take("1000", True)
    await settled(intake)
    assert seen[100:] == [("5", False), ("1000", True)], "who has gone makes room"


async def test_an_error_holds_up_no_other_token(intake: TokenIntake, seen: list[Any]):
    loop = asyncio.get_running_loop()
    errors: list[Any] = []
    loop.set_exception_handler(lambda _loop, context: errors.append(context["exception"]))
    intake.hand(lambda: 1 / 0)
    intake.take("a", True)
    await settled(intake)
    assert seen == [("a", True)]
    assert [type(each) for each in errors] == [ZeroDivisionError]
