"""Assignment: what a process of a run is told on its standard input, in one line, before it does anything.

The pipe stays open as long as the main process lives: its end is the end of whoever reads it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self, TextIO

from busflow.errors import ProcessFailed
from busflow.processes.memory import Memory
from busflow.wire.zenoh.run_directory import RunCard

_MOST_CHARACTERS = 1 << 24


@dataclass(frozen=True, slots=True)
class Assignment:
    """Who a process is, what it runs, and who else there is."""

    process: str
    socket: str
    """The name of its own socket in the run's directory."""
    directory: str
    card: RunCard
    nodes: tuple[str, ...]
    """The full names of its nodes."""
    others: tuple[str, ...]
    """The processes that it has to hear, and they it, before its nodes start."""
    seed: int
    log_level: str
    restarts: int
    """How often it was started anew."""
    nice: int
    env: Mapping[str, str]
    """The variables that are this process's own."""
    outer: Mapping[str, str | None]
    """Variables as they were for the main process when it read the launch file: it has to be the same one here."""
    watchdog_s: float | None
    tells_at_end: bool
    """Whether a failure that ends the process is told when the run has ended, so that the log need not."""
    path: tuple[str, ...]
    """Where Python looks for modules in the main process."""
    args: Mapping[str, object]
    """The launch file's arguments, where no command line gives them."""
    memory: Memory
    """What its nodes were told in a life before."""
    event_loop: str
    """The name of the one that it has, as all processes of the run."""
    record: Mapping[str, Any] | None = None
    """What it is to record, as the words of a `Share`."""

    def line(self) -> bytes:
        """What is written to the standard input."""
        return json.dumps(asdict(self), default=str).encode() + b"\n"

    @classmethod
    def read(cls, stream: TextIO | None) -> Self:
        """The assignment on a standard input.

        Raises:
            ProcessFailed: there is none: somebody else than busflow started this process.
        """
        try:
            told: dict[str, Any] = json.loads(stream.readline(_MOST_CHARACTERS)) if stream is not None else {}
            told |= {"card": RunCard(**told["card"]), "memory": Memory(**told["memory"])}
            told |= {key: tuple(told[key]) for key in ("nodes", "others", "path")}
            return cls(**told)
        except (ValueError, TypeError, LookupError):
            raise ProcessFailed("--process is how busflow run starts its own processes; leave it out") from None
