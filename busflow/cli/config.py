"""`busflow config`: the resolved launch file, and the origin of each value."""

from __future__ import annotations

import click

from busflow.cli.options.launch_file import LaunchSource, launch_file

_EXAMPLES = """\b
Examples:
  busflow config configs/lab1.yaml
  busflow config configs/lab1.yaml rate_hz:=50 --json"""


@click.command(epilog=_EXAMPLES)
@launch_file()
@click.option("--json", "as_json", is_flag=True, help="Print JSON: the file, and the origin of each of its values.")
def config(source: LaunchSource, as_json: bool) -> None:
    """Show FILE with its includes, arguments and `--set` values put in, and where each value came from.

    Parameters without a value are shown with the default of their plugin.
    """
    from busflow.cli.terminal.output import print_answer
    from busflow.launchfile.yaml.block import lines, origins
    from busflow.runner.planning.resolved import resolve

    resolved = resolve(source.description())
    if as_json:
        print_answer({"config": resolved.data, "origins": origins(resolved)})
    else:
        click.echo("\n".join(lines(resolved)))
