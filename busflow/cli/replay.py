"""`busflow replay`: runs nodes again on a recording, and compares what they publish with what was recorded."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.completers import complete_plugins
from busflow.cli.options.launch_file import DURATION, LaunchSource, launch_file
from busflow.cli.options.number import Number

if TYPE_CHECKING:
    from busflow.recording.replay.replay import Replay
    from busflow.runner.graph import What

_EXAMPLES = """\b
Examples:
  busflow replay run.mcap configs/lab1.yaml --node sensor_processor
  busflow replay run.mcap configs/lab1.yaml --tolerance 1e-6 --json
  busflow replay run.mcap --plugin sensor_processor --folder plugins"""

_SHOWN = 10


@click.command(epilog=_EXAMPLES)
@click.argument("recording", metavar="RECORDING", type=click.Path(path_type=Path))
@launch_file(required=False, file_="[FILE]")
@click.option("--node", "nodes", multiple=True, metavar="NAME", help="A node of FILE to run again; all by default.")
@click.option("--plugin", metavar="NAME", shell_complete=complete_plugins,
              help="A plugin to run in place of FILE, under the name of --node or its own.")  # fmt: skip
@click.option("--folder", type=click.Path(exists=True, file_okay=False, path_type=Path), default=None,
              help="The plugin folder of --plugin.  [default: plugins, and what is installed]")  # fmt: skip
@click.option("--tolerance", type=Number(min=0), default=0.0, help="How far apart numbers may be: 1e-6.")
@click.option("--time-tolerance", "time_tolerance_s", type=DURATION,
              help="How far apart times may be.  [default: 0 in simulated time, else 100ms]")  # fmt: skip
@click.option("--record", metavar="FILE", type=click.Path(path_type=Path), help="Record the replay itself.")
@click.option("--incomplete", "allow_incomplete", is_flag=True, help="Replay a recording although it is not complete.")
@click.option("--show", type=click.IntRange(min=0), default=_SHOWN, show_default=True, help="Differences to show.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.pass_context
def replay(
    context: click.Context,
    source: LaunchSource | None,
    recording: Path,
    nodes: tuple[str, ...],
    plugin: str | None,
    folder: Path | None,
    show: int,
    as_json: bool,
    **how: Any,
) -> int:
    """Run nodes of FILE again on a recording, and compare what they publish with what was recorded.

    Inputs, ticks, parameters and calls come in the recorded order, at the recorded times. The exit code is 0 if
    everything is the same, and 3 if something differs.
    """
    from busflow.recording.replay.replay import replay as run_anew

    if (source is None) == (plugin is None):
        both = " instead of it: not both" if plugin is not None else ""
        raise click.UsageError(f"name a launch file after the recording, or a plugin with --plugin{both}", context)
    what = source.description() if source is not None else _alone(str(plugin), nodes, folder, context)
    outcome = run_anew(recording, what, nodes=nodes, keep=0, **how)
    return _print_outcome(outcome, show, as_json=as_json)


def _print_outcome(outcome: Replay, show: int, *, as_json: bool) -> int:
    from busflow.cli.terminal.output import outcome_printed, print_answer, print_message
    from busflow.errors import ExitCode

    with outcome_printed():
        if as_json:
            print_answer(outcome.as_json())
        else:
            print_message(outcome.render(show), error_stream=False)
    return ExitCode.OK if outcome.same else ExitCode.DIFFERENT


def _alone(plugin: str, nodes: tuple[str, ...], folder: Path | None, context: click.Context) -> What:
    """Return the description of a graph with one node of a plugin, as a launch file would state it."""
    if len(nodes) > 1:
        raise click.UsageError("--plugin runs one node: give one name with --node, or none", context)
    return replace(
        LaunchSource(Path(), plugin=plugin, node=next(iter(nodes), None), folder=folder).description(), name="replay"
    )
