"""`busflow schema`: the JSON Schema with which an editor completes and checks a launch file."""

from __future__ import annotations

from pathlib import Path

import click

_EXAMPLES = """\b
Examples:
  busflow schema configs/lab1.yaml --write
  busflow schema configs/lab1.yaml > lab1.schema.json"""


@click.command(epilog=_EXAMPLES)
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--write", is_flag=True, help="Write it beside FILE: lab1.schema.json beside lab1.yaml.")
def schema(file: Path, write: bool) -> None:
    """Print the JSON Schema of FILE: its keys, and the parameters of every plugin it may name."""
    from busflow.cli.terminal.output import json_text, print_message
    from busflow.text import printable

    text = json_text(_schema_of(file)) + "\n"
    if not write:
        click.echo(text, nl=False)
        return
    target = file.with_suffix(".schema.json")
    try:
        target.write_text(text, encoding="utf-8")
    except OSError as error:
        raise click.ClickException(f"cannot write {target}: {error.strerror}") from None
    click.echo(f"Wrote {printable(target)}")
    if "yaml-language-server: $schema=" not in file.read_text(encoding="utf-8"):
        print_message(f"to use it, let {file} begin with:\n# yaml-language-server: $schema={target.name}")


def _schema_of(file: Path) -> dict[str, object]:
    """Return the schema with every plugin that can be loaded; print why the others are missing."""
    from busflow.cli.terminal.output import print_message
    from busflow.errors import LaunchError, PluginError
    from busflow.launchfile.load.load import examine
    from busflow.launchfile.model.json_schema import PluginSchema, launch_schema
    from busflow.node.node import parameters_class
    from busflow.node.plugins import find, load, names

    description, problems = examine(file, plugins=names)
    if description is None:  # a file with other mistakes still gets a schema, with which the editor helps to fix them
        raise LaunchError(problems)
    folders = [folder.path for folder in description.folders]
    known: list[PluginSchema] = []
    for plugin in find(folders):
        try:
            known.append(PluginSchema(plugin.name, parameters_class(load(plugin.name, folders)), plugin.summary))
        except PluginError as error:
            print_message(f"warning: the schema lacks the parameters of {plugin.name}\n{error}")
    return launch_schema(known)
