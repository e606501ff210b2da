"""`busflow topic stats`: the ledger of a running graph, as the table at the end of a run has it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import click

from busflow.cli.joining import complete_topics, joined, joins, print_answer
from busflow.cli.output import print_columns

_EXAMPLES = """\b
Examples:
  busflow topic stats
  busflow topic stats imu/data --json"""


@click.command(epilog=_EXAMPLES)
@click.argument("names", metavar="[NAME]...", nargs=-1, shell_complete=complete_topics)
@joins
def stats(run: str | None, names: tuple[str, ...], as_json: bool) -> int:
    """Show what became of every message so far: published = delivered + dropped + queued, for each subscription."""
    with joined(run) as peer:
        wanted = {topic.name for topic in map(peer.graph().topic, names)} if names else None
        reports = peer.ask("report")
        name = peer.run.name
    topics = [topic for report in reports for topic in report["topics"] if wanted is None or topic["name"] in wanted]
    seconds = max(report["duration_s"] for report in reports)
    if as_json:
        print_answer({"run": name, "duration_s": seconds, "topics": topics})
        return 0
    titles = ("topic", "type", "published", "rate", "delivered", "dropped", "queued")
    print_columns([titles, *(row for topic in topics for row in _rows(topic, seconds))])
    return 0


def _rows(topic: Mapping[str, Any], seconds: float) -> Iterator[tuple[object, ...]]:
    rate = topic["published"] / seconds if seconds > 0 else 0.0
    yield topic["name"], topic["type"], topic["published"], f"{rate:.1f} Hz", "", "", ""
    for line in topic["subscriptions"]:
        counts = line["delivered"], line["dropped"], line["queued"]
        why = ", ".join(f"{count} {word}" for word, count in line["drops"].items())
        dropped = f"{counts[1]} ({why})" if why else counts[1]
        yield (
            f"  → {line['node']}",
            f"depth {line['depth']}, {line['overflow']}",
            line["published"],
            "",
            counts[0],
            dropped,
            counts[2],
        )
