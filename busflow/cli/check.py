"""`busflow check`: reports every problem of a launch file and its nodes, without running them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from busflow.cli.options.launch_file import LaunchSource, launch_file, refuse_other_kinds
from busflow.cli.options.lazy_group import importing
from busflow.errors import ExitCode, LaunchError, Problem, Severity
from busflow.text import counted, printable

if TYPE_CHECKING:
    from busflow.launchfile.model.description import LaunchDescription

_YAML = re.compile(r"\.ya?ml$")
_EXAMPLES = """\b
Examples:
  busflow check configs/lab1.yaml
  busflow check configs/lab1.yaml rate_hz:=50 --strict --json
  busflow check configs/*.yaml
  busflow check configs/lab1_machines.yaml --machine arm"""


@click.command(epilog=_EXAMPLES)
@launch_file(rest="[FILE | NAME:=VALUE]...")
@click.option("--machine", metavar="NAME", help="Check it as this machine of the file would run it.")
@click.option("--strict", is_flag=True, help="Make unmatched ends and doubts about robots errors.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.option("-v", "--verbose", is_flag=True, help="Also list unmatched publishers.")
def check(source: LaunchSource, machine: str | None, strict: bool, as_json: bool, verbose: bool) -> int:
    """Find everything wrong with FILE and its nodes, without running them; exit code 3 if something is wrong.

    Several files are checked one by one; NAME:=VALUE goes to each file that has such an argument.
    """
    from busflow.cli.terminal.output import outcome_printed, print_answer, print_problems

    files = _files(source)
    reports: list[dict[str, object]] = []
    failed = False
    for each in files:
        with click.Context(click.get_current_context().command):  # the variables that a file sets are restored after it
            found = _problems(each, machine, strict=strict)
        is_wrong = any(problem.severity is Severity.ERROR for problem in found)
        failed = failed or is_wrong
        shown = [problem for problem in found if verbose or problem.severity is not Severity.INFO]
        reports.append(
            {"file": str(each.file), "ok": not is_wrong, "problems": [problem.as_json() for problem in shown]}
        )
        if not as_json:
            with outcome_printed():
                print_problems(shown)
                click.echo(f"{printable(each.file)}: {_count(shown)}" if len(files) > 1 else _count(shown))
    if as_json:
        with outcome_printed():
            print_answer({"ok": not failed, "files": reports} if len(files) > 1 else reports[0])
    return ExitCode.DIFFERENT if failed else ExitCode.OK


def _files(source: LaunchSource) -> list[LaunchSource]:
    """Return each file with the assignments that it declares; the first one also gets those that no file declares."""
    more = [each for each in source.assignments if ":=" not in each and (_YAML.search(each) or Path(each).is_file())]
    if not more:
        return [source]
    assignments = [each for each in source.assignments if each not in more]
    files = [source.file, *map(Path, more)]
    for file in files:
        refuse_other_kinds(file)
    declared = [_declared(file) for file in files]
    known = set[str]().union(*(names for names in declared if names is not None))
    of_each = [[each for each in assignments if _name(each) in (names or ())] for names in declared]
    if None not in declared:  # a file that cannot be read may declare it
        of_each[0] += [each for each in assignments if _name(each) not in known]
    return [replace(source, file=file, assignments=tuple(own)) for file, own in zip(files, of_each, strict=True)]


def _name(assignment: str) -> str:
    return assignment.partition(":=")[0]


def _declared(file: Path) -> set[str] | None:
    """Return the arguments that a file declares; None if it cannot be read, which the file's own report says."""
    from busflow.launchfile.yaml.document import read_file

    try:
        return set(read_file(file, str(file)).section("args"))
    except LaunchError:
        return None


def _problems(source: LaunchSource, machine: str | None, *, strict: bool) -> list[Problem]:
    """Return the problems of the file, of the nodes in its valid part, and of what a run needs besides."""
    with importing():
        from busflow.launchfile.model.placement import placed
        from busflow.launchfile.model.problems import in_order
        from busflow.runner.assembly import Given, Kind, Run
        from busflow.runner.graph import is_simulated
        from busflow.testing.expectations import expectation_problems

    description, problems = source.examine()
    found = list(problems)
    if description is not None:
        if not is_simulated(description):
            description, about_machines = _as_seen(description, machine)
            found += about_machines
        plan = Run([description], Kind.PLAN, Given(strict=strict)).plan()
        if description.interfaces:
            from busflow.runner.planning.definitions import definition_problems

            found += definition_problems(description, plan.nodes)
        found += [*plan.problems, *(expectation_problems(description, plan.nodes) if plan.is_whole else ())]
        placement = placed(description)
        if (placement.others or placement.elsewhere) and not is_simulated(description):
            from busflow.processes.crossing import crossing_problems

            found += crossing_problems(plan, placement)
        found += _about_recording(description, apart=bool(placement.others or placement.elsewhere))
        found = in_order(found, [str(each) for each in description.files])
    return found


def _as_seen(description: LaunchDescription, machine: str | None) -> tuple[LaunchDescription, list[Problem]]:
    """Return the description as a machine runs it, and the problems of the machines' credentials.

    Without a machine, the whole graph is checked as one, with the credentials of every machine. A credential file that
    is missing here is only a warning, as it may be on its own machine.
    """
    from busflow.clock import SystemClock
    from busflow.launchfile.model.placement import MAIN
    from busflow.runner.planning.credentials import credential_problems
    from busflow.runner.planning.machine import on_machine

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
        problems = list(credential_problems(network, name, SystemClock().now()))
        missing = [replace(each, severity=Severity.WARNING) for each in problems if each.code == "missing-file"]
        found += missing[:1] if name == MAIN else []
        found += [each for each in problems if each.code != "missing-file"]
    return description, found


def _about_recording(description: LaunchDescription, *, apart: bool) -> Iterator[Problem]:
    """Yield a problem if the recording that the file asks for could not be written now."""
    from busflow.errors import RecordingRefused
    from busflow.launchfile.model.problems import problem_at
    from busflow.recording.recorder.destination import foresee, foresee_snapshots
    from busflow.runner.graph import is_simulated

    whole = description.resolved
    if description.record is None or whole is None:
        return
    several = description.record.split is not None or (apart and not is_simulated(description))
    stated = whole.find(("record", "to")) or whole.find(("record",)) or whole
    try:
        if description.record.snapshot is None:
            foresee(description.record.to, run=description.name, apart=several)
        else:
            foresee_snapshots(description.record.to, run=description.name)
    except RecordingRefused as error:
        yield problem_at("cannot-record", str(error), None, stated.origin)


def _count(problems: list[Problem]) -> str:
    if not problems:
        return "no problems"
    counts = ((sum(each.severity is kind for each in problems), kind) for kind in Severity)
    return ", ".join(counted(number, kind) for number, kind in counts if number)
