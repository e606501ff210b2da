"""Arguments and options of every command that reads a launch file: FILE, `name:=value`, `--set`, `--profile`."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.completers import complete_arguments, complete_paths, complete_plugins
from busflow.errors import LaunchError
from busflow.runner.source import Source, variables_of
from busflow.text import printable
from busflow.validation.durations import parse_duration

if TYPE_CHECKING:
    from busflow.launchfile.model.description import Examined, LaunchDescription
    from busflow.runner.planning.preflight import Plan

    _ParamType = click.ParamType[float | None]
else:
    _ParamType = click.ParamType  # generic in newer versions of click only

_OTHER_KINDS = {
    ".mcap": "is a recording: busflow bag play FILE plays it, busflow replay FILE LAUNCH_FILE runs nodes on it",
    ".py": "is Python: a launch file is YAML, and names it as plugin; busflow new my_robot makes an example",
    ".xml": "is XML: a launch file is YAML; busflow new my_robot makes an example",
}
"""Advice for files that are mistaken for launch files, by suffix."""
_NUMBER = re.compile(r"[0-9]{1,20}(\.[0-9]{0,20})?")


class LaunchSource(Source):
    """The launch file of a command line with its overrides, or the plugin in its place."""

    __slots__ = ()

    def description(self) -> LaunchDescription:
        """Return the file's description.

        Raises:
            LaunchError: The file has problems; the error has all of them.
        """
        description, problems = self.examine()
        if description is None:
            raise LaunchError(problems)
        if problems:
            from busflow.launchfile.model.problems import in_order
            from busflow.runner.assembly import Kind, Run

            files = [str(each) for each in description.files]
            raise LaunchError(in_order([*problems, *Run([description], Kind.PLAN).plan().errors], files))
        return description

    def examine(self) -> Examined:
        """Return the description of the file's valid part, and all problems.

        The environment variables that the file sets stay set until the command ends.
        """
        description, problems = self.read()
        if description is not None:
            click.get_current_context().with_resource(variables_of([description]))
        return description, problems

    def plan(self) -> tuple[LaunchDescription, Plan]:
        """Return the file's description and the plan of its nodes, built and checked.

        Raises:
            LaunchError: There are problems; the error has all of them.
        """
        from busflow.runner.assembly import Kind, Run

        description = self.description()
        plan = Run([description], Kind.PLAN).plan()
        if plan.errors:
            raise LaunchError(plan.errors)
        return description, plan


def refuse_other_kinds(file: Path) -> None:
    """Refuse what is no launch file by its name, and say what to do with it.

    Raises:
        click.UsageError: It is no launch file.
    """
    if ":=" in str(file):
        why = f"{printable(file)} is an argument of the launch file: name the file first"
        raise click.UsageError(why, click.get_current_context())
    if kind := _OTHER_KINDS.get(file.suffix):
        raise click.UsageError(f"{printable(file)} {kind}", click.get_current_context())


_CHANGES = (
    click.option(
        "--profile",
        "profiles",
        multiple=True,
        metavar="NAME",
        help="Lay this profile of FILE over the rest of it; the last one of several is on top.",
    ),
    click.option(
        "--set",
        "sets",
        multiple=True,
        metavar="PATH=VALUE",
        shell_complete=complete_paths,
        help="Change one value, by its path: nodes.imu.parameters.rate_hz=50.",
    ),
)
_NAMES = ("plugin", "node", "folder", "remaps")
_SINGLE_NODE = (
    click.option(
        "--plugin",
        metavar="NAME",
        shell_complete=complete_plugins,
        help="Run one node of this plugin instead of FILE; NAME:=VALUE are its parameters.",
    ),
    click.option("--node", metavar="NAME", help="The name of the node of --plugin.  [default: that of its class]"),
    click.option(
        "--folder",
        metavar="DIR",
        type=click.Path(exists=True, file_okay=False, path_type=Path),
        help="The plugin folder of --plugin.  [default: plugins, and what is installed]",
    ),
    click.option("-r", "--remap", "remaps", multiple=True, metavar="OLD:=NEW", help="A name that --plugin uses anew."),
)


def _single_node(
    file: str | None,
    assignments: tuple[str, ...],
    sets: tuple[str, ...],
    profiles: tuple[str, ...],
    *,
    plugin: str | None,
    node: str | None,
    folder: Path | None,
    remaps: tuple[str, ...],
) -> LaunchSource | None:
    """Return the node that the command line states instead of a launch file; None if it names a file."""
    context = click.get_current_context()
    if plugin is None:
        if remaps:
            why = "--remap is for --plugin; with FILE write --set nodes.NODE.remap.OLD=NEW"
            raise click.UsageError(why, context)
        if node is not None or folder is not None:
            raise click.UsageError("--node and --folder are for --plugin", context)
        return None
    # Without FILE the first of the parameters stands in its place.
    parameters = assignments if file is None else (file, *assignments)
    if file is not None and ":=" not in file:
        raise click.UsageError(f"name a launch file, or a plugin with --plugin: not both {printable(file)}", context)
    if profiles:
        raise click.UsageError("--profile is for FILE: a node alone has no profiles", context)
    return LaunchSource(Path(), parameters, sets, plugin=plugin, node=node, folder=folder, remaps=remaps)


def launch_file(
    *, required: bool = True, file_: str = "FILE", rest: str = "[NAME:=VALUE]...", or_plugin: bool = False
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add FILE, ARGS, `--set` and `--profile` to a command, which receives one `LaunchSource`, or None without FILE.

    Args:
        required: Whether FILE is required.
        file_: The name of FILE in the help.
        rest: The name of the arguments after FILE in the help.
        or_plugin: Whether `--plugin` may stand in place of FILE, with options of its own.
    """

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(command)
        def called(file: str | None, **how: Any) -> Any:
            stated = [how.pop(name) for name in ("assignments", "sets", "profiles")]
            if or_plugin:
                alone = _single_node(file, *stated, **{name: how.pop(name) for name in _NAMES})
                if alone is not None:
                    return command(alone, **how)
            if file is None and any(stated):
                context = click.get_current_context()
                raise click.MissingParameter("the other arguments change a file", context, context.command.params[0])
            if file is None:
                return command(None, **how)
            refuse_other_kinds(Path(file))
            return command(LaunchSource(Path(file), *stated), **how)

        for parameter in (
            *(_SINGLE_NODE if or_plugin else ()),
            *_CHANGES,
            click.argument("assignments", nargs=-1, metavar=rest, shell_complete=complete_arguments),
            click.argument("file", required=required, metavar=file_, type=click.Path()),
        ):
            called = parameter(called)
        return called

    return decorate


class DurationType(_ParamType):
    """The type of an option that takes `5s`, `50ms`, `10min`, or a plain number of seconds."""

    name = "duration"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | None:
        """Return the duration in seconds."""
        try:
            return parse_duration(float(value) if _NUMBER.fullmatch(value) else value)
        except ValueError as error:
            self.fail(str(error), param, ctx)


class _DurationOrOff(DurationType):
    """The type of an option that takes a duration or the word `off`."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | None:
        return None if value == "off" else super().convert(value, param, ctx)


DURATION, DURATION_OR_OFF = DurationType(), _DurationOrOff()
