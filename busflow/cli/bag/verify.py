"""`busflow bag verify`: reads all of a recording and reports what is wrong with it."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

import click

from busflow.cli.options.bag import reads
from busflow.cli.terminal.output import outcome_printed, print_answer, print_message
from busflow.cli.terminal.progress import progress
from busflow.errors import ExitCode
from busflow.text import counted

if TYPE_CHECKING:
    from pathlib import Path

    from busflow.recording.tools.verify import Examination

_EXAMPLES = """\b
Examples:
  busflow bag verify run.mcap
  busflow bag verify run.mcap --json | jq .findings"""


@click.command(epilog=_EXAMPLES)
@reads()
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def verify(file: Path, as_json: bool) -> int:
    """Read all of the recording FILE, and compare its content with its summary and metadata.

    Checked are CRCs, indices, the summary, the numbers of the messages, the ledger, the hashes of types, and every
    message by its type. The exit code is 0 if all is right, 5 if something is missing, 3 if something is wrong, and 2
    if FILE cannot be read at all.
    """
    from busflow.recording.bag.bag import Bag
    from busflow.recording.tools.verify import examine

    with Bag(file) as bag, progress("reading", lambda: bag.messages) as step:
        found = examine(bag, step)
        complete = bag.complete
    code = _code(found)
    with outcome_printed():
        if as_json:
            numbers = {"messages": found.messages, "there": found.there, "chunks": found.chunks}
            answer = {"path": str(file), "ok": code is ExitCode.OK, "complete": complete, **numbers}
            print_answer({**answer, "findings": [asdict(each) for each in found.findings]})
        else:
            _print(file, found, code)
    return code


def _print(file: Path, found: Examination, code: ExitCode) -> None:
    for each in found.findings:
        where = f"{each.file} at byte {each.offset}: " if each.offset is not None else ""
        print_message(f"{'error' if each.kind == 'wrong' else 'warning'}: {where}{each.message}", error_stream=False)
    verdict = {ExitCode.OK: "all is right", ExitCode.INCOMPLETE: "INCOMPLETE"}.get(code, "NOT RIGHT")
    read = counted(found.messages, "message was", "messages were")
    if found.there > found.messages:
        read = f"{found.messages} of {counted(found.there, 'message')}, those before the damage, were"
    click.echo(f"{file}: {verdict}: {read} read")


def _code(found: Examination) -> ExitCode:
    kinds = {each.kind for each in found.findings}
    if "wrong" in kinds:
        return ExitCode.DIFFERENT
    return ExitCode.INCOMPLETE if kinds else ExitCode.OK
