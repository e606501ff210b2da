"""Completeness: what is missing in a recording, by what its recorder said in the end and what is there."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

from busflow.text import counted

if TYPE_CHECKING:
    from busflow.recording.bag.facts import RunOutcome


class Shortfall(NamedTuple):
    """One reason for which a recording is not the whole of what happened."""

    code: str
    """A stable word: unfinished, missed, sequence; or ledger, where it says otherwise than what is there."""
    text: str


def shortfalls(ledger: RunOutcome | None, *, unfinished: bool, gaps: int, there: int) -> Iterator[Shortfall]:
    """Everything that is missing in what busflow has recorded.

    Args:
        ledger: What the recorder said in the end; None where it did not come to that.
        unfinished: True if it was reported already that a file has no end.
        gaps: Messages that were numbered and are not there; 0 where that is not known, or was reported.
        there: Messages that are there.
    """
    if ledger is None:
        if not unfinished:
            yield Shortfall("unfinished", "its recorder did not finish it")
        return
    if ledger.missed:
        yield Shortfall("missed", f"the recorder could not keep up with {counted(ledger.missed, 'message')}")
    if ledger.recovered is not None:
        yield Shortfall("unfinished", f"it was recovered: {ledger.recovered}")
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
