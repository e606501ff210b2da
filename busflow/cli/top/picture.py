"""Rows, numbers and lines that `busflow top` shows, computed from two snapshots of a graph. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, cast

from busflow.actions.accounts import action_accounts
from busflow.cli.terminal.table import Column, bare
from busflow.text import printable
from busflow.wire.client.graph_view import GraphView, TopicView


@dataclass(frozen=True, slots=True)
class Look:
    """A snapshot of the graph."""

    graph: GraphView
    at_s: float
    """The time of the snapshot in seconds, on any clock that does not jump."""


@dataclass(frozen=True, slots=True)
class TopicRow:
    """The row of one topic: its traffic, drops and queues."""

    name: str
    type: str
    published: int
    rate_hz: float | None
    """The rate since an earlier snapshot; None for the first one."""
    publishers: int
    subscriptions: int
    dropped: int
    queued: int
    fullest: float
    """The fill level of the fullest queue, as a part of its depth from 0 to 1."""

    def cells(self) -> tuple[str, ...]:
        """Return the row as text."""
        rate = "" if self.rate_hz is None else f"{self.rate_hz:.1f}"
        queue = f"{self.queued} ({self.fullest:.0%})" if self.queued else "0"
        ends = f"{self.publishers} → {self.subscriptions}"
        return (printable(self.name), printable(self.type), rate, str(self.published), ends, str(self.dropped), queue)


_PLOTTABLE = 16
"""The number of items of one array that can be plotted."""
TOPIC_COLUMNS = (
    Column("topic"),
    Column("type", short=bare, goes=1),
    Column("Hz"),
    Column("published", goes=3),
    Column("ends", goes=2),
    Column("dropped"),
    Column("queued"),
)
ACTION_COLUMNS = (
    Column("action"),
    Column("goals"),
    Column("rejected", goes=3),
    Column("succeeded"),
    Column("aborted"),
    Column("canceled", goes=4),
    Column("running"),
    Column("queued", goes=2),
    Column("left", goes=1),
    Column("lost"),
    Column("dropped", goes=5),
)
NODE_COLUMNS = (
    Column("node"),
    Column("state"),
    Column("plugin", goes=1),
    Column("publishes", goes=2),
    Column("receives", goes=3),
    Column("dropped"),
)


@dataclass(frozen=True, slots=True)
class NodeRow:
    """The row of one node: its state, plugin, endpoints and drops."""

    name: str
    state: str
    plugin: str
    publishers: int
    subscriptions: int
    dropped: int

    def cells(self) -> tuple[str, ...]:
        """Return the row as text."""
        counts = (str(self.publishers), str(self.subscriptions), str(self.dropped))
        return (printable(self.name), printable(self.state), printable(self.plugin), *counts)


def topic_rows(now: Look, before: Look) -> list[TopicRow]:
    """Return a row for each topic that is not hidden; rates are since the earlier snapshot."""
    return [_topic_row(topic, now, before) for topic in now.graph.topics.values() if not topic.hidden]


def node_rows(now: Look) -> list[NodeRow]:
    """Return a row for each node that is not hidden."""
    return [
        NodeRow(
            name=node.name,
            state=str(node.details.get("state", "")),
            plugin=str(node.details.get("plugin", "")),
            publishers=len(node.publishers),
            subscriptions=len(node.subscriptions),
            dropped=sum(int(end.details.get("dropped", 0)) for end in node.subscriptions),
        )
        for node in now.graph.nodes.values()
        if not node.hidden
    ]


def action_rows(now: Look) -> list[tuple[str, ...]]:
    """Return a row for each node that serves an action or sends it goals: what became of the goals, and lost feedback.

    `goals` is the sum of `rejected` to `lost`; a column that an end does not count is empty.
    """
    found: dict[str, Counter[str]] = {}
    for answer in now.graph.processes:
        for action in action_accounts(answer.get("services", ())):
            for arrow, ends in (("←", action["servers"]), ("→", action["clients"])):
                for end in ends:
                    name = printable(f"{action['name']} {arrow} {end['node']}")
                    found.setdefault(name, Counter()).update(_goal_counts(end))
    words = [column.title for column in ACTION_COLUMNS[1:]]
    return [(name, *(str(counts.get(word, "")) for word in words)) for name, counts in sorted(found.items())]


def _goal_counts(end: Mapping[str, Any]) -> dict[str, int]:
    """Return the counts of an action's end by the columns that show them."""
    names = {"received": "goals", "sent": "goals", "feedback_dropped": "dropped"}
    return {names.get(word, word): count for word, count in end.items() if word != "node"}


def _topic_row(topic: TopicView, now: Look, before: Look) -> TopicRow:
    published = int(topic.details.get("published", 0))
    rate_hz = None
    if now.at_s > before.at_s and topic.name in before.graph.topics:
        earlier = int(before.graph.topics[topic.name].details.get("published", 0))
        rate_hz = max(0, published - earlier) / (now.at_s - before.at_s)
    counts = [end.details for end in topic.subscriptions if end.details]
    return TopicRow(
        name=topic.name,
        type=topic.type,
        published=published,
        rate_hz=rate_hz,
        publishers=len(topic.publishers),
        subscriptions=len(topic.subscriptions),
        dropped=sum(line["dropped"] for line in counts),
        queued=sum(line["queued"] for line in counts),
        fullest=max((line["queued"] / line["depth"] for line in counts), default=0.0),
    )


def numbers(value: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """Yield each number of a message that can be plotted, with its path.

    >>> dict(numbers({"header": {"frame_id": "imu"}, "position": [0.5, 1], "ok": True}))
    {'position[0]': 0.5, 'position[1]': 1.0}
    """
    if isinstance(value, bool):
        return
    if isinstance(value, int | float):
        yield path, float(value)
    elif isinstance(value, dict):
        for name, each in cast("dict[str, Any]", value).items():
            yield from numbers(each, f"{path}.{name}".removeprefix("."))
    elif isinstance(value, list | memoryview):
        for index, each in enumerate(cast("list[Any]", value)[:_PLOTTABLE]):
            yield from numbers(each, f"{path}[{index}]")


def first_plotted(paths: Iterable[str]) -> str | None:
    """Return the number to plot where none is asked for: the first one that is no part of a header or stamp.

    >>> first_plotted(["header.stamp.sec", "header.stamp.nanosec", "orientation.x"])
    'orientation.x'
    >>> first_plotted(["stamp.sec"])
    'stamp.sec'
    """
    found = list(paths)
    return next((path for path in found if not {"header", "stamp"} & {*path.split(".")}), next(iter(found), None))


def lines(value: Mapping[str, Any], indent: str = "", limit: int = 8) -> Iterator[str]:
    """Yield a message as lines for people; sequences are cut after `limit` items.

    >>> list(lines({"name": ["a", "b"], "stamp": {"sec": 1}}))
    ['name: [a, b]', 'stamp:', '  sec: 1']
    """
    for name, each in value.items():
        if isinstance(each, dict):
            yield f"{indent}{printable(name)}:"
            yield from lines(cast("dict[str, Any]", each), indent + "  ", limit)
        else:
            yield f"{indent}{printable(name)}: {_shown(each, limit)}"


def _shown(value: Any, limit: int) -> str:
    if isinstance(value, str | bytes) or not hasattr(value, "__len__"):
        return printable(value, limit=200)
    shown = [printable(each, limit=80) for each in value[:limit]]
    more = [f"… {len(value) - limit} more"] if len(value) > limit else []
    return f"[{', '.join(shown + more)}]"
