"""`busflow param`: shows the parameters of running nodes: type, value, constraints and source.

The verbs that set, compare, save and watch are in `changes`.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from busflow.bus.names import absolute_name
from busflow.cli.options.completers import completer
from busflow.cli.options.lazy_group import LazyGroup
from busflow.cli.options.run import complete_nodes, joined, joined_to_complete, joins
from busflow.cli.terminal.output import print_answer
from busflow.cli.terminal.table import Column, print_table
from busflow.errors import NoSuchTarget
from busflow.text import did_you_mean, printable

if TYPE_CHECKING:
    from busflow.wire.client.client import Peer

_VERBS = {
    "list": ("busflow.cli.param:list_", "List the parameters of the nodes, or of one."),
    "get": ("busflow.cli.param:get", "Show the value of a parameter."),
    "describe": ("busflow.cli.param:describe", "Show type, description, range, default and source of parameters."),
    "dump": ("busflow.cli.param:dump", "Write a node's parameters as YAML."),
    "set": ("busflow.cli.param.changes:set_", "Set parameters of a node, all of them or none."),
    "load": ("busflow.cli.param.changes:load", "Set a node's parameters from a YAML file."),
    "diff": ("busflow.cli.param.changes:diff", "Show where parameters are no longer what the launch file says."),
    "save": ("busflow.cli.param.changes:save", "Write a node's parameters back into its launch file."),
    "watch": ("busflow.cli.param.changes:watch", "Show each change of a parameter as it is made."),
    "sources": ("busflow.cli.param:sources", "Show where the value of each parameter came from."),
}
_EXAMPLES = """\b
Examples:
  busflow param list sensor_publisher
  busflow param get sensor_publisher rate_hz
  busflow param describe sensor_publisher noise.imu
  busflow param set sensor_publisher noise.imu 0.5 rate_hz 20
  busflow param save sensor_publisher
  busflow param dump sensor_publisher --output publisher.yaml
  busflow param sources"""

_ROS_TYPES = (
    *("not set", "boolean", "integer", "double", "string"),
    *("byte array", "boolean array", "integer array", "double array", "string array"),
)
"""ROS 2's words for the constants of `rcl_interfaces/msg/ParameterType`."""

Row = Mapping[str, Any]
"""A parameter in the form in which its process reports it."""

param: LazyGroup = LazyGroup(
    "param", _VERBS, help="Look at the parameters of running nodes, and set them.", epilog=_EXAMPLES
)


@completer
def complete_parameters(context: click.Context, _incomplete: str) -> Iterator[tuple[str, str]]:
    """Yield the parameters of the node on the command line, with their descriptions."""
    with joined_to_complete(context) as peer:
        rows = parameters_of(peer, context.params["node"])
    yield from ((row["name"], row["description"]) for row in rows)


_node = click.argument("node", shell_complete=complete_nodes)
_optional_node = click.argument("node", required=False, shell_complete=complete_nodes)


@click.command("list", epilog=_EXAMPLES)
@_optional_node
@click.option("--param-type", "types", is_flag=True, help="With the type of each.")
@joins
def list_(run: str | None, node: str | None, types: bool, as_json: bool) -> None:
    """List the parameters of every node, or of NODE."""
    with joined(run) as peer:
        found = _by_node(peer, node)
    if as_json:
        _print_nodes(peer, found)
        return
    for name, rows in found.items():
        if node is None:
            click.echo(f"{printable(name)}:")
        for row in sorted(rows, key=lambda row: row["name"]):
            click.echo(f"  {printable(row['name'])}" + (f" (type: {_ros_type(row)})" if types else ""))


@click.command(epilog=_EXAMPLES)
@_node
@click.argument("name", shell_complete=complete_parameters)
@click.option("--hide-type", is_flag=True, help="Only the value.")
@joins
def get(run: str | None, node: str, name: str, hide_type: bool, as_json: bool) -> None:
    """Show the value of the parameter NAME of NODE; a nested parameter has a dotted name."""
    with joined(run) as peer:
        (row,) = _named(parameters_of(peer, node), [name], node)
    if as_json:
        print_answer({"run": peer.run.name, "node": absolute_name(node), **_as_json(row)})
        return
    value = printable(_value(row))
    if hide_type:
        click.echo(value)
    elif row["value"] is None:
        click.echo("Parameter not set.")
    else:
        noun = _ros_type(row).removesuffix(" array").capitalize()
        click.echo(f"{noun} {'values are' if 'array' in _ros_type(row) else 'value is'}: {value}")


@click.command(epilog=_EXAMPLES)
@_node
@click.argument("names", nargs=-1, shell_complete=complete_parameters)
@joins
def describe(run: str | None, node: str, names: tuple[str, ...], as_json: bool) -> None:
    """Describe the parameters NAMES of NODE, or all of them without NAMES."""
    with joined(run) as peer:
        rows = parameters_of(peer, node)
    chosen = _named(rows, names, node) if names else rows
    if as_json:
        _print_nodes(peer, {absolute_name(node): chosen})
        return
    for row in chosen:
        click.echo("\n".join(_description(row)))


