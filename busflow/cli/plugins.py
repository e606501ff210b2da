"""`busflow plugins`: lists the available plugins, and describes one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

import click

from busflow.cli.options.completers import complete_plugins
from busflow.cli.options.lazy_group import LazyGroup
from busflow.cli.terminal.output import print_answer, print_message, print_problems
from busflow.cli.terminal.table import Column, print_table
from busflow.errors import ExitCode
from busflow.node.plugins import built_in, find
from busflow.validation.folders import unreadable

_VERBS = {
    "list": ("busflow.cli.plugins:list_", "List name and summary of each plugin."),
    "info": ("busflow.cli.plugins:info", "Show a plugin's parameters, and what it publishes and receives."),
}
_EXAMPLES = """\b
Examples:
  busflow plugins list
  busflow plugins list --folder lab/plugins --json
  busflow plugins info sensor_publisher"""

_DEFAULT = (Path("plugins"),)

plugins: LazyGroup = LazyGroup("plugins", _VERBS, help="List the available plugins, or describe one.", epilog=_EXAMPLES)


def _options(command: Callable[..., int]) -> Callable[..., int]:
    command = click.option("--json", "as_json", is_flag=True, help="Print JSON.")(command)
    return click.option(
        "--folder",
        "folders",
        multiple=True,
        metavar="DIR",
        type=click.Path(
            exists=True, file_okay=False, readable=False, path_type=Path
        ),  # busflow says why it cannot be read
        help="A plugin folder to look in; may be given several times.  [default: plugins, and what is installed]",
    )(command)


def plugin_places(file: Path) -> dict[str, str]:
    """Return `file:line` of the class of each node in a launch file, by the node's name; nothing is imported.

    A node whose class is not found is left out.

    Raises:
        LaunchError: The file cannot be read.
    """
    from busflow.launchfile.load.load import load

    nodes = load(file).nodes
    known = {folders: {each.name: each for each in find(folders)} for folders in {node.folders for node in nodes}}
    found = {node.full_name: known[node.folders].get(node.plugin) for node in nodes}
    return {name: f"{each.file}:{each.line}" for name, each in found.items() if each is not None and each.file}


@click.command("list", epilog=_EXAMPLES)
@_options
def list_(folders: Sequence[Path], as_json: bool) -> int:
    """List name and summary of each plugin; nothing is imported."""
    folders = folders or _DEFAULT
    found = find(folders)
    own = [each for each in built_in() if all(each.name != other.name for other in found)]
    nothing, found = not found, [*found, *own]
    if as_json:
        print_answer({"plugins": [asdict(each) for each in found]})
        return _unread(folders)
    rows = [(each.name, f"cannot be read: {each.fault}" if each.fault else each.summary) for each in found]
    print_table(rows, Column(), Column(folds=True))
    if _unread(folders):
        return ExitCode.USAGE
    if nothing:
        print_message(f"no plugins in {', '.join(map(str, folders))}, and none installed but these")
    return 0


@click.command(epilog=_EXAMPLES)
@click.argument("name", shell_complete=complete_plugins)
@_options
def info(name: str, folders: Sequence[Path], as_json: bool) -> int:
    """Show the parameters of the plugin NAME with defaults and ranges, and its topics in and out."""
    from busflow.cli.terminal.plugin_sheet import sheet

    if _unread(folders or _DEFAULT):
        return ExitCode.USAGE
    described = sheet(name, folders or _DEFAULT)
    if as_json:
        print_answer(described.as_json())
    else:
        described.print()
    return 0


def _unread(folders: Sequence[Path]) -> ExitCode:
    """Print which of the folders cannot be read; return the exit code for that."""
    faults = [fault for fault in map(unreadable, folders) if fault is not None]
    print_problems(faults, error_stream=True)
    return ExitCode.USAGE if faults else ExitCode.OK
