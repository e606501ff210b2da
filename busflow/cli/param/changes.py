"""The verbs of `busflow param` that set parameters, compare them with the launch file, save and watch them."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from busflow.bus.names import absolute_name
from busflow.cli.options.run import complete_nodes, joined, joins, until_run_ends
from busflow.cli.param import complete_parameters, parameters_of
from busflow.cli.terminal.output import outcome_printed, print_answer, print_line, print_message, short_path
from busflow.cli.terminal.table import Column, print_table
from busflow.clock import sleep
from busflow.errors import ExitCode, NoSuchTarget, Problem
from busflow.text import counted, printable

if TYPE_CHECKING:
    from busflow.launchfile.yaml.file_edit import LaunchFileEdit
    from busflow.launchfile.yaml.value import Value
    from busflow.runner.planning.drift import Drift
    from busflow.wire.client.client import Peer

_POLL_S = 0.2
_NEGATIVE = re.compile(r"-\.?(\d|inf)", re.IGNORECASE)
_EXAMPLES = {
    "set": (
        "busflow param set sensor_publisher noise.imu 0.5",
        "busflow param set sensor_publisher noise.imu 0.5 rate_hz 20",
        "busflow param set camera frame_id camera_link --run robot",
    ),
    "load": (
        "busflow param dump sensor_publisher --output publisher.yaml",
        "busflow param load sensor_publisher publisher.yaml",
    ),
    "diff": (
        "busflow param diff sensor_publisher",
        "busflow param diff sensor_publisher --json",
    ),
    "save": (
        "busflow param save sensor_publisher",
        "busflow param save sensor_publisher --into configs/tuned.yaml",
    ),
    "watch": (
        "busflow param watch",
        "busflow param watch sensor_publisher --json | jq -r .name",
    ),
}
_node = click.argument("node", shell_complete=complete_nodes)


def _examples(verb: str) -> str:
    return "\n  ".join(["\b\nExamples:", *_EXAMPLES[verb]])


class _Assigning(click.Command):
    """A command that takes negative numbers as values, not as options."""

    ignore_unknown_options = True

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        options = args[: args.index("--")] if "--" in args else args[:]
        rest = super().parse_args(ctx, args)
        for each in (ctx.params.get("node"), *(ctx.params.get("assignments") or ())):
            if each in options and each.startswith("-") and not _NEGATIVE.match(each):
                raise click.NoSuchOption(each, ctx=ctx)
        return rest


@click.command("set", cls=_Assigning, epilog=_examples("set"))
@_node
@click.argument(
    "assignments", nargs=-1, required=True, metavar="NAME VALUE [NAME VALUE]...", shell_complete=complete_parameters
)
@joins
def set_(run: str | None, node: str, assignments: tuple[str, ...], as_json: bool) -> int:
    """Set parameters of NODE: all of them, or none, with the reasons.

    A value is written as in a launch file: 0.5, true, imu_link, "[1.0, 2.0]".
    """
    if len(assignments) % 2:
        name, is_joined, value = assignments[-1].partition("=")
        fix = f"{name} {value}" if is_joined else "NAME VALUE for each parameter"
        raise click.UsageError(f"{printable(assignments[-1])} has no value: write {printable(fix)}")
    given = {name: _value(text) for name, text in zip(assignments[::2], assignments[1::2], strict=True)}
    with joined(run) as peer:
        return _set(peer, node, {name: each.data for name, each in given.items()}, as_json=as_json, given=given)


@click.command(epilog=_examples("load"))
@_node
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@joins
def load(run: str | None, node: str, file: Path, as_json: bool) -> int:
    """Set the parameters of NODE that FILE states, all of them or none.

    FILE has the form that `busflow param dump` and `ros2 param dump` write, or holds the parameters alone.
    """
    from busflow.launchfile.load.parameter_file import nested, of_node
    from busflow.launchfile.yaml.document import read_file

    whole = read_file(file, str(file))
    if not isinstance(whole.content, dict):
        raise click.BadParameter(f"{printable(file)} holds no parameters: a mapping is needed", param_hint="FILE")
    stated = nested(of_node(whole, absolute_name(node), whole.origin))
    with joined(run) as peer:
        return _set(peer, node, cast("dict[str, Any]", stated.data), as_json=as_json, stated=stated)


@click.command(epilog=_examples("diff"))
@_node
@joins
def diff(run: str | None, node: str, as_json: bool) -> int:
    """Show the parameters of NODE that differ from its resolved launch file; exit code 3 if any does."""
    with joined(run) as peer:
        found = _drifts(peer, node, Path(short_path(peer.run.card.file)))
    with outcome_printed():
        if as_json:
            rows = [{"name": each.name, "stated": each.stated, "value": each.value} for each in found]
            print_answer({"run": peer.run.name, "node": absolute_name(node), "differences": rows})
        else:
            rows = [(each.name, _shown(each.stated), "→", _shown(each.value), f"({each.origin})") for each in found]
            value = Column(folds=True)
            print_table(rows, Column(), value, Column(), value, value)
    return ExitCode.DIFFERENT if found else ExitCode.OK


@click.command(epilog=_examples("save"))
@_node
@click.option(
    "--into",
    metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write into this launch file, which must exist and have the node.",
)
@joins
def save(run: str | None, node: str, into: Path | None, as_json: bool) -> None:
    """Write the changed parameters of NODE back into its launch file; comments and order stay."""
    if into is not None and not into.exists():
        why = "it has to be a launch file that has the node: copy the run's, or write the parameters alone with"
        raise click.BadParameter(
            f"there is no {printable(into)}; {why} busflow param dump {printable(node)} --output {printable(into)}",
            param_hint="--into",
        )
    with joined(run) as peer:
        file = into or Path(short_path(peer.run.card.file))
        found = _drifts(peer, node, file)
    _edit(file, found).write()
    if as_json:
        saved = [{"name": each.name, "before": each.stated, "after": each.value} for each in found]
        print_answer({"run": peer.run.name, "node": absolute_name(node), "file": str(file), "saved": saved})
    else:
        for each in found:
            click.echo(f"{printable(each.name)}: {_shown(each.stated)} → {_shown(each.value)}")
        click.echo(f"{len(found)} written into {printable(file)}" if found else f"{printable(file)} says so already")


@click.command(epilog=_examples("watch"))
@click.argument("node", required=False, shell_complete=complete_nodes)
@joins
def watch(run: str | None, node: str | None, as_json: bool) -> int:
    """Show each change of a parameter of NODE, or of any node, until Ctrl-C or the end of the run."""
    with until_run_ends(), joined(run) as peer:
        if node is not None:
            parameters_of(peer, node)
        known: dict[str, int] = {answer["process"]: answer["last"] for answer in peer.ask("parameter_changes")}
        while True:
            for answer in peer.ask("parameter_changes", since=known):
                _print_changes(answer, known, node, as_json=as_json)
            sleep(_POLL_S)


def stated_parameters(file: Path) -> dict[str, Mapping[str, Any]]:
    """Return the parameters that a launch file states for each node, by the node's name: nested, and not validated.

    Raises:
        LaunchError: The file cannot be read.
    """
    from busflow.launchfile.load.load import load as load_file

    return {node.full_name: cast("Mapping[str, Any]", node.parameters.data) for node in load_file(file).nodes}


def saved_parameters(peer: Peer, nodes: Sequence[str]) -> LaunchFileEdit:
    """Return the edit that writes the changed parameters of these nodes into the run's launch file.

    Raises:
        NoSuchTarget: The file has no such node, or the node is not busflow's.
        LaunchError: The file cannot be read, or a value has no place in it.
    """
    file = Path(peer.run.card.file)
    return _edit(file, [each for node in nodes for each in _drifts(peer, node, file)])


def _edit(file: Path, found: Sequence[Drift]) -> LaunchFileEdit:
    """Return the edit that writes these values into a launch file."""
    from busflow.launchfile.yaml.file_edit import LaunchFileEdit
    from busflow.runner.planning.drift import written_back

    return LaunchFileEdit.of(file, lambda text: written_back(text, file, found))


# Setting.


def _set(
    peer: Peer,
    node: str,
    values: Mapping[str, object],
    *,
    as_json: bool,
    stated: Value | None = None,
    given: Mapping[str, Value] | None = None,
) -> int:
    """Set parameters, and print the result; the faults of those that a file has stated with their lines."""
    from busflow.launchfile.model.problems import quoted_as_written

    parameters_of(peer, node)  # raises for an unknown node
    results = peer.ask("set_parameters", node=absolute_name(node), values=values)
    changed, faults = results[0]["changed"], results[0]["faults"]
    for fault in faults:
        path = tuple(fault["path"])
        value = stated.nearest(path) if stated is not None else (given or {}).get(".".join(map(str, path)))
        fault["fix"] = fault["fix"] if value is None else quoted_as_written(fault["fix"], value)
    if as_json:
        print_answer({"run": peer.run.name, "node": absolute_name(node), "changed": changed, "faults": faults})
    elif faults:
        print_message("Setting parameter failed: nothing was set")
        for fault in faults:
            at = None if stated is None else stated.nearest(tuple(fault["path"]))
            place = None if at is None else at.key if fault["code"] == "unknown" else at.origin.place
            print_message(Problem(fault["code"], fault["message"], fault["fix"], place).render())
    else:
        click.echo("Set parameter successful" if len(values) == 1 else "Set parameters successful")
        for change in changed:
            if len(values) > 1:
                click.echo(f"  {printable(change['name'])}: {_shown(change['old'])} → {_shown(change['new'])}")
    return ExitCode.FAILED if faults else ExitCode.OK


def _value(text: str) -> Value:
    from busflow.launchfile.yaml.document import parse_value

    return parse_value(text, "command line")


# Comparing with the launch file.


def _drifts(peer: Peer, node: str, file: Path) -> tuple[Drift, ...]:
    from busflow.launchfile.load.load import load as load_file
    from busflow.runner.planning.drift import drifts

    values = {row["name"]: row["value"] for row in parameters_of(peer, node)}
    for spec in load_file(file).nodes:
        if spec.full_name == absolute_name(node):
            return drifts(spec, values)
    raise NoSuchTarget(f"{printable(file)} has no node {printable(absolute_name(node))}")


# Showing.


def _print_changes(answer: Mapping[str, Any], known: dict[str, int], node: str | None, *, as_json: bool) -> None:
    """Print the changes that one process reports, and remember the last one."""
    first = answer["changes"][0]["sequence"] if answer["changes"] else answer["last"] + 1
    missed = first - known.get(answer["process"], 0) - 1
    if missed:
        print_message(f"warning: {counted(missed, 'change was', 'changes were')} discarded before they could be shown")
    known[answer["process"]] = answer["last"]
    for change in answer["changes"]:
        if node is not None and change["node"] != absolute_name(node):
            continue
        if as_json:
            print_line(change)
        else:
            values = f"{_shown(change['old'])} → {_shown(change['new'])}"
            click.echo(f"{printable(change['node'])} {printable(change['name'])}: {values}")


def _shown(value: object) -> str:
    return printable(value if isinstance(value, str) else json.dumps(value), limit=200)
