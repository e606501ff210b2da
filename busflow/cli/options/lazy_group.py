"""LazyGroup: a click group that imports a command when it is called, and keeps the collector away meanwhile."""

from __future__ import annotations

import gc
import importlib
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from busflow.runner.garbage import is_frozen
from busflow.text import did_you_mean

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem  # importing it costs what only the tab key needs


@contextmanager
def importing() -> Generator[None]:
    """Keeps Python's collector away while modules are imported: nothing of them is garbage, and looking took 60 ms.

    Who has turned the collector off, or frozen anything, has a policy, which stays.
    """
    if not gc.isenabled() or is_frozen():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.unfreeze()  # what is there counts as old from now on, or else the next step would look at all of it
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
        """The commands in the order in which they were given."""
        return list(self._lazy)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002  # click's signature
        """The command, imported now."""
        if cmd_name not in self._lazy:
            return None
        module, _, attribute = self._lazy[cmd_name][0].partition(":")
        return getattr(importlib.import_module(module), attribute)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002  # click's signature
        """List the commands by the help that was given with them."""
        with formatter.section("Commands"):
            formatter.write_dl(self.rows)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """The commands that begin so, with their lines of help."""
        from click.shell_completion import CompletionItem

        verbs = [CompletionItem(name, help=line) for name, line in self.rows if name.startswith(incomplete)]
        return [*verbs, *click.Command.shell_complete(self, ctx, incomplete)]

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Without a command, show what there is."""
        if not args:
            args = ["--help"]
        return super().parse_args(ctx, args)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command that is meant, or an error with the nearest one."""
        name = args[0]
        if name not in self._lazy and not ctx.resilient_parsing:
            known = self.list_commands(ctx)
            if name not in known:
                ctx.fail(f"there is no command {name!r}: {did_you_mean(name, known)}")
        return super().resolve_command(ctx, args)
