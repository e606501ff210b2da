"""`busflow check`: everything that would go wrong, in one report, without running anything."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from busflow.cli.importing import importing
from busflow.cli.launching import Given, launch_file
from busflow.errors import ExitCode, LaunchError, Problem, Severity

if TYPE_CHECKING:
    from busflow.launchfile.description import LaunchDescription

_EXAMPLES = """\b
Examples:
  busflow check configs/lab1.yaml
  busflow check configs/lab1.yaml rate_hz:=50 --strict --json
  busflow check configs/lab1_machines.yaml --machine arm"""


@click.command(epilog=_EXAMPLES)
@launch_file()
@click.option("--machine", metavar="NAME", help="Look at it as this machine of the file would run it.")
@click.option("--strict", is_flag=True, help="A subscription whose topic nobody publishes is an error.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.option("-v", "--verbose", is_flag=True, help="Tell of publishers that nobody hears, too.")
def check(given: Given, machine: str | None, strict: bool, as_json: bool, verbose: bool) -> int:
    """Find everything wrong with FILE and its nodes, without running them; exit code 3 if something is."""
    from busflow.cli.output import print_json, print_problems

    found = _problems(given, machine, strict=strict)
    failed = any(each.severity is Severity.ERROR for each in found)
    told = [each for each in found if verbose or each.severity is not Severity.INFO]
    if as_json:
        print_json({"file": str(given.file), "ok": not failed, "problems": [each.as_json() for each in told]})
    else:
        print_problems(told)
        click.echo(_count(told))
    return ExitCode.DIFFERENT if failed else ExitCode.OK


def _problems(given: Given, machine: str | None, *, strict: bool) -> list[Problem]:
    """What is wrong with the file, with the nodes of what is right in it, and with what a run of it needs beside."""
    with importing():
        from busflow.ingredients import is_simulated
        from busflow.launchfile.placement import placed
        from busflow.launchfile.problems import in_order
        from busflow.runner import Graph
        from busflow.testing.expectations import expectation_problems

    description, problems = given.examine()
    found = list(problems)
    if description is not None:
        if not is_simulated(description):
            description, about_machines = _as_seen(description, machine)
            found += about_machines
        plan = Graph([description], strict=strict).plan()
        found += [*plan.problems, *(expectation_problems(description, plan.members) if plan.is_whole else ())]
        placement = placed(description)
        if (placement.others or placement.elsewhere) and not is_simulated(description):
            from busflow.processes.crossing import crossing_problems

            found += crossing_problems(plan, placement)
        found += _about_recording(description, apart=bool(placement.others or placement.elsewhere))
        found = in_order(found, [str(each) for each in description.files])
    return found


def _as_seen(description: LaunchDescription, machine: str | None) -> tuple[LaunchDescription, list[Problem]]:
    """The description as a machine runs it, and what is wrong with what its machines show each other.

    Where it is not said which machine this is, all of the graph is looked at as one, and of every machine what is here:
    what is not may be where it belongs.
    """
    from busflow.clock import SystemClock
    from busflow.launchfile.credentials import credential_problems
    from busflow.launchfile.here import on_machine
    from busflow.launchfile.placement import MAIN

    if machine is not None:
        try:
            return on_machine(description, machine, together=False), []
        except LaunchError as error:
            return description, list(error.problems)
    network = description.network
    if network is None:
        return description, []
    found: list[Problem] = []
    for name in network.machines:
        told = list(credential_problems(network, name, SystemClock().now()))
        missing = [replace(each, severity=Severity.WARNING) for each in told if each.code == "missing-file"]
        found += missing[:1] if name == MAIN else []
        found += [each for each in told if each.code != "missing-file"]
    return description, found


def _about_recording(description: LaunchDescription, *, apart: bool) -> Iterator[Problem]:
    """Whether what the file says to record could be, as things are now."""
    from busflow.errors import RecordingRefused
    from busflow.ingredients import is_simulated
    from busflow.launchfile.faults import problem_at
    from busflow.recording.destination import foresee

    whole = description.resolved
    if description.record is None or whole is None:
        return
    stated = whole.find(("record", "to")) or whole.find(("record",)) or whole
    try:
        foresee(description.record.to, run=description.name, apart=apart and not is_simulated(description))
    except RecordingRefused as error:
        yield problem_at("cannot-record", str(error), None, stated.origin)


def _count(problems: list[Problem]) -> str:
    if not problems:
        return "no problems"
    counts = ((sum(each.severity is kind for each in problems), kind) for kind in Severity)
    return ", ".join(f"{number} {kind}{'s' * (number > 1)}" for number, kind in counts if number)
