"""`busflow test`: checks a launch file's expectations on simulated time, with one seed or many."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

import click

from busflow.cli.options.launch_file import DURATION, LaunchSource, launch_file
from busflow.errors import ExitCode, LaunchError
from busflow.text import counted, printable
from busflow.validation.durations import show_duration

if TYPE_CHECKING:
    from busflow.launchfile.model.description import LaunchDescription

_EXAMPLES = """\b
Examples:
  busflow test configs/lab1.yaml
  busflow test configs/lab1.yaml --for 10min --seeds 100
  busflow test configs/lab1.yaml rate_hz:=50 --seed 17 --json"""

DURATION_S = 60.0
"""The length of each run, unless the command line or the file states one."""


@click.command(epilog=_EXAMPLES)
@launch_file()
@click.option("--for", "for_s", type=DURATION, help="How long each run is: 5s, 10min.")
@click.option("--seeds", type=click.IntRange(min=1), help="How many seeds, from 0.  [default: 1]")
@click.option("--seed", type=click.IntRange(min=0), help="This seed alone.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def test(
    source: LaunchSource,
    for_s: float | None,
    seeds: int | None,
    seed: int | None,
    as_json: bool,
) -> int:
    """Run FILE on simulated time and check its `expect:` section; exit code 1 if it does not hold.

    A node that fails is wrong in any case.
    """
    from busflow.cli.terminal.output import outcome_printed, print_answer, print_message, print_problems
    from busflow.cli.terminal.run_summary import snapshot_line
    from busflow.testing.expectations import Trials, expectation_problems, expectations_of

    if seeds is not None and seed is not None:
        raise click.UsageError("--seed and --seeds exclude each other", click.get_current_context())
    description, plan = source.plan()
    if unknown := expectation_problems(description, plan.nodes):
        raise LaunchError(unknown)
    for_s = for_s or expectations_of(description).duration or DURATION_S
    trials = Trials(description, for_s)
    trials.run(range(seeds or 1) if seed is None else [seed])
    found = trials.problems()
    with outcome_printed():
        if as_json:
            result = {"file": str(source.file), "ok": not found, "seeds": trials.seeds, "for_s": for_s}
            snapshots = [asdict(each) for each in trials.snapshots]
            print_answer({**result, "snapshots": snapshots, "problems": [each.as_json() for each in found]})
        else:
            print_problems(found)
            for each in trials.snapshots:
                print_message(snapshot_line(asdict(each)), error_stream=False)
            runs = f"{counted(len(trials.seeds), 'run')} of {show_duration(for_s)}"
            click.echo(f"{printable(description.name)}: {runs}: {_outcome(description, len(found))}")
    return ExitCode.FAILED if found else ExitCode.OK


def _outcome(description: LaunchDescription, wrong: int) -> str:
    if wrong:
        return f"{counted(wrong, 'thing')} wrong"
    return "all that it expects holds" if description.expect else "no node failed; the file has no `expect:` section"
