"""`BagFile`: what a bag needs of each of its files, however they store messages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, Self

from busflow.errors import BagError
from busflow.recording.bag.channel import Channel

SINCE, UNTIL = 0, (1 << 64) - 1
"""The times of a walk that leaves out nothing."""


@dataclass(frozen=True, slots=True)
class Survey:
    """Counts and times of a bag, or of some of its files: as a summary states them, or as reading has shown."""

    counts: Mapping[Channel, int]
    start_ns: int | None
    """None where there is no message."""
    end_ns: int | None
    gaps: int = 0
    """Numbers without a message; known once all was read."""

    @property
    def messages(self) -> int:
        """The number of messages."""
        return sum(self.counts.values())

    @classmethod
    def of(cls, parts: Sequence[Self]) -> Self:
        """Return the contents of several files together."""
        counts: Counter[Channel] = Counter()
        for each in parts:
            counts.update(each.counts)
        starts = [each.start_ns for each in parts if each.start_ns is not None]
        ends = [each.end_ns for each in parts if each.end_ns is not None]
        return cls(counts, min(starts, default=None), max(ends, default=None), sum(each.gaps for each in parts))


class BagFile(Protocol):
    """One file of a bag."""

    path: Path
    size: int
    unfinished: BagError | None
    """The reason why the file is known to have no end."""
    metadata: dict[str, dict[str, str]]
    """The facts and ledger beside the messages, as far as they were read."""
    launch_file: str | None

    @property
    def recorder(self) -> str:
        """The program that wrote it, in its own words."""
        ...

    @property
    def channels(self) -> Collection[Channel]:
        """The channels read so far."""
        ...

    def overview(self) -> Survey | None:
        """Return the contents as the file's summary states them; None where the whole file would have to be read."""
        ...

    def spans(self) -> Mapping[Channel, tuple[int, int]] | None:
        """Return the times of each channel's first and last message; None if the whole file would have to be read."""
        ...

    def walk(self, wanted: Callable[[Channel], bool], since_ns: int = SINCE, until_ns: int = UNTIL) -> Iterator[object]:
        """Yield the messages, as entries, and the other records between them.

        Raises:
            BagError: The file is damaged here, or ends without having been finished.
        """
        ...
