"""`busflow node`: lists the nodes of a running graph, shows the endpoints of one, and stops and starts nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from busflow import timeouts
from busflow.bus.names import is_hidden
from busflow.cli.options.lazy_group import LazyGroup
from busflow.cli.options.run import complete_nodes, joined, joins
from busflow.cli.terminal.output import print_answer, print_message
from busflow.cli.terminal.table import Column, print_table, print_text
from busflow.clock import sleep
from busflow.errors import ExitCode, InspectionUnavailable, NoSuchTarget
from busflow.text import printable
from busflow.wire.client.graph_view import LOGGER_SERVICES, EndView, GraphView, NodeView

if TYPE_CHECKING:
    from busflow.wire.client.client import Peer

_VERBS = {
    "list": ("busflow.cli.node:list_", "List the nodes of a running graph."),
    "info": ("busflow.cli.node:info", "Show what a node publishes, receives and offers, and its state."),
    "stop": ("busflow.cli.node:stop", "Stop nodes while the others go on."),
    "start": ("busflow.cli.node:start", "Start nodes that were stopped or have ended."),
    "restart": ("busflow.cli.node:restart", "Stop nodes and start them anew."),
}
_EXAMPLES = """\b
Examples:
  busflow node list -v
  busflow node info sensor_processor
  busflow node stop sensor_processor
  busflow node restart sensor_publisher sensor_processor"""

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

_TITLES = {
    "subscriptions": "Subscribers",
    "publishers": "Publishers",
    "services": "Service Servers",
    "clients": "Service Clients",
}
"""ROS 2's titles for the endpoints of a node, by the attribute of `NodeView`, which is the key in JSON too."""
_ACTION_TITLES = {"action_servers": "Action Servers", "action_clients": "Action Clients"}
"""ROS 2's titles of what stays empty here: an action is shown by its services and topics."""

node: LazyGroup = LazyGroup(
    "node", _VERBS, help="Look at the nodes of a running graph; stop and start them.", epilog=_EXAMPLES
)


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
@click.option("--include-hidden", is_flag=True, help="Also hidden topics and services, and those of its log level.")
@joins
def info(run: str | None, name: str, include_hidden: bool, as_json: bool) -> None:
    """Show what NODE publishes, receives, offers and calls, its state, its plugin and its parameters."""
    with joined(run) as peer:
        found = peer.graph().node(name)
        answers = peer.ask("parameters", node=found.name)
    parameters = sum(len(each.get(found.name, ())) for each in answers)
    endpoints = {key: _names_and_types(getattr(found, key), hidden=include_hidden) for key in _TITLES}
    if as_json:
        named = {key: [{"name": name, "type": type_} for name, type_ in rows] for key, rows in endpoints.items()}
        print_answer({"run": peer.run.name, **_row_json(found), **named, "parameters": parameters})
        return
    click.echo(printable(found.name))
    for key, title in (_TITLES | _ACTION_TITLES).items():
        rows = endpoints.get(key, [])
        click.echo(f"  {title}:" + ("" if rows else "\n"))
        for endpoint, type_ in rows:
            print_text(f"    {endpoint}:", type_, indent="  ")
    details = found.details
    click.echo(f"  State: {_state(found)}")
    if details:
        click.echo(f"  Plugin: {printable(details['plugin'])}")
        click.echo(f"  Process: {printable(details['process'])}, pid {details['pid']}")
        click.echo(f"  Parameters: {parameters}")
        counts = {"Restarts": "restarts", "Stopped by hand": "stopped_by_hand", "Started by hand": "started_by_hand"}
        for title, key in counts.items():
            if details.get(key):
                click.echo(f"  {title}: {details[key]}")
    _print_failures([found])


_names = click.argument("names", metavar="NODE...", nargs=-1, required=True, shell_complete=complete_nodes)


@click.command(epilog=_EXAMPLES)
@_names
@joins
def stop(run: str | None, names: tuple[str, ...], as_json: bool) -> int:
    """Stop each NODE, until it is started by hand: no `restart` policy starts it. The other nodes go on.

    Its topics and services are left, its counts and parameters stay. A node that is stopped already stays so.
    """
    return _order(run, names, "stop", as_json=as_json)


@click.command(epilog=_EXAMPLES)
@_names
@joins
def start(run: str | None, names: tuple[str, ...], as_json: bool) -> int:
    """Start each NODE that was stopped by hand or has ended, from its parameters as they are now.

    A node that runs already goes on.
    """
    return _order(run, names, "start", as_json=as_json)


@click.command(epilog=_EXAMPLES)
@_names
@joins
def restart(run: str | None, names: tuple[str, ...], as_json: bool) -> int:
    """Stop each NODE, and start it from its parameters as they are now."""
    return _order(run, names, "restart", as_json=as_json)


