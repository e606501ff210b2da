"""`busflow bag recover`: writes what can be read of a damaged or cut-off recording to a new file."""

from __future__ import annotations

from pathlib import Path

import click

from busflow.cli.bag.signal_handling import unwound_by_signals
from busflow.cli.options.bag import reads
from busflow.cli.terminal.output import print_answer, print_message
from busflow.cli.terminal.progress import progress
from busflow.text import counted

_EXAMPLES = """\b
Examples:
  busflow bag recover run.mcap
  busflow bag recover run.mcap -o saved.mcap"""


@click.command(epilog=_EXAMPLES)
@reads()
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="The file to write.  [default: FILE with .recovered before .mcap]",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def recover(file: Path, output: Path | None, as_json: bool) -> None:
    """Write what can be read of the recording FILE to a new file, and print how much that is.

    FILE is left as it is. The new file also has everything else of it: types, launch file, metadata. It is marked as
    INCOMPLETE, unless nothing was wrong.
    """
    from busflow.recording.tools.recover import recover as recovered

    target = output or file.with_name(f"{file.stem}.recovered.mcap")
    with unwound_by_signals(), progress("recovering") as step:
        found = recovered(file, target, step)
    if as_json:
        print_answer(
            {
                "output": str(target),
                "messages": found.messages,
                "missing": found.missing,
                "strays": found.strays,
                "attachments": found.attachments,
                "metadata": found.metadata,
                "damages": [{"offset": each.offset, "what": each.reason} for each in found.damages],
            }
        )
        return
    for damage in found.damages:
        print_message(f"warning: {damage}")
    saved = counted(found.messages, "message")
    click.echo(f"{target}: {saved} saved (attachments: {found.attachments}, metadata: {found.metadata})")
    if found.strays:
        orphans = counted(found.strays, "message was", "messages were")
        click.echo(f"{orphans} not saved, because their topics are unknown")
    if found.missing:
        missing = counted(found.missing, "message is", "messages are")
        click.echo(f"{missing} missing between those that were saved")
    if not found.damages:
        click.echo("nothing was wrong with it")
