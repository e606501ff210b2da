"""Report: the account of a run as data; the same numbers while it runs and after it."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, cast

from busflow.actions.accounts import action_accounts
from busflow.bus.endpoint import PARAMETER_EVENTS, ROSOUT
from busflow.text import printable

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from busflow.bus.statistics import BusStatistics, ServiceStatistics, TimerStatistics, TopicStatistics
    from busflow.errors import ExitCode

_COLUMNS = ("topic", "type", "published", "subscription", "delivered", "dropped", "queued")


@dataclass(frozen=True, slots=True)
class NodeReport:
    """One node, its state, restarts, failures, and stops and starts by hand."""

    name: str
    plugin: str
    state: str
    parameters_set: int = 0
    """Number of changes of its parameters while it ran."""
    restarts: int = 0
    stopped_by_hand: int = 0
    """Number of stops by hand, those of a restart by hand included."""
    started_by_hand: int = 0
    failures: int = 0
    """Number of failures, also of those after which it was restarted."""
    last_failure: str | None = None
    """The last failure, in one line."""


@dataclass(frozen=True, slots=True)
class ProcessReport:
    """One process of a run that has several, its state and the ends of its lives."""

    name: str
    pid: int | None
    nodes: tuple[str, ...]
    restarts: int = 0
    state: str = "running"
    fates: tuple[str, ...] = ()
    """Ends of those of its lives that did not end well; what is known of them is no older than half a second."""


@dataclass(frozen=True, slots=True)
class ProgramReport:
    """One program that ran beside the nodes, its output and the ends of its lives."""

    name: str
    command: tuple[str, ...]
    state: str
    pid: int | None = None
    restarts: int = 0
    exit_codes: tuple[int, ...] = ()
    """Exit code of each of its lives, or the negative number of the signal that ended it."""
    fates: tuple[str, ...] = ()
    """Ends of those of its lives that did not end well."""
    lines: int = 0
    """Lines of its output."""
    lines_left_out: int = 0
    """Lines that are not in the log, because too many came in a second."""


@dataclass(slots=True)
class Blocks:
    """Blocks of the event loop by one handler."""

    node: str
    handler: str
    count: int = 0
    longest_s: float = 0.0


@dataclass(frozen=True, slots=True)
class RecordingReport:
    """The recording of a run, and whether all is in it."""

    path: str
    recorded: int
    missed: int
    complete: bool
    """Whether the recording is finished and nothing is missing."""
    why: str = ""
    """Reason why it is not."""


@dataclass(frozen=True, slots=True)
class SnapshotReport:
    """A bag of the last moments of a run."""

    path: str
    reason: str
    """What it shows: a failure, or that it was asked for."""
    seconds: float
    """The time between its first and last message."""
    recorded: int
    missed: int
    written: bool
    """Whether it is on the disk, or cannot be written."""
    complete: bool
    """Whether it is finished and nothing is missing."""
    why: str = ""
    """Reason why it is not."""


@dataclass(frozen=True, slots=True)
class Report:
    """A run's account of itself; all times are those of the run's clock, in seconds."""

    name: str
    seed: int
    clock: str
    """Name of the clock: `system` or `sim`."""
    duration_s: float
    exit_code: ExitCode
    nodes: tuple[NodeReport, ...]
    topics: tuple[TopicStatistics, ...]
    timers: tuple[TimerStatistics, ...]
    services: tuple[ServiceStatistics, ...] = ()
    inbox_dropped: int = 0
    """Messages from other threads that found the inbox full, or came after the end."""
    inbox_refused: int = 0
    """Messages from other threads that an `overflow: block` subscription had no room for."""
    blocks: tuple[Blocks, ...] = ()
    """The handlers that kept the event loop from turning, if a watchdog watched."""
    log_lines_lost: int = 0
    """Lines of the log that could not be written."""
    sections: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Sections of the run's features by name, e.g. `programs`."""

    @property
    def processes(self) -> tuple[ProcessReport, ...]:
        """Processes of a run that has several."""
        return self.sections.get("processes", ())

    @property
    def programs(self) -> tuple[ProgramReport, ...]:
        """Programs that the run started."""
        return self.sections.get("programs", ())

    @property
    def recording(self) -> RecordingReport | None:
        """The recording of the run, if there is one."""
        return self.sections.get("recording")

    @property
    def snapshots(self) -> tuple[SnapshotReport, ...]:
        """Bags of the run's last moments."""
        return self.sections.get("snapshots", ())

    @property
    def dropped(self) -> int:
        """Messages that did not reach a subscription they were published to."""
        ledger = sum(line.dropped for topic in self.topics for line in topic.subscriptions)
        return ledger + self.inbox_dropped + self.inbox_refused

    def __str__(self) -> str:
        """Return the topics as a table for people: a row for each subscription; a topic without one has a row too."""
        rows = [_COLUMNS, *(cells for topic in self.topics for cells in _topic_cells(topic))]
        texts = [[printable(str(cell)) for cell in row] for row in rows]
        widths = [max(map(len, column)) for column in zip(*texts, strict=True)]
        lines = ("  ".join(map(str.ljust, row, widths)).rstrip() for row in texts)
        return "\n".join([f"{printable(self.name)}: {self.duration_s:.3f} s of {self.clock} time", *lines])

    def _repr_html_(self) -> str:
        """Return the topics as a table, which a notebook shows: a row for each subscription, names escaped."""
        from html import escape

        def row(tag: str, cells: Iterable[object]) -> str:
            return f"<tr>{''.join(f'<{tag}>{escape(str(cell))}</{tag}>' for cell in cells)}</tr>"

        caption = escape(f"{self.name}: {self.duration_s:.3f} s of {self.clock} time, seed {self.seed}")
        rows = "".join(row("td", cells) for topic in self.topics for cells in _topic_cells(topic))
        return f"<table><caption>{caption}</caption>{row('th', _COLUMNS)}{rows}</table>"

    def without(self, *names: str) -> Report:
        """Return the report without some sections; e.g. a recording has no section `recording`."""
        return replace(self, sections={name: each for name, each in self.sections.items() if name not in names})

    def as_json(self) -> dict[str, Any]:
        """Return the report as `--report FILE` writes it."""
        services = [service.as_json() for service in self.services]
        return {
            "name": self.name,
            "seed": self.seed,
            "clock": self.clock,
            "duration_s": self.duration_s,
            "exit_code": int(self.exit_code),
            "nodes": [asdict(node) for node in self.nodes],
            "topics": [topic.as_json() for topic in self.topics],
            "services": services,
            "actions": list(action_accounts(services)),
            "timers": [asdict(timer) for timer in self.timers],
            "inbox": {"dropped": self.inbox_dropped, "refused": self.inbox_refused},
            "blocks": [asdict(each) for each in self.blocks],
            "log_lines_lost": self.log_lines_lost,
            **{name: _plain(section) for name, section in self.sections.items() if section},
        }


def _plain(section: Any) -> Any:
    rows = cast("tuple[Any, ...]", section)
    return [asdict(each) for each in rows] if isinstance(section, tuple) else asdict(section)


def used_topics(counts: BusStatistics) -> tuple[TopicStatistics, ...]:
    """Return the topics; `/rosout` and `/parameter_events` only once they are used."""
    own = {PARAMETER_EVENTS, ROSOUT}
    return tuple(each for each in counts.topics if each.topic not in own or each.published or each.subscriptions)


def _topic_cells(topic: TopicStatistics) -> Sequence[tuple[object, ...]]:
    own = topic.name, topic.type, topic.published
    lines = [(*own, each.node, each.delivered, each.dropped, each.queued) for each in topic.subscriptions]
    return lines or [(*own, "", "", "", "")]
