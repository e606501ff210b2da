"""`BagFile`: what a bag needs of each of its files, however they store messages."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from busflow.errors import BagError
from busflow.recording.bag.channel import Channel

SINCE, UNTIL = 0, (1 << 64) - 1
"""The times of a walk that leaves out nothing."""


@dataclass(frozen=True, slots=True)
class Overview:
    """What a file tells without being read."""

    counts: Mapping[Channel, int]
    start_ns: int | None
    """None where there is no message."""
    end_ns: int | None


class BagFile(Protocol):
    """One file of a bag."""

    path: Path
    size: int
    unfinished: BagError | None
    """Why it is known to have no end."""
    metadata: dict[str, dict[str, str]]
    """What busflow has written beside the messages, as far as it was met."""
    launch_file: str | None

    @property
    def recorder(self) -> str:
        """The program that wrote it, in its own words."""
        ...

    @property
    def channels(self) -> Collection[Channel]:
        """Those that were met so far."""
        ...

    def overview(self) -> Overview | None:
        """What the file tells of itself; None where all of it has to be read for that."""
        ...

    def spans(self) -> Mapping[Channel, tuple[int, int]] | None:
        """When each channel's first and last message was recorded; None where all has to be read for that."""
        ...

    def walk(self, wanted: Callable[[Channel], bool], since_ns: int = SINCE, until_ns: int = UNTIL) -> Iterator[object]:
        """The messages, as entries, and whatever else there is between them.

        Raises:
            BagError: The file is damaged here, or ends without having been finished.
        """
        ...
