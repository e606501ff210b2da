"""`busflow node`: lists the nodes of a running graph, and shows the endpoints of one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.lazy_group import LazyGroup
from busflow.cli.options.run import complete_nodes, joined, joins
from busflow.cli.terminal.output import print_answer, print_message
from busflow.cli.terminal.table import Column, print_table, print_text
from busflow.text import printable
from busflow.wire.client.graph_view import is_hidden

if TYPE_CHECKING:
    from busflow.wire.client.graph_view import EndView, NodeView

_VERBS = {
    "list": ("busflow.cli.node:list_", "List the nodes of a running graph."),
    "info": ("busflow.cli.node:info", "Show what a node publishes, receives and offers, and its state."),
}
_EXAMPLES = """\b
Examples:
  busflow node list -v
  busflow node info sensor_processor"""

_COLUMNS = (
    Column("NODE"),
    Column("STATE"),
    Column("PLUGIN", goes=1),
    Column("PROCESS", goes=2),
    Column("PID", goes=3),
    Column("PUB"),
    Column("SUB"),
    Column("RESTARTS"),
)

node: LazyGroup = LazyGroup("node", _VERBS, help="Look at the nodes of a running graph.", epilog=_EXAMPLES)


@click.command("list", epilog=_EXAMPLES)
@click.option("-a", "--all", "all_", is_flag=True, help="Also hidden nodes: a name, or a part of it, begins with _.")
@click.option("-c", "--count-nodes", "count", is_flag=True, help="Only the number of nodes.")
@click.option("-v", "--verbose", is_flag=True, help="With plugin, state, process and the number of endpoints.")
@joins
def list_(run: str | None, all_: bool, count: bool, verbose: bool, as_json: bool) -> None:
    """List the nodes of a running graph, by name; failed ones are named on standard error."""
    with joined(run) as peer:
        nodes = [each for each in peer.graph().nodes.values() if all_ or not each.hidden]
    if as_json:
        print_answer({"run": peer.run.name, "nodes": [_row_json(each) for each in nodes]})
        return
    if count:
        click.echo(len(nodes))
    elif verbose:
        print_table(map(_row, nodes), *_COLUMNS)
    else:
        click.echo("".join(f"{printable(each.name)}\n" for each in nodes), nl=False)
    _print_failures(nodes)


@click.command(epilog=_EXAMPLES)
@click.argument("name", metavar="NODE", shell_complete=complete_nodes)
@click.option("--include-hidden", is_flag=True, help="Also hidden topics and services.")
@joins
def info(run: str | None, name: str, include_hidden: bool, as_json: bool) -> None:
    """Show what NODE publishes, receives, offers and calls, its state, its plugin and its parameters."""
    with joined(run) as peer:
        found = peer.graph().node(name)
        answers = peer.ask("parameters", node=found.name)
    parameters = sum(len(each.get(found.name, ())) for each in answers)
    ends = {
        "Subscribers": found.subscriptions,
        "Publishers": found.publishers,
        "Service Servers": found.services,
        "Service Clients": found.clients,
    }
    shown = {title: _ends(each, hidden=include_hidden) for title, each in ends.items()}
    if as_json:
        print_answer({"run": peer.run.name, **_info_json(found, shown), "parameters": parameters})
        return
    click.echo(printable(found.name))
    for title, rows in {**shown, "Action Servers": [], "Action Clients": []}.items():
        click.echo(f"  {title}:" + ("" if rows else "\n"))
        for topic, type_ in rows:
            print_text(f"    {topic}:", type_, indent="  ")
    details = found.details
    click.echo(f"  State: {_state(found)}")
    if details:
        click.echo(f"  Plugin: {printable(details['plugin'])}")
        click.echo(f"  Process: {printable(details['process'])}, pid {details['pid']}")
        click.echo(f"  Parameters: {parameters}")
        if details.get("restarts"):
            click.echo(f"  Restarts: {details['restarts']}")
    _print_failures([found])


def _ends(ends: Sequence[EndView], *, hidden: bool) -> list[tuple[str, str]]:
    """Return topic and type of the endpoints, sorted and without duplicates."""
    found = {(end.token.topic, end.token.type) for end in ends}
    return sorted(each for each in found if hidden or not is_hidden(each[0]))


def _state(node: NodeView) -> str:
    """Return a node's state, which is unknown unless the node is busflow's."""
    return str(node.details.get("state", "unknown"))


def _row(node: NodeView) -> tuple[object, ...]:
    details = node.details
    ends = len(node.publishers), len(node.subscriptions)
    process = details.get("process", "-"), details.get("pid", "-")
    return (node.name, _state(node), details.get("plugin", "-"), *process, *ends, details.get("restarts", "-"))


def _row_json(node: NodeView) -> dict[str, Any]:
    details = node.details
    return {
        "name": node.name,
        "state": _state(node),
        "plugin": details.get("plugin"),
        "process": details.get("process"),
        "pid": details.get("pid"),
        "restarts": details.get("restarts", 0),
        "failures": details.get("failures", []),
        "publishers": len(node.publishers),
        "subscriptions": len(node.subscriptions),
    }


def _info_json(node: NodeView, ends: dict[str, list[tuple[str, str]]]) -> dict[str, Any]:
    words = {"Subscribers": "subscriptions", "Publishers": "publishers", "Service Servers": "services"}
    named = {
        words.get(title, "clients"): [{"name": name, "type": type_} for name, type_ in rows]
        for title, rows in ends.items()
    }
    return _row_json(node) | named


def _print_failures(nodes: Sequence[NodeView]) -> None:
    for each in nodes:
        why = "; ".join(each.details.get("failures", []))
        if _state(each) == "failed":
            print_message(f"error: {each.name} has failed: {why}")
        elif _state(each) == "restarting":
            print_message(f"warning: {each.name} is started anew: {why or 'it ended'}")
