"""LazyGroup: a click group that imports a command when it is called; the garbage collector is off meanwhile."""

from __future__ import annotations

import gc
import importlib
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.ros_words import instead_of_verb
from busflow.runner.garbage import is_frozen
from busflow.text import did_you_mean

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem  # only completion needs this import


@contextmanager
def importing() -> Generator[None]:
    """Disable the garbage collector while modules are imported: they leave no garbage, and collecting took 60 ms.

    A program that has disabled the collector, or frozen objects, keeps its own policy.
    """
    if not gc.isenabled() or is_frozen():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.unfreeze()  # the objects are now in the oldest generation; else the next collection would visit all of them
        gc.enable()


class LazyGroup(click.Group):
    """A group whose commands are given as name → (`module:attribute`, one line of help)."""

    def __init__(self, name: str, lazy: Mapping[str, tuple[str, str]], *, help: str, **settings: Any) -> None:  # noqa: A002  # click's own word
        super().__init__(name, help=help, no_args_is_help=False, **settings)
        self._lazy = lazy

    @property
    def rows(self) -> list[tuple[str, str]]:
        """Each command with its line of help."""
        return [(name, line) for name, (_, line) in self._lazy.items()]

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002  # click's signature
        """List the commands in the given order."""
        return list(self._lazy)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002  # click's signature
        """Import and return the command."""
        if cmd_name not in self._lazy:
            return None
        module, _, attribute = self._lazy[cmd_name][0].partition(":")
        return getattr(importlib.import_module(module), attribute)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002  # click's signature
        """Write the commands with their lines of help."""
        with formatter.section("Commands"):
            formatter.write_dl(self.rows)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Complete to the commands that begin with `incomplete`, with their lines of help."""
        from click.shell_completion import CompletionItem

        verbs = [CompletionItem(name, help=line) for name, line in self.rows if name.startswith(incomplete)]
        return [*verbs, *click.Command.shell_complete(self, ctx, incomplete)]

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments; without any, show the help."""
        if not args:
            args = ["--help"]
        return super().parse_args(ctx, args)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Resolve the command; an unknown one is an error that names the nearest."""
        name = args[0]
        if name not in self._lazy and not ctx.resilient_parsing:
            known = self.list_commands(ctx)
            if name not in known:
                ctx.fail(f"there is no command {name!r}: {self.advice(name, known)}")
        return super().resolve_command(ctx, args)

    def advice(self, name: str, known: Sequence[str]) -> str:
        """Return what to write instead of an unknown command: by default the nearest, unless it is a word of ROS 2."""
        return instead_of_verb(name, self.name or "") or did_you_mean(name, known)