def _order(run: str | None, names: Sequence[str], order: str, *, as_json: bool) -> int:
    """Give an order, wait until it is carried out, and print the state of each node; FAILED if one failed."""
    with joined(run) as peer:
        before, after = order_nodes(peer, order, names)
        graph = peer.graph()
    wanted = list(after)
    if as_json:
        print_answer({"run": peer.run.name, "nodes": [_row_json(graph.nodes[name]) for name in wanted]})
    else:
        for name in wanted:
            click.echo(f"{printable(name)}: {_outcome(before[name], after[name])}")
    if order == "stop":
        _print_dependants(graph, wanted)
    failed = [name for name in wanted if after[name]["failure_count"] > before[name]["failure_count"]]
    for name in failed:
        print_message(f"error: {name} has failed: {'; '.join(after[name]['failures'])}")
    return ExitCode.FAILED if failed else ExitCode.OK


def order_nodes(
    peer: Peer, order: str, names: Sequence[str]
) -> tuple[Mapping[str, Mapping[str, Any]], Mapping[str, Mapping[str, Any]]]:
    """Have nodes `start`, `stop` or `restart`, wait until it is done, and return each one's state before and after.

    Raises:
        NoSuchTarget: There is no such node, or it is not busflow's.
        InspectionUnavailable: The run has ended, or it takes too long.
    """
    graph = peer.graph()
    wanted = list(dict.fromkeys(graph.node(name).name for name in names))
    before: dict[str, Any] = {}
    for answer in peer.ask("order_nodes", order=order, nodes=wanted):
        before |= answer
    for name in wanted:
        if name not in before:
            raise NoSuchTarget(f"{printable(name)} is not busflow's: it can only be stopped where it was started")
    return before, {name: _carried_out(peer, order, before[name]) for name in wanted}


_POLL_S = 0.05
_ENDED = {"stopped", "stopped by hand", "failed"}
"""The states of a node that does not run, and does not start again by itself."""


def _carried_out(peer: Peer, order: str, before: Mapping[str, Any]) -> Mapping[str, Any]:
    """Wait until an order for a node is carried out; return its process's answer about it.

    Raises:
        InspectionUnavailable: The run has ended, or it takes too long.
    """
    if (order, before["state"] in _ENDED) in {("stop", True), ("start", False)}:
        return before
    for _ in range(round(timeouts.current.node_order / _POLL_S)):
        now = peer.graph().node(before["name"]).details
        started = now["started_by_hand"] > before["started_by_hand"]
        if (started and now["state"] not in {"starting", "stopping"}) or (order == "stop" and now["state"] in _ENDED):
            return now
        sleep(_POLL_S)
    why = f"busflow could not {order} {printable(before['name'])} within {timeouts.current.node_order:g} s"
    raise InspectionUnavailable(f"{why}; busflow log --level error may show why")


def _outcome(before: Mapping[str, Any], after: Mapping[str, Any]) -> str:
    """Return what has become of a node, in a few words."""
    state = str(after["state"])
    if before is after:
        return "has ended already" if state == "stopped" else f"is {state} already"
    return f"waits for {printable(', '.join(after['depends_on']))}" if state == "waiting" else state


def _print_dependants(graph: GraphView, stopped: Sequence[str]) -> None:
    for each in graph.nodes.values():
        needed = [name for name in each.details.get("depends_on", ()) if name in stopped]
        if needed and each.name not in stopped and _state(each) not in _ENDED:
            print_message(f"warning: {each.name} depends on {', '.join(needed)}, and goes on")


def _names_and_types(endpoints: Sequence[EndView], *, hidden: bool) -> list[tuple[str, str]]:
    """Return the topic or service of each endpoint and its type, sorted and without duplicates."""
    found = {(each.token.topic, each.token.type) for each in endpoints}
    return sorted(each for each in found if hidden or not (is_hidden(each[0]) or each[1] in LOGGER_SERVICES))


def _state(node: NodeView) -> str:
    """Return a node's state, which is unknown unless the node is busflow's."""
    return str(node.details.get("state", "unknown"))


def _row(node: NodeView) -> tuple[object, ...]:
    details = node.details
    process = details.get("process", "-"), details.get("pid", "-")
    counts = len(node.publishers), len(node.subscriptions), details.get("restarts", "-")
    return (node.name, _state(node), details.get("plugin", "-"), *process, *counts)


def _row_json(node: NodeView) -> dict[str, Any]:
    details = node.details
    return {
        "name": node.name,
        "state": _state(node),
        "plugin": details.get("plugin"),
        "process": details.get("process"),
        "pid": details.get("pid"),
        "restarts": details.get("restarts", 0),
        "stopped_by_hand": details.get("stopped_by_hand", 0),
        "started_by_hand": details.get("started_by_hand", 0),
        "failures": details.get("failures", []),
        "publishers": len(node.publishers),
        "subscriptions": len(node.subscriptions),
    }


def _print_failures(nodes: Sequence[NodeView]) -> None:
    for each in nodes:
        why = "; ".join(each.details.get("failures", []))
        if _state(each) == "failed":
            print_message(f"error: {each.name} has failed: {why}")
        elif _state(each) == "restarting":
            print_message(f"warning: {each.name} is started anew: {why or 'it ended'}")
        elif _state(each) == "stopped by hand":
            print_message(f"warning: {each.name} is stopped by hand; busflow node start {each.name} starts it")
