"""What every command that reads a launch file takes: the file, `name:=value` arguments and `--set`."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from busflow.duration import parse_duration
from busflow.errors import LaunchError

if TYPE_CHECKING:
    from busflow.launchfile.description import LaunchDescription
    from busflow.launchfile.preflight import Plan

_NUMBER = re.compile(r"[0-9]{1,20}(\.[0-9]{0,20})?")


@dataclass(frozen=True, slots=True)
class Given:
    """A launch file and what the command line says over it."""

    file: Path
    assignments: tuple[str, ...]
    sets: tuple[str, ...]

    def description(self) -> LaunchDescription:
        """What the file describes.

        Raises:
            LaunchError: With every problem.
        """
        from busflow.launchfile.load import load

        return load(self.file, assignments=self.assignments, sets=self.sets)

    def plan(self) -> tuple[LaunchDescription, Plan]:
        """What the file describes, and its nodes, built and checked.

        Raises:
            LaunchError: With every problem.
        """
        from busflow.runner import Graph

        description = self.description()
        plan = Graph([description]).plan()
        if plan.errors:
            raise LaunchError(plan.errors)
        return description, plan


def launch_file(*, required: bool = True) -> Callable[[Callable[..., int]], Callable[..., int]]:
    """Adds FILE, ARGS and `--set` to a command, which gets them as `file`, `assignments` and `sets`."""

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        for parameter in (
            click.option(
                "--set",
                "sets",
                multiple=True,
                metavar="PATH=VALUE",
                help="Change one value, by its path: nodes.sensor_publisher.parameters.noise.imu=0.5.",
            ),
            click.argument("assignments", nargs=-1, metavar="[NAME:=VALUE]..."),
            click.argument("file", required=required, metavar="FILE", type=click.Path(path_type=Path)),
        ):
            command = parameter(command)
        return command

    return decorate


def duration(ctx: click.Context, param: click.Parameter, given: str | None) -> float | None:
    """The callback of an option that takes `5s`, `50ms`, `10min`, or a plain number of seconds."""
    if given is None:
        return None
    try:
        return parse_duration(float(given) if _NUMBER.fullmatch(given) else given)
    except ValueError as error:
        raise click.BadParameter(str(error), ctx, param) from None


def duration_or_off(ctx: click.Context, param: click.Parameter, given: str | None) -> float | None:
    """As `duration`, or the word `off`."""
    return None if given == "off" else duration(ctx, param, given)
