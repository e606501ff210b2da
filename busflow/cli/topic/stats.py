"""`busflow topic stats`: prints the ledger of a running graph, as the table at the end of a run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import click

from busflow.cli.options.run import complete_topics, joined, joins
from busflow.cli.terminal.output import print_answer
from busflow.cli.terminal.run_summary import TOPIC_COLUMNS, topic_rows
from busflow.cli.terminal.table import print_table

_EXAMPLES = """\b
Examples:
  busflow topic stats
  busflow topic stats imu/data --json"""


@click.command(epilog=_EXAMPLES)
@click.argument("names", metavar="[NAME]...", nargs=-1, shell_complete=complete_topics)
@joins
def stats(run: str | None, names: tuple[str, ...], as_json: bool) -> None:
    """Show what became of every message so far: published = delivered + dropped + queued, for each subscription."""
    with joined(run) as peer:
        wanted = {topic.name for topic in map(peer.graph().topic, names)} if names else None
        reports = peer.ask("report")
        name = peer.run.name
    rows = [topic for report in reports for topic in report["topics"] if wanted is None or topic["name"] in wanted]
    topics = [_together([each for each in rows if each["name"] == name]) for name in sorted({t["name"] for t in rows})]
    seconds = max(report["duration_s"] for report in reports)
    if as_json:
        print_answer({"run": name, "duration_s": seconds, "topics": topics})
        return
    print_table(topic_rows(topics, seconds, why=True), *TOPIC_COLUMNS)


def _together(lines: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """Merge the reports of one topic: a message counts as published once, in however many processes it arrives.

    >>> here = {"published": 5, "arrived": 0, "since_s": 1.0, "subscriptions": [], "losses": {}}
    >>> there = {"published": 6, "arrived": 6, "since_s": 1.1, "subscriptions": ["/a"], "losses": {"lost": 1}}
    >>> _together([here, there])  # one of the six came from outside the run
    {'published': 6, 'arrived': 0, 'since_s': 1.0, 'subscriptions': ['/a'], 'losses': {'lost': 1}}
    """
    if len(lines) == 1:
        return lines[0]
    own = [line["published"] - line["arrived"] for line in lines]
    outside = max(line["arrived"] - (sum(own) - mine) for line, mine in zip(lines, own, strict=True))
    losses = Counter[str]()
    for line in lines:
        losses.update(line["losses"])
    return {
        **lines[0],
        "published": sum(own) + max(0, outside),
        "arrived": 0,
        "since_s": min(line.get("since_s", 0.0) for line in lines),
        "subscriptions": [each for line in lines for each in line["subscriptions"]],
        "losses": dict(losses),
    }
