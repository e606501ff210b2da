"""`busflow bag convert`: writes a recording in another format: for ROS 2, as tables, or for a script."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from busflow.cli.bag.signal_handling import unwound_by_signals
from busflow.cli.options.bag import listed, named, print_damage, reads, stretch, within
from busflow.cli.terminal.output import line_of, print_answer, print_message
from busflow.cli.terminal.progress import progress
from busflow.text import counted

_FORMS = ("ros2bag", "csv", "parquet", "jsonl", "mcap")
_SUFFIXES = {".mcap": "mcap", ".jsonl": "jsonl"}
_EXAMPLES = """\b
Examples:
  busflow bag convert run.mcap run_bag --to ros2bag
  busflow bag convert run.mcap tables --to csv --topics joint_states
  busflow bag convert run.mcap run.jsonl --to jsonl --start 10s --end 20s
  busflow bag convert run.mcap - --to jsonl | jq .message
  busflow bag convert old_bag new.mcap"""


@click.command(epilog=_EXAMPLES)
@reads("in_")
@click.argument("out", type=click.Path(path_type=Path))
@click.option("--to", type=click.Choice(_FORMS), help="The format of OUT; its suffix .mcap or .jsonl states it too.")
@click.option("--topics", callback=listed, metavar="NAMES", help="Only these topics, separated by commas.")
@within
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def convert(
    in_: Path, out: Path, to: str | None, topics: list[str], start_s: float | None, end_s: float | None, as_json: bool
) -> int:
    """Write the recording IN as OUT, which must not exist.

    ros2bag is a directory that ros2 bag reads; csv and parquet are a directory with a table for each topic; jsonl is a
    file with a line for each message; mcap is a file for any reader of MCAP, also of a bag that was split or is a
    database. The exit code is 5 if IN could not be read to its end. With - for OUT, jsonl goes to standard output.
    """
    to = to or _SUFFIXES.get(out.suffix)
    if to is None:
        raise click.UsageError(f"the suffix of OUT, {out.name}, says no format: add --to, one of {', '.join(_FORMS)}")
    to_stdout = str(out) == "-"
    if to_stdout and (to != "jsonl" or as_json):
        raise click.UsageError("only --to jsonl can be written to standard output, without --json")
    from busflow.recording.bag.bag import Bag
    from busflow.recording.tools.convert import TargetFormat
    from busflow.recording.tools.convert import convert as converted

    with unwound_by_signals(), Bag(in_) as bag, progress("converting", lambda: bag.messages) as step:
        channels = named(topics, bag) if topics else None
        times = stretch(bag, start_s, end_s)
        done = converted(
            bag,
            sys.stdout if to_stdout else out,
            TargetFormat(to),
            line_of,
            channels=channels,
            times=times,
            on_message=step,
        )
        for fault in done.faults.values():
            print_message(f"warning: left out: {fault}")
        code = print_damage(bag)
    if as_json:
        print_answer({"output": str(out), "to": to, "messages": done.messages, "left_out": done.left_out})
        return code
    left_out = f", {done.left_out} could not be read" if done.left_out else ""
    written = counted(done.messages, "message")
    print_message(f"{'standard output' if to_stdout else out}: {written}{left_out}", error_stream=to_stdout)
    return code
