"""`busflow completion`: the script that lets a shell complete commands, options, and names in running graphs."""

from __future__ import annotations

import click

_SHELLS = ("bash", "zsh", "fish")
_MENDED = {
    # Without zsh's completion loaded, the shell would print `command not found: compdef` at each start.
    "#compdef busflow\n": "#compdef busflow\n(( $+functions[compdef] )) || { autoload -Uz compinit && compinit }\n",
    # fish would cut a description at its first comma.
    'string split "," $completion': 'string split --max 1 "," $completion',
}
"""Lines of click's scripts, and their replacements."""
_EXAMPLES = """\b
Examples:
  busflow completion bash >> ~/.bashrc
  busflow completion zsh >> ~/.zshrc
  busflow completion fish > ~/.config/fish/completions/busflow.fish"""


@click.command(epilog=_EXAMPLES)
@click.argument("shell", type=click.Choice(_SHELLS))
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
    """Print the script that makes SHELL complete busflow's commands, and the names of runs, nodes and topics.

    The script runs busflow each time the tab key is pressed.
    """
    from click.shell_completion import get_completion_class

    found = get_completion_class(shell)
    if found is None:  # _SHELLS has the three that click knows
        raise click.UsageError(f"click cannot complete in {shell}")
    root = context.find_root().command
    made = found(root, {}, "busflow", "_BUSFLOW_COMPLETE")
    # `source()` of click's bash class would also run bash, to check its version.
    script = made.source_template % made.source_vars()
    for written, mended in _MENDED.items():
        script = script.replace(written, mended)
    click.echo(script)
