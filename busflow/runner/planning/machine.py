"""Selects the machine that this process runs on, and checks its credentials."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from busflow.clock import SystemClock
from busflow.errors import LaunchError, Problem, Severity
from busflow.launchfile.model.placement import MAIN
from busflow.runner.planning.credentials import credential_problems
from busflow.text import did_you_mean

if TYPE_CHECKING:
    from busflow.launchfile.model.description import LaunchDescription


def on_machine(description: LaunchDescription, machine: str | None, *, together: bool) -> LaunchDescription:
    """Return the description with `here` set to this machine; unchanged if all of the graph runs here.

    Args:
        description: The description of a launch file.
        machine: The name of this machine; None for the main one.
        together: Whether all of the graph runs here, whatever the file says.

    Raises:
        LaunchError: The machine is unknown, or other machines would refuse its credentials.
    """
    network = description.network
    known = tuple(network.machines) if network is not None else ()
    if machine is not None and machine not in known:
        fix = did_you_mean(machine, known) if known else "leave --machine out: the file names no machines"
        raise LaunchError([Problem("unknown-machine", f"{description.name} has no machine {machine}", fix)])
    if network is None or together:
        if machine is not None:
            text = f"{machine} runs a part of the graph, and all of it is to run here"
            fix = "leave out the machine, or what puts it all into one place"
            raise LaunchError([Problem("other-machine", text, fix)])
        return description
    own = machine or MAIN
    if len(known) == 1 and not network.listens(own):
        return description
    found = list(credential_problems(network, own, SystemClock().now()))
    errors = [problem for problem in found if problem.severity is Severity.ERROR]
    if errors:
        raise LaunchError(errors)
    return replace(description, here=own, warnings=(*description.warnings, *found))
