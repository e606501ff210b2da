"""Completers: complete a launch file's arguments and paths, and the names of plugins, without a run.

The shell shows everything that a completer prints, so a completer hides its errors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import click
from click.shell_completion import CompletionItem

Completer = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]


def completer(names: Callable[[click.Context, str], Iterable[tuple[str, str | None]]]) -> Completer:
    """Return a completer for these names, each of which has a line of help or None."""

    def complete(context: click.Context, _parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
        try:
            found = list(names(context, incomplete))
        except Exception:  # noqa: BLE001  # the shell would show the error in the middle of the input
            return []
        return [CompletionItem(name, help=line) for name, line in found if name.startswith(incomplete)]

    return complete


@completer
def complete_arguments(context: click.Context, incomplete: str) -> Iterator[tuple[str, str]]:
    """Yield the arguments of the launch file on the command line, with their help."""
    from busflow.launchfile.load.load import read_arguments

    if not incomplete.endswith(":="):
        yield from ((f"{each.name}:=", each.keys.help) for each in read_arguments(context.params["file"]))


@completer
def complete_paths(context: click.Context, _incomplete: str) -> Iterator[tuple[str, str]]:
    """Yield the path of each value of the launch file on the command line, with the origin of the value."""
    from busflow.launchfile.load.load import load
    from busflow.launchfile.yaml.block import origins
    from busflow.runner.planning.resolved import resolve

    file, assignments = context.params.get("file"), context.params.get("assignments")
    if file is None:  # where an option is unfinished, click has not looked at the arguments
        file, *assignments = context.args
    # Plugins are imported for their parameters; what they print would be taken for a completion.
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        description = load(file, assignments=assignments or (), profiles=context.params.get("profiles") or ())
        found = origins(resolve(description))
    yield from ((f"{path}=", origin) for path, origin in found.items())


@completer
def complete_plugins(context: click.Context, _incomplete: str) -> Iterator[tuple[str, str]]:
    """Yield the plugins in the folders on the command line, and those installed, with their summaries."""
    from busflow.node.plugins import built_in, find

    stated: Sequence[Path] | Path | None = context.params.get("folders") or context.params.get("folder")
    folders = [stated] if isinstance(stated, Path) else stated or [Path("plugins")]
    yield from ((each.name, each.summary) for each in [*find(folders), *built_in()])
