"""`busflow completion`: the script that lets a shell complete commands, options, and names in running graphs."""

from __future__ import annotations

import os

import click
from click.shell_completion import BashComplete, add_completion_class, get_completion_class, shell_complete

_VARIABLE = "_BUSFLOW_COMPLETE"
_SHELLS = ("bash", "zsh", "fish")
_MENDED = {
    # Without zsh's completion loaded, the shell would print `command not found: compdef` at each start.
    "#compdef busflow\n": "#compdef busflow\n(( $+functions[compdef] )) || { autoload -Uz compinit && compinit }\n",
    # bash would put a blank behind `rate_hz:=`, before the value.
    "COMPREPLY+=($value)": "COMPREPLY+=($value); [[ $value == *= ]] && compopt -o nospace",
    # fish would cut a description at its first comma.
    'string split "," $completion': 'string split --max 1 "," $completion',
}
"""Lines of click's scripts, and their replacements."""
_EXAMPLES = """\b
Examples:
  busflow completion bash >> ~/.bashrc
  busflow completion zsh >> ~/.zshrc
  busflow completion fish > ~/.config/fish/completions/busflow.fish"""


class _Bash(BashComplete):
    """The answer to bash, which breaks a word at each `:` and `=`: `rate_hz:=5` comes as three."""

    def get_completion_args(self) -> tuple[list[str], str]:
        args, incomplete = super().get_completion_args()
        whole: list[str] = []
        joins = False
        for word in [*args, incomplete]:
            separates = word != "" and set(word) <= {":", "="}
            if whole and (separates or joins):
                whole[-1] += word
            else:
                whole.append(word)
            joins = separates
        *args, incomplete = whole
        return args, incomplete


def complete(root: click.Command) -> int:
    """Answer a shell that asks for completions; return the exit code."""
    add_completion_class(_Bash)
    return shell_complete(root, {}, "busflow", _VARIABLE, os.environ[_VARIABLE])


@click.command(epilog=_EXAMPLES)
@click.argument("shell", type=click.Choice(_SHELLS))
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
    """Print the script that makes SHELL complete busflow's commands, and the names of runs, nodes, topics and plugins.

    The script runs busflow each time the tab key is pressed.
    """
    found = get_completion_class(shell)
    if found is None:  # _SHELLS has the three that click knows
        raise click.UsageError(f"click cannot complete in {shell}")
    root = context.find_root().command
    made = found(root, {}, "busflow", _VARIABLE)
    # `source()` of click's bash class would also run bash, to check its version.
    script = made.source_template % made.source_vars()
    for written, mended in _MENDED.items():
        script = script.replace(written, mended)
    click.echo(script)
