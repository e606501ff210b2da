"""`busflow check`: everything that would go wrong, in one report, without running anything."""

from __future__ import annotations

import click

from busflow.cli.launching import Given, launch_file
from busflow.errors import ExitCode, Problem, Severity

_EXAMPLES = """\b
Examples:
  busflow check configs/lab1.yaml
  busflow check configs/lab1.yaml rate_hz:=50 --strict --json"""


@click.command(epilog=_EXAMPLES)
@launch_file()
@click.option("--strict", is_flag=True, help="A subscription whose topic nobody publishes is an error.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.option("-v", "--verbose", is_flag=True, help="Tell of publishers that nobody hears, too.")
def check(given: Given, strict: bool, as_json: bool, verbose: bool) -> int:
    """Find everything wrong with FILE and its nodes, without running them; exit code 3 if something is."""
    from busflow.cli.output import print_json, print_problems

    found = _problems(given, strict=strict)
    failed = any(each.severity is Severity.ERROR for each in found)
    told = [each for each in found if verbose or each.severity is not Severity.INFO]
    if as_json:
        print_json({"file": str(given.file), "ok": not failed, "problems": [each.as_json() for each in told]})
    else:
        print_problems(told)
        click.echo(_count(told))
    return ExitCode.DIFFERENT if failed else ExitCode.OK


def _problems(given: Given, *, strict: bool) -> list[Problem]:
    """What is wrong with the file, and with the nodes of what is right in it."""
    from busflow.ingredients import is_simulated
    from busflow.launchfile.placement import placed
    from busflow.runner import Graph
    from busflow.testing.expectations import expectation_problems

    description, problems = given.examine()
    found = list(problems)
    if description is not None:
        plan = Graph([description], strict=strict).plan()
        found += [*plan.problems, *expectation_problems(description, plan.members)]
        placement = placed(description)
        if (placement.others or placement.elsewhere) and not is_simulated(description):
            from busflow.processes.crossing import crossing_problems

            found += crossing_problems(plan, placement)
    return found


def _count(problems: list[Problem]) -> str:
    if not problems:
        return "no problems"
    counts = ((sum(each.severity is kind for each in problems), kind) for kind in Severity)
    return ", ".join(f"{number} {kind}{'s' * (number > 1)}" for number, kind in counts if number)
