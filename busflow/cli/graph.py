"""`busflow graph`: who publishes what to whom, without running it."""

from __future__ import annotations

from pathlib import Path

import click

from busflow.cli.launching import Given, launch_file

_EXAMPLES = """\b
Examples:
  busflow graph configs/lab1.yaml
  busflow graph configs/lab1.yaml --format mermaid
  busflow graph configs/lab1.yaml --format dot | dot -Tsvg > lab1.svg"""


@click.command(epilog=_EXAMPLES)
@launch_file()
@click.option(
    "--format", "form", type=click.Choice(["text", "mermaid", "dot", "json"]), default="text", show_default=True
)
def graph(file: Path, assignments: tuple[str, ...], sets: tuple[str, ...], form: str) -> int:
    """Draw the nodes of FILE and the topics between them, without running them."""
    from busflow.cli.drawing import Drawing
    from busflow.cli.output import print_json

    description, plan = Given(file, assignments, sets).plan()
    drawing = Drawing(description.name, plan.members)
    if form == "json":
        print_json(drawing.data())
    else:
        click.echo("\n".join({"text": drawing.text, "mermaid": drawing.mermaid, "dot": drawing.dot}[form]()))
    return 0
