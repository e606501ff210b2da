"""`busflow completion`: the script by which a shell completes commands, options, and the names of what runs."""

from __future__ import annotations

import click

_SHELLS = ("bash", "zsh", "fish")
_EXAMPLES = """\b
Examples:
  busflow completion bash >> ~/.bashrc
  busflow completion zsh >> ~/.zshrc
  busflow completion fish > ~/.config/fish/completions/busflow.fish"""


@click.command(epilog=_EXAMPLES)
@click.argument("shell", type=click.Choice(_SHELLS))
@click.pass_context
def completion(context: click.Context, shell: str) -> int:
    """Print the script that makes SHELL complete busflow's commands, and the runs, nodes and topics there are.

    It asks busflow itself, each time the tab key is pressed.
    """
    from click.shell_completion import get_completion_class

    found = get_completion_class(shell)
    if found is None:  # one of click's own three
        raise click.UsageError(f"click cannot complete in {shell}")
    root = context.find_root().command
    made = found(root, {}, "busflow", "_BUSFLOW_COMPLETE")
    # What click's bash class does besides is to run bash and look at its version, which the reader knows.
    click.echo(made.source_template % made.source_vars())
    return 0