@click.command(epilog=_EXAMPLES)
@_node
@click.option(
    "--output", metavar="FILE", type=click.Path(dir_okay=False, path_type=Path), help="Write to FILE instead."
)
@joins
def dump(run: str | None, node: str, output: Path | None, as_json: bool) -> None:
    """Write the parameters of NODE as YAML, in the form in which ROS 2 reads and writes them."""
    with joined(run) as peer:
        rows = parameters_of(peer, node)
    if as_json:
        _print_nodes(peer, {absolute_name(node): rows})
        return
    from busflow.launchfile.load.parameter_file import text_for
    from busflow.node.parameters import grouped

    text = text_for(absolute_name(node), grouped({row["name"]: row["value"] for row in rows}))
    if output is None:
        click.echo(text)
    else:
        output.write_text(text, encoding="utf-8")


@click.command(epilog=_EXAMPLES)
@_optional_node
@joins
def sources(run: str | None, node: str | None, as_json: bool) -> None:
    """Show where the value of each parameter of NODE, or of every node, came from."""
    with joined(run) as peer:
        found = _by_node(peer, node)
    if as_json:
        _print_nodes(peer, found)
        return
    for name, rows in found.items():
        if node is None:
            click.echo(f"{printable(name)}:")
        cells = [(row["name"], _value(row), row["source"]) for row in rows]
        print_table(cells, Column(), Column(folds=True), Column(folds=True), indent="  ")


# Asking the run.


def _by_node(peer: Peer, node: str | None) -> dict[str, list[Row]]:
    """Return the parameters of every node by its name, or of one node."""
    if node is not None:
        return {absolute_name(node): parameters_of(peer, node)}
    found: dict[str, list[Row]] = {}
    for answer in peer.ask("parameters"):
        found |= answer
    return dict(sorted(found.items()))


def parameters_of(peer: Peer, node: str) -> list[Row]:
    """Return the parameters of a node, as its process reports them.

    Raises:
        NoSuchTarget: There is no such node, or it is not busflow's.
    """
    full = absolute_name(node)
    for answer in peer.ask("parameters", node=full):
        if full in answer:
            return answer[full]
    peer.graph().node(node)  # raises for an unknown node
    raise NoSuchTarget(f"{printable(full)} is not busflow's: its parameters can only be read through its services")


def _named(rows: Sequence[Row], names: Iterable[str], node: str) -> list[Row]:
    """Return the parameters of these names, in the order of the names."""
    full, known = absolute_name(node), {row["name"]: row for row in rows}
    for name in names:
        if name not in known:
            raise NoSuchTarget(f"{printable(full)} has no parameter {name!r}; {did_you_mean(name, known)}")
    return [known[name] for name in names]


# Showing.


def _ros_type(row: Row) -> str:
    return _ROS_TYPES[int(row["ros_type"])]


def _value(row: Row) -> str:
    value: object = row["value"]
    return value if isinstance(value, str) else json.dumps(value)


def _description(row: Row) -> Iterator[str]:
    """Yield the lines that ROS 2 prints of a parameter, and three more."""
    yield f"Parameter name: {printable(row['name'])}"
    yield f"  Type: {_ros_type(row)}"
    if row["description"]:
        yield f"  Description: {printable(row['description'])}"
    yield "  Constraints:"
    yield from (f"    {line}" for line in _constraints(row))
    yield f"  Default: {'none, it is required' if row['required'] else printable(json.dumps(row['default']))}"
    yield f"  Value: {printable(_value(row))}"
    yield f"  Source: {printable(row['source'])}"


def _constraints(row: Row) -> Iterator[str]:
    bounds = row["bounds"]
    if row["read_only"]:
        yield "Read only: true"
    for title, word in (("Min value", "minimum"), ("Max value", "maximum")):
        if bounds[word] is not None:
            limit = float(bounds[word]) if _ros_type(row).startswith("double") else bounds[word]
            yield f"{title}: {limit}{' (itself excluded)' if bounds[f'exclusive_{word}'] else ''}"
    if bounds["step"] is not None:
        yield f"Step: {bounds['step']}"
    if row["choices"]:
        yield f"One of: {printable(', '.join(map(str, row['choices'])))}"


def _as_json(row: Row) -> dict[str, Any]:
    return {**row, "ros_type": _ros_type(row)}


def _print_nodes(peer: Peer, found: Mapping[str, Sequence[Row]]) -> None:
    nodes = [{"name": name, "parameters": [_as_json(row) for row in rows]} for name, rows in found.items()]
    print_answer({"run": peer.run.name, "nodes": nodes})
