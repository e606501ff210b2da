"""`busflow top`: shows a running graph live in the terminal: nodes, topics, rates, drops, queues, goals and the log."""

from __future__ import annotations

import sys
from importlib.util import find_spec

import click

from busflow.cli.options.number import Number
from busflow.errors import how_to_install

_EXAMPLES = """\b
Examples:
  busflow top
  busflow top --run lab1 --interval 0.5"""


@click.command(epilog=_EXAMPLES)
@click.option("--run", "run_name", metavar="NAME", help="The run, if there are several.")
@click.option("--interval", type=Number(0.1, 60), default=1.0, show_default=True, help="Seconds between two updates.")
def top(run_name: str | None, interval: float) -> int:
    """Watch a running graph: its nodes, its topics with rates and drops, what became of goals, and its log.

    Keys: e echoes the chosen topic, p plots one of its numbers, space pauses, q ends.
    """
    if find_spec("textual") is None:
        raise click.UsageError(f"busflow top needs one more package; {how_to_install('busflow[top]')}")
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise click.UsageError("busflow top needs a terminal; busflow topic stats --json is for scripts")
    from busflow.cli.top.screen import Top
    from busflow.wire.client.client import join

    with join(run_name) as peer:
        screen = Top(peer, interval)
        screen.run()
    return screen.return_code or 0
