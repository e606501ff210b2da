"""`busflow completion`: the script by which a shell completes commands, options, and the names of what runs."""

from __future__ import annotations

import click

_SHELLS = ("bash", "zsh", "fish")
_MENDED = {
    # A shell whose startup file does not load zsh's completion would say `command not found: compdef`, each time.
    "#compdef busflow\n": "#compdef busflow\n(( $+functions[compdef] )) || { autoload -Uz compinit && compinit }\n",
    # fish would show of a description what is before its first comma.
    'string split "," $completion': 'string split --max 1 "," $completion',
}
"""What click's scripts say, and what they have to say."""
_EXAMPLES = """\b
Examples:
  busflow completion bash >> ~/.bashrc
  busflow completion zsh >> ~/.zshrc
  busflow completion fish > ~/.config/fish/completions/busflow.fish"""


@click.command(epilog=_EXAMPLES)
@click.argument("shell", type=click.Choice(_SHELLS))
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
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
    script = made.source_template % made.source_vars()
    for written, mended in _MENDED.items():
        script = script.replace(written, mended)
    click.echo(script)
