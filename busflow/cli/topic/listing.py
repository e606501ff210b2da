"""`busflow topic list`, `type` and `find`: list the topics of a running graph."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.run import complete_topics, complete_types, full_type, joined, joins
from busflow.cli.terminal.listing import print_list, print_of_type
from busflow.cli.terminal.output import print_answer, print_found, print_message
from busflow.cli.terminal.table import print_text
from busflow.text import counted

if TYPE_CHECKING:
    from busflow.wire.client.graph_view import EndView, GraphView, TopicView

_EXAMPLES = """\b
Examples:
  busflow topic list
  busflow topic list -t
  busflow topic find sensor_msgs/msg/Imu"""


@click.command("list", epilog=_EXAMPLES)
@click.option("-t", "--show-types", is_flag=True, help="Also show each topic's type.")
@click.option("-c", "--count-topics", "count", is_flag=True, help="Only show the number of topics.")
@click.option("-v", "--verbose", is_flag=True, help="Show the number of publishers and subscriptions of each.")
@click.option("--include-hidden-topics", "hidden", is_flag=True, help="Also names that begin with an underscore.")
@joins
def list_(run: str | None, show_types: bool, count: bool, verbose: bool, hidden: bool, as_json: bool) -> None:
    """List the topics of a running graph."""
    with joined(run) as peer:
        topics = _shown(peer.graph(), hidden=hidden)
        name = peer.run.name
    if as_json:
        print_answer({"run": name, "topics": [_as_json(each) for each in topics]})
    elif verbose and not count:
        _print_ends("Published", "publisher", ((each, each.publishers) for each in topics))
        _print_ends("Subscribed", "subscriber", ((each, each.subscriptions) for each in topics))
    else:
        print_list(topics, count=count, show_types=show_types)


@click.command("type", epilog="\b\nExample:\n  busflow topic type imu/data")
@click.argument("name", shell_complete=complete_topics)
@joins
def type_(run: str | None, name: str, as_json: bool) -> None:
    """Show the type of the topic NAME."""
    with joined(run) as peer:
        found = peer.graph().topic(name)
    print_found({"name": found.name, "types": found.types}, found.types, as_json=as_json)
    if len(found.types) > 1 and not as_json:
        print_message(f"warning: {found.name} has conflicting types")


@click.command(epilog=_EXAMPLES)
@click.argument("name", metavar="TYPE", shell_complete=complete_types)
@click.option("-c", "--count-topics", "count", is_flag=True, help="Only show the number of topics.")
@click.option("--include-hidden-topics", "hidden", is_flag=True, help="Also names that begin with an underscore.")
@joins
def find(run: str | None, name: str, count: bool, hidden: bool, as_json: bool) -> None:
    """List the topics whose type is TYPE, such as sensor_msgs/msg/Imu."""
    full = full_type(name)
    with joined(run) as peer:
        topics = _shown(peer.graph(), hidden=hidden)
    print_of_type(full, topics, "topic", as_json=as_json, count=count)


def _shown(graph: GraphView, *, hidden: bool) -> list[TopicView]:
    return [topic for topic in graph.topics.values() if hidden or not topic.hidden]


def _print_ends(title: str, word: str, topics: Iterable[tuple[TopicView, tuple[EndView, ...]]]) -> None:
    click.echo(f"{title} topics:")
    for topic, ends in topics:
        if ends:
            print_text(f" * {topic.name}", f"[{topic.type}]", counted(len(ends), word), indent="  ")
    click.echo()


def _as_json(topic: TopicView) -> dict[str, Any]:
    return {
        "name": topic.name,
        "types": topic.types,
        "publishers": len(topic.publishers),
        "subscriptions": len(topic.subscriptions),
        "published": topic.details.get("published"),
    }
