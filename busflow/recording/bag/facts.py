"""Facts and ledger: what busflow writes beside the messages, about the run's set-up and its end."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self, cast

FACTS = "busflow"
"""The name of the metadata at the beginning of a recording."""

LEDGER = "busflow.ledger"
"""The name of the metadata at its end."""

PART = "busflow.part"
"""The name of the metadata at the beginning of a part of a recording that was split."""

LAUNCH_FILE = "launch.yaml"
"""The name of the attachment."""

LATER_PUBLISHERS = "later_publishers"
"""The key in the ledger of the nodes, by topic, that came after their channel was written; left out if none did."""

LACKING = "lacking"
"""The key in the ledger of losses before the recorder, in words, e.g. of a killed process; left out without any."""

NONE_LATER: Mapping[str, Sequence[str]] = {}

_VERSIONS = ("busflow", "python")
_NUMBER = re.compile(r"-?\d{1,19}", re.ASCII)


@dataclass(frozen=True, slots=True)
class Facts:
    """The set-up of a recorded run."""

    run: str = ""
    seed: int | None = None
    clock: str = ""
    """`system` or `sim`."""
    started_ns: int | None = None
    """The start of the recording, on the run's clock."""
    versions: Mapping[str, str] = field(default_factory=dict[str, str])
    """The versions of busflow, Python and the libraries that the recorder named."""
    format: str = ""
    recorded_by: str = ""
    """`from outside` where the recorder joined the run and was no part of it."""
    launch_file: str | None = None
    """The launch file, as it was resolved."""
    process: str = ""
    """The process that made this file, if each records itself; empty if one recording has all."""


@dataclass(frozen=True, slots=True)
class Cut:
    """The place of a file in the recording from which it was converted, where it is only a part of it."""

    of: str
    """The name of that recording."""
    from_ns: int | None = None
    """Where it begins and ends, counted from the first message there; None where that recording does."""
    to_ns: int | None = None
    without: tuple[str, ...] = ()
    """The topics that were left out."""

    def __str__(self) -> str:
        times = {"from": self.from_ns, "to": self.to_ns}
        found = [f"{word} {at_ns / 1e9:g} s" for word, at_ns in times.items() if at_ns is not None]
        found = [" ".join(found)] * bool(found) + [f"without {', '.join(self.without)}"] * bool(self.without)
        return ", ".join([f"a part of {self.of}", *found])

    @classmethod
    def of_words(cls, metadata: Mapping[str, str]) -> Self | None:
        """Return what a metadata record says; None if it speaks of no other recording."""
        if "of" not in metadata:
            return None
        without = tuple(json_object(metadata.get("without")))
        return cls(metadata["of"], _number(metadata.get("from")), _number(metadata.get("to")), without)

    @property
    def words(self) -> dict[str, str]:
        """The entries of a metadata record."""
        times = {"from": self.from_ns, "to": self.to_ns}
        stated = {word: str(at_ns) for word, at_ns in times.items() if at_ns is not None}
        return {"of": self.of, **stated, "without": json.dumps(dict.fromkeys(self.without))}


@dataclass(frozen=True, slots=True)
class BagPart:
    """The place of a file among the parts of a recording that was split.

    Repeats are the latched messages of earlier parts. They come first in each part, with the number 0; a reader of all
    parts skips them.
    """

    number: int
    first: int
    """The number of its first message."""
    repeated: Mapping[str, int] = field(default_factory=dict[str, int])
    """The number of repeats of each topic."""
    reason: str = ""
    """What a snapshot shows; empty for a part of an ordinary recording."""
    cut: Cut | None = None

    @property
    def begins_later(self) -> bool:
        """True if it begins with other messages than the first of the run, or lacks some of its topics."""
        return bool(self.reason) or self.first > 1 or self.cut is not None


@dataclass(frozen=True, slots=True)
class RunOutcome:
    """The end of a recorded run."""

    report: Mapping[str, Any]
    """The run's account of itself, as `busflow run --report` writes it."""
    recorded: int | None
    """The messages that were recorded."""
    missed: int
    """The messages that the recorder could not write."""
    complete: bool
    """True if the recorder states that nothing is missing."""
    recovered: str | None = None
    """The statement of `busflow bag recover` about the damaged file."""
    continued: bool = False
    """True if another part follows."""
    lacking: str = ""
    """The losses before the recorder, in its words, e.g. that there is nothing of a killed process."""

    @property
    def topics(self) -> Iterator[Mapping[str, Any]]:
        """The report's statistics of each topic."""
        return mappings(self.report.get("topics"))


