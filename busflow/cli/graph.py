"""`busflow graph`: draws the nodes, topics and services of a running graph or of a launch file."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from busflow.cli.options.launch_file import LaunchSource, launch_file
from busflow.cli.options.run import complete_runs, joined
from busflow.cli.terminal.output import print_answer
from busflow.cli.terminal.table import terminal_width

if TYPE_CHECKING:
    from busflow.cli.terminal.graph_drawing import Drawing

_EXAMPLES = """\b
Examples:
  busflow graph
  busflow graph configs/lab1.yaml --format mermaid
  busflow graph configs/lab1.yaml --format dot | dot -Tsvg > lab1.svg"""


@click.command(epilog=_EXAMPLES)
@launch_file(required=False, file_="[FILE]")
@click.option(
    "--format", "form", type=click.Choice(["text", "mermaid", "dot", "json"]), default="text", show_default=True
)
@click.option("--json", "as_json", is_flag=True, help="The same as --format json.")
@click.option("--run", metavar="NAME", shell_complete=complete_runs, help="The run to draw, where there are several.")
@click.option("-a", "--all", "all_", is_flag=True, help="Of a run: also hidden nodes, and what every node has.")
@click.pass_context
def graph(
    context: click.Context,
    source: LaunchSource | None,
    form: str,
    as_json: bool,
    run: str | None,
    all_: bool,
) -> None:
    """Draw the nodes and topics of the running graph; with FILE those of a launch file, without running it."""
    if source is not None and (run is not None or all_):
        raise click.UsageError("--run and --all are for graphs that run, which FILE does not", context)
    drawing = _of_run(run, all_=all_) if source is None else _of_file(source)
    if as_json or form == "json":
        print_answer(drawing.data())
    else:
        lines = {"text": lambda: drawing.text(terminal_width()), "mermaid": drawing.mermaid, "dot": drawing.dot}[form]
        click.echo("\n".join(lines()))


def _of_run(run: str | None, *, all_: bool) -> Drawing:
    from busflow.cli.terminal.graph_drawing import Drawing

    with joined(run) as peer:
        return Drawing.of_view(peer.run.name, peer.graph(), all_=all_)


def _of_file(source: LaunchSource) -> Drawing:
    from busflow.cli.terminal.graph_drawing import Drawing

    description, plan = source.plan()
    return Drawing.of_plan(description.name, plan.nodes)
