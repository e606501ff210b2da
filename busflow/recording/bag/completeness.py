"""Completeness: what is missing in a recording, by its recorder's account at the end and by its messages."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

from busflow.text import counted

if TYPE_CHECKING:
    from busflow.recording.bag.facts import RunOutcome


class Shortfall(NamedTuple):
    """One reason why a recording is incomplete."""

    code: str
    """A stable word: unfinished, missed, sequence; or ledger, if the account differs from the messages."""
    text: str


def shortfalls(ledger: RunOutcome | None, *, unfinished: bool, gaps: int, there: int) -> Iterator[Shortfall]:
    """Yield the reasons why a recording of busflow is incomplete.

    Args:
        ledger: The recorder's account at the end; None if it wrote none.
        unfinished: True if it was reported already that a file has no end.
        gaps: Numbers without a message; 0 where that is not known, or was reported.
        there: The number of messages that are there.
    """
    if ledger is None:
        if not unfinished:
            yield Shortfall("unfinished", "its recorder did not finish it")
        return
    if ledger.missed:
        yield Shortfall("missed", f"the recorder could not keep up with {counted(ledger.missed, 'message')}")
    if ledger.recovered is not None:
        yield Shortfall("unfinished", f"it was recovered: {ledger.recovered}")
    elif ledger.lacking:
        yield Shortfall("unfinished", ledger.lacking)
    elif not ledger.complete and not ledger.missed:
        yield Shortfall("unfinished", "its recorder says so")
    if gaps:
        yield Shortfall(
            "sequence", f"{counted(gaps, 'message is', 'messages are')} missing between those that are there"
        )
    if ledger.recorded is not None and ledger.recorded != there:
        code = "ledger" if ledger.recovered is None else "unfinished"  # what is recovered is mostly not all
        recorded = counted(ledger.recorded, "message was", "messages were")
        yield Shortfall(code, f"{recorded} recorded, and {there} {'is' if there == 1 else 'are'} there")
