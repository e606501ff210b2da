"""`busflow run`: runs a launch file's nodes until Ctrl-C, for a time, or until a failure."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.launch_file import DURATION, DURATION_OR_OFF, LaunchSource, launch_file
from busflow.cli.options.lazy_group import importing
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.launchfile.load.arguments import Argument

_EXAMPLES = """\b
Examples:
  busflow run configs/lab1.yaml
  busflow run configs/lab1.yaml --for 5s --report run.json
  busflow run configs/lab1.yaml --sim --for 10min --seed 7 --trace run.txt
  busflow run configs/lab1.yaml rate_hz:=50 --set nodes.sensor_publisher.parameters.noise.imu=0.5 --seed 7
  busflow run configs/lab1.yaml --record run.mcap
  busflow run configs/lab1.yaml --watch
  busflow run configs/lab1.yaml --ros2
  busflow run --plugin sensor_publisher rate_hz:=50 noise.imu:=0.5 --for 5s
  busflow run configs/lab1.yaml --help"""


@click.command(epilog=_EXAMPLES, add_help_option=False)
@launch_file(required=False, or_plugin=True)
@click.option("--for", "for_s", type=DURATION, help="Stop after this time: 5s, 10min.")
@click.option(
    "--seed", type=click.IntRange(min=0), help="Seed of the nodes' random generators, in place of the file's."
)
@click.option("--sim", is_flag=True, help="On simulated time, as fast as it goes and the same every time.")
@click.option("--report", metavar="FILE", type=click.Path(path_type=Path), help="Write the run's report as JSON.")
@click.option("--trace", metavar="FILE", type=click.Path(path_type=Path), help="Write a line for each event.")
@click.option("--record", metavar="FILE", help="Record the run: run.mcap, or 'runs/{name}-{start}.mcap'.")
@click.option(
    "--record-topics", metavar="PATTERN", multiple=True, help="Record only these topics and services: /imu/*, /arm/**."
)
@click.option("--log-format", type=click.Choice(["console", "json"]), default="console", show_default=True)
@click.option("--strict", is_flag=True, help="Make unmatched ends and doubts about robots errors.")
@click.option("--run", "name", metavar="NAME", help="The name of the run for other terminals; else its name in FILE.")
@click.option("--no-inspect", is_flag=True, help="Do not let other terminals inspect the run.")
@click.option(
    "--watchdog",
    "watchdog_s",
    type=DURATION_OR_OFF,
    default="100ms",
    show_default=True,
    help="Name a handler that blocks the event loop for longer; or off.",
)
@click.option(
    "--event-loop",
    type=click.Choice(["busflow", "uvloop"]),
    default="busflow",
    show_default=True,
    help="The event loop of every process of the run; uvloop is an extra.",
)
@click.option("--machine", metavar="NAME", help="Run FILE's nodes on this machine; else those on no machine.")
@click.option("--ros2", is_flag=True, help="Let nodes of ROS 2 (rmw_zenoh) on this machine take part.")
@click.option("--processes", type=click.Choice(["file", "auto"]), default="file", help="auto: one for each node.")
@click.option("--one-process", is_flag=True, help="All nodes in one process, whatever FILE says.")
@click.option("--watch", is_flag=True, help="Follow FILE when it is edited: set parameters, start and stop nodes.")
@click.option("-v", "--verbose", is_flag=True, help="Log debug lines too.")
@click.option("-h", "--help", "show_help", is_flag=True, help="Show this message; with FILE, its own arguments too.")
@click.pass_context
def run(
    context: click.Context,
    source: LaunchSource | None,
    no_inspect: bool,
    processes: str,
    one_process: bool,
    show_help: bool,
    **options: Any,
) -> int:
    """Run the nodes of FILE, or with --plugin one node, until Ctrl-C.

    Logs go to standard error. At the end a table on standard output accounts for every message.
    """
    if show_help:
        return _help(context, source)
    if source is None:
        raise click.MissingParameter(ctx=context, param=context.command.params[0])
    if one_process and processes == "auto":
        raise click.UsageError("--one-process and --processes auto exclude each other", context)
    with importing():
        from busflow.cli.running import run_to_end

    return run_to_end(source, layout="one" if one_process else processes, inspect=not no_inspect, **options)


def _help(context: click.Context, source: LaunchSource | None) -> int:
    click.echo(context.get_help())
    if source is not None and source.plugin:
        click.echo(f"\nbusflow plugins info {printable(source.plugin)} shows its parameters.")
    elif source is not None:
        from busflow.cli.terminal.table import Column, print_table
        from busflow.launchfile.load.load import read_arguments

        rows = [_row(each) for each in read_arguments(source.file)]
        shown = printable(source.file)
        click.echo(f"\nArguments of {shown}:" if rows else f"\n{shown} takes no arguments.")
        print_table(rows, Column(), Column(), Column(), Column(), Column(folds=True), indent="  ")
    return 0


def _row(argument: Argument) -> tuple[object, ...]:
    """Return the row of one launch file argument: its name, type, default, range and help."""
    from busflow.validation.annotations import Bounds

    keys = argument.keys
    allowed = " | ".join(map(str, keys.choices)) if keys.choices else ""
    bounds = str(Bounds(keys.min, keys.max))
    default = "required" if argument.default is None else f"= {argument.default.data}"
    return f"{argument.name}:=", keys.type, default, allowed or bounds, keys.help
