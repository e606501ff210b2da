"""Root: the group of all commands, those of busflow and those that other distributions offer by entry points.

An entry point of the group `busflow.commands` has the verb as its name and a click command as its value. It is imported
when the verb is used, not when it is listed. No distribution replaces a verb of busflow.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.lazy_group import LazyGroup
from busflow.cli.ros_words import instead_of_verb
from busflow.entry_points import entry_points, source_of
from busflow.errors import PluginError, Problem, Severity, how_to_install
from busflow.text import printable

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "busflow.commands"
"""The entry point group of the commands that installed distributions offer."""


class Root(LazyGroup):
    """The commands of busflow and of the distributions that are installed beside it."""

    def __init__(self, lazy: Mapping[str, tuple[str, str]], apart: Mapping[str, str], **settings: Any) -> None:
        """Create the group `busflow`.

        Args:
            lazy: busflow's commands, in the form of `LazyGroup`; the import path of a verb in `apart` is not used.
            apart: the verbs that another distribution of this project provides, each with its name.
            settings: the settings of a click group.
        """
        super().__init__("busflow", lazy, **settings)
        self._apart, self._own = apart, lazy.keys() - apart.keys()

    @property
    def rows(self) -> list[tuple[str, str]]:
        """Each command with its line of help; commands of unknown distributions come last."""
        others = [(verb, _summary(found)) for verb, found in self._offers.items() if verb not in self._lazy]
        return [*super().rows, *others]

    def list_commands(self, ctx: click.Context) -> list[str]:
        """List the commands; those of unknown distributions come last."""
        return list(dict.fromkeys([*super().list_commands(ctx), *self._offers]))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return the command.

        Raises:
            PluginError: Its distribution is not installed, or cannot be used.
        """
        if cmd_name in self._own:
            return super().get_command(ctx, cmd_name)
        try:
            return self._load(cmd_name)
        except PluginError:
            if ctx.resilient_parsing:  # during completion the shell would show the error in the middle of the input
                return None
            raise

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands, and below them the installed commands that cannot be used."""
        super().format_commands(ctx, formatter)
        for problem in self.problems():
            formatter.write_paragraph()
            formatter.write_text(problem.render().replace("\n", ";"))

    def advice(self, name: str, known: Sequence[str]) -> str:
        """Return what to write instead of an unknown command, a word of ROS 2 or one below other commands too."""
        if instead := instead_of_verb(name):
            return instead
        context = click.get_current_context()
        own = (self.get_command(context, verb) for verb in self._lazy if verb in self._own)
        groups = [each for each in own if isinstance(each, click.Group) and name in each.list_commands(context)]
        below = [f"busflow {each.name} {name}" for each in groups]
        return f"write {' or '.join(below)}" if below else super().advice(name, known)

    def owner(self, verb: str | None) -> str:
        """Return the name of the distribution that provides a command: busflow, or another one."""
        found = self._offers.get(verb or "")
        return "busflow" if found is None or verb in self._own else _distribution(found[0])

    def problems(self) -> Iterator[Problem]:
        """Yield a problem for each entry point that is not used."""
        for verb, found in self._offers.items():
            if verb in self._own:
                names = " and ".join(map(_distribution, found))
                message = f"the command {printable(verb)} of {names} is not used: busflow has one of this name"
                yield Problem(
                    "command-shadowed", message, f"{_removal(found[0])}, or rename it", None, Severity.WARNING
                )
            elif len(found) > 1:
                yield _ambiguity(found)

    @cached_property
    def _offers(self) -> dict[str, list[EntryPoint]]:
        """The entry points by verb, in alphabetical order."""
        found: dict[str, list[EntryPoint]] = {}
        for each in sorted(entry_points(GROUP), key=lambda entry: (entry.name, _distribution(entry), entry.value)):
            found.setdefault(each.name, []).append(each)
        return found

    def _load(self, verb: str) -> click.Command | None:
        found = self._offers.get(verb, [])
        if len(found) > 1:
            raise PluginError(_ambiguity(found))
        if found:
            return _imported(found[0])
        if verb not in self._apart:
            return None
        name = self._apart[verb]
        message = f"busflow {verb} is a command of {name}, which is not installed here"
        raise PluginError(Problem("command-missing", message, how_to_install("busflow", name)))


def _imported(entry: EntryPoint) -> click.Command:
    where = f"{_distribution(entry)} (entry point {GROUP}: {entry.name} = {entry.value})"
    try:
        command = entry.load()
    except (Exception, SystemExit) as error:
        from busflow.validation import tracebacks

        message = f"busflow {entry.name} cannot be imported from {where}: {tracebacks.reason(error)}"
        fix = f"reinstall it, or remove it: {_removal(entry)}"
        if isinstance(error, ModuleNotFoundError) and error.name:
            fix = f"install what provides {error.name!r} into the environment {sys.prefix}"
        raise PluginError(Problem("command-import", message, fix, tracebacks.user_line(error))) from error
    if not isinstance(command, click.Command):
        message = f"busflow {entry.name} cannot be used: {where} is not a click command"
        raise PluginError(Problem("no-command", message, _removal(entry)))
    return command


def _ambiguity(found: list[EntryPoint]) -> Problem:
    names = " and ".join(f"{_distribution(each)} ({each.value})" for each in found)
    message = f"busflow {found[0].name} is offered more than once, by {names}"
    return Problem("command-ambiguous", message, f"keep one: {_removal(found[-1])}")


def _distribution(entry: EntryPoint) -> str:
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist else "an unknown distribution"


def _removal(entry: EntryPoint) -> str:
    return f"pip uninstall {entry.dist.name if entry.dist else '…'}"


def _summary(found: list[EntryPoint]) -> str:
    """Return the first line of a command's docstring, without importing it; without one, name the distribution."""
    import ast

    entry = found[0]
    file = source_of(entry.module)
    with suppress(OSError, SyntaxError, ValueError, RecursionError, MemoryError):
        for statement in ast.parse(file.read_bytes()).body if file else ():
            if isinstance(statement, ast.FunctionDef) and statement.name == entry.attr:
                text = ast.get_docstring(statement) or ""
                if text:
                    return printable(text.partition("\n")[0])
    return printable(f"A command of {' and '.join(map(_distribution, found))}.")