def facts_of(metadata: Mapping[str, str], launch_file: str | None) -> Facts:
    """Return the facts in a metadata record; what is not understood there is left out."""
    versions = {name: metadata[name] for name in _VERSIONS if name in metadata}
    versions |= {name: str(each) for name, each in json_object(metadata.get("versions")).items()}
    return Facts(
        run=metadata.get("run", ""),
        seed=_number(metadata.get("seed")),
        clock=metadata.get("clock", ""),
        started_ns=_number(metadata.get("started")),
        versions=versions,
        format=metadata.get("format", ""),
        recorded_by=metadata.get("heard", ""),
        launch_file=launch_file,
        process=metadata.get("process", ""),
    )


def ledger_of(metadata: Mapping[str, str]) -> RunOutcome:
    """Return the ledger in a metadata record."""
    return RunOutcome(
        report=json_object(metadata.get("report")),
        recorded=_number(metadata.get("recorded")),
        missed=_number(metadata.get("missed")) or 0,
        complete=metadata.get("complete") == "true",
        recovered=metadata.get("recovered"),
        continued=metadata.get("continued") == "true",
        lacking=metadata.get(LACKING, ""),
    )


def part_of(metadata: Mapping[str, str]) -> BagPart:
    """Return the place of a file in a metadata record; what is not understood there is left out."""
    counts = json_object(metadata.get("repeated")).items()
    repeated = {topic: count for topic, count in counts if isinstance(count, int)}
    number, first = _number(metadata.get("number")) or 0, _number(metadata.get("first")) or 1
    return BagPart(number, first, repeated, metadata.get("reason", ""), Cut.of_words(metadata))


def later_publishers(metadata: Mapping[str, str]) -> Mapping[str, Sequence[str]]:
    """Return the nodes, by topic, that came after their channel was written, from a ledger's metadata."""
    found = json_object(metadata.get(LATER_PUBLISHERS)).items()
    return {topic: [*map(str, cast("list[Any]", nodes))] for topic, nodes in found if isinstance(nodes, list)}


def joined(ledgers: Sequence[Mapping[str, str]]) -> Mapping[str, str]:
    """Join the ledgers of a recording's parts, given as words and in their order."""
    last = dict(ledgers[-1])
    for name in ("recorded", "missed"):
        counts = [_number(each.get(name)) for each in ledgers]
        if None not in counts:
            last[name] = str(sum(count or 0 for count in counts))
    complete = all(each.get("complete") == "true" for each in ledgers)
    return last if complete else {**last, "complete": "false"}


def summed(ledgers: Sequence[RunOutcome | None], report: Mapping[str, Any]) -> RunOutcome | None:
    """Join the ledgers of a run's processes; a count that one file lacks is unknown."""
    found = [each for each in ledgers if each is not None]
    if not found:
        return None
    counts = [None if each is None else each.recorded for each in ledgers]
    known = [count for count in counts if count is not None]
    return RunOutcome(
        report=report,
        recorded=sum(known) if len(known) == len(counts) else None,
        missed=sum(each.missed for each in found),
        complete=all(each.complete for each in found) and len(found) == len(ledgers),
    )


def mappings(value: Any) -> Iterator[Mapping[str, Any]]:
    """Yield the objects in a list of a report; it comes from a file, which may hold anything."""
    items = cast("list[Any]", value) if isinstance(value, list) else []
    yield from (cast("Mapping[str, Any]", each) for each in items if isinstance(each, dict))


def _number(text: str | None) -> int | None:
    return int(text) if text is not None and _NUMBER.fullmatch(text) else None


def json_object(text: str | None) -> dict[str, Any]:
    """Return the JSON object that a text holds; empty for anything else."""
    try:
        found = json.loads(text or "{}")
    except (ValueError, RecursionError):
        return {}
    return cast("dict[str, Any]", found) if isinstance(found, dict) else {}
