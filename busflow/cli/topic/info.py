"""`busflow topic info`: shows a topic's type, and its publishers and subscriptions with their QoS."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.run import complete_topics, joined, joins
from busflow.cli.terminal.output import print_answer, print_message
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.wire.client.graph_view import EndView, TopicView
    from busflow.wire.zenoh.qos_text import WireQoS

_EXAMPLES = """\b
Examples:
  busflow topic info imu/data
  busflow topic info imu/data -v"""


@click.command(epilog=_EXAMPLES)
@click.argument("name", shell_complete=complete_topics)
@click.option("-v", "--verbose", is_flag=True, help="Show each publisher and subscription, with its QoS.")
@joins
def info(run: str | None, name: str, verbose: bool, as_json: bool) -> None:
    """Show the type of the topic NAME, and its publishers and subscriptions."""
    with joined(run) as peer:
        topic = peer.graph().topic(name)
    if as_json:
        print_answer(_as_json(topic))
        return
    for line in _lines(topic, verbose=verbose):
        click.echo(printable(line))
    if len(topic.types) > 1:
        print_message(f"warning: {topic.name} has conflicting types; -v shows whose they are")


def _lines(topic: TopicView, *, verbose: bool) -> Iterator[str]:
    gap = [""] if verbose else []
    yield f"Type: {topic.type}"
    for title, word, ends in (
        ("Publisher", "PUBLISHER", topic.publishers),
        ("Subscription", "SUBSCRIPTION", topic.subscriptions),
    ):
        yield from gap
        yield f"{title} count: {len(ends)}"
        for end in ends if verbose else ():
            yield ""
            yield from _end_lines(end, word)
    yield from gap


def _end_lines(end: EndView, word: str) -> Iterator[str]:
    token = end.token
    yield f"Node name: {token.node}"
    yield f"Node namespace: {token.namespace}"
    yield f"Topic type: {token.type}"
    yield f"Topic type hash: {token.hash}"
    yield f"Endpoint type: {word}"
    yield f"GID: {token.gid.hex('.')}"
    yield "QoS profile:"
    qos = end.qos
    yield f"  Reliability: {qos.reliability.upper()}"
    yield f"  History (Depth): {_history(qos)}"
    yield f"  Durability: {qos.durability.upper()}"
    yield f"  Lifespan: {_duration(qos.lifespan_ns)}"
    yield f"  Deadline: {_duration(qos.deadline_ns)}"
    yield f"  Liveliness: {qos.liveliness.upper()}"
    yield f"  Liveliness lease duration: {_duration(qos.lease_ns)}"


def _history(qos: WireQoS) -> str:
    return f"{qos.history.upper()} ({qos.depth})" if qos.history == "keep_last" else qos.history.upper()


def _duration(nanoseconds: int | None) -> str:
    return "Infinite" if nanoseconds is None else f"{nanoseconds} nanoseconds"


def _as_json(topic: TopicView) -> dict[str, Any]:
    return {
        "name": topic.name,
        "types": topic.types,
        "published": topic.details.get("published"),
        "kept": topic.details.get("kept"),
        "publishers": [_end_json(each) for each in topic.publishers],
        "subscriptions": [_end_json(each) for each in topic.subscriptions],
    }


def _end_json(end: EndView) -> dict[str, Any]:
    """Return an endpoint as JSON; a busflow process adds its counts and where it is declared."""
    details = {key: value for key, value in end.details.items() if key not in ("node", "qos", "topic")}
    token = end.token
    own = {"node": end.node, "type": token.type, "hash": token.hash, "gid": token.gid.hex(), "qos": asdict(end.qos)}
    return own | details
