"""`busflow tf monitor`: measures the transforms of a run or a recording: how often, how late, and from which node."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from busflow.cli.options.launch_file import DURATION
from busflow.cli.terminal.output import print_answer, print_problems
from busflow.cli.terminal.table import Column, print_table
from busflow.cli.tf.source import gathered, of_run_or_bag
from busflow.errors import ExitCode
from busflow.frames.seen import SeenFrames, shown_publishers

_EXAMPLES = """\b
Examples:
  busflow tf monitor
  busflow tf monitor --for 10s --json
  busflow tf monitor --bag run.mcap"""
_COLUMNS = ("frame", "parent", "transforms", "rate", "delay", "longest", "published by")


@click.command(epilog=_EXAMPLES)
@of_run_or_bag
@click.option("--for", "for_s", type=DURATION, default="2s", show_default=True, help="How long to listen to a run.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def monitor(run: str | None, bag: Path | None, for_s: float, as_json: bool) -> int:
    """Show of each frame how often its transform comes, how long after its stamp, and which node publishes it.

    What is wrong with the frames follows, and the exit code is then 3.
    """
    seen = gathered(run, bag, for_s)
    problems, rows = seen.problems(), _rows(seen)
    if as_json:
        print_answer({"frames": rows, "problems": [each.as_json() for each in problems]})
    else:
        print_table([_COLUMNS, *(_line(row) for row in rows)], *(Column() for _ in _COLUMNS))
        print_problems(problems)
    return ExitCode.DIFFERENT if problems else ExitCode.OK


def _rows(seen: SeenFrames) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    for child, edge in sorted(seen.tree.edges.items()):
        account = seen.edges[child]
        moves = edge.fixed is None
        rows.append(
            {
                "frame": child,
                "parent": edge.parent,
                "transforms": account.count,
                "rate_hz": edge.rate_hz,
                "delay_s": account.delay_ns / account.count / 1e9 if moves else None,
                "longest_s": account.longest_ns / 1e9 if moves else None,
                "publishers": list(account.publishers),
                "one_of": account.one_of,
            }
        )
    return rows


def _line(row: dict[str, Any]) -> tuple[str, ...]:
    rate = row["rate_hz"]
    delays = ("" if row[key] is None else f"{row[key] * 1000:.1f} ms" for key in ("delay_s", "longest_s"))
    how_often = "fixed" if row["delay_s"] is None else "" if rate is None else f"{rate:.1f} Hz"
    names = shown_publishers(row["publishers"], one_of=row["one_of"])
    return (row["frame"], row["parent"], str(row["transforms"]), how_often, *delays, names)
