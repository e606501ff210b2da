"""`Problems`: collects the problems of a launch file with their places, up to a limit."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

from busflow.errors import Fault, InvalidParameter, KeyPath, LaunchError, Place, Problem, Severity
from busflow.launchfile.model.description import NodeSpec
from busflow.launchfile.yaml.scalar import plain_scalar
from busflow.launchfile.yaml.value import Origin, StatedBy, Value
from busflow.validation.faults import QUOTE_IT, same

if TYPE_CHECKING:
    from busflow.log import Logger

MOST = 100


class Problems:
    """Problems of one load. More than `MOST` end the load: more do not help, and a hostile file has thousands."""

    def __init__(self) -> None:
        self._found: list[Problem] = []
        self.left_out: set[KeyPath] = set()
        """Keys of the launch file whose right values are unknown because of these problems."""

    def __bool__(self) -> bool:
        return bool(self._found)

    def add(self, *problems: Problem, left_out: Iterable[KeyPath] = ((),)) -> None:
        """Keep problems, each one once.

        Args:
            problems: The problems found.
            left_out: The keys that are unknown because of them; by default any key.

        Raises:
            LaunchError: There are too many.
        """
        self._found += [each for each in dict.fromkeys(problems) if each not in self._found]
        self.left_out.update(left_out if problems else ())
        if len(self._found) > MOST:
            raise LaunchError([])

    @contextmanager
    def collecting(self) -> Generator[None]:
        """Keep problems raised inside the block, and go on after it."""
        try:
            yield
        except LaunchError as error:
            self._found += error.problems
            self.left_out.add(())

    def sorted(self, files: Iterable[str]) -> tuple[Problem, ...]:
        """Return the first `MOST` problems in the order of these files."""
        found = list(in_order(self._found[:MOST], tuple(files)))
        if len(self._found) > MOST:
            found.append(Problem("more-problems", f"there are more than {MOST} problems", "begin with these"))
        return tuple(found)


def in_order(problems: Iterable[Problem], files: Sequence[str]) -> list[Problem]:
    """Sort problems by file, in this order, and by line; of those that say the same about one place, keep the first.

    Problems outside of files, such as the command line's, come first in their order. Those in the code of nodes come
    last, unless a launch file names the node. Warnings are left out beside a repeated key, from which they may follow.
    """

    def position(problem: Problem) -> tuple[int, int, int]:
        places = [each for each in (problem.place, *problem.included_from) if each is not None]
        for place in places:
            if place.file in files:
                return files.index(place.file), place.line, place.column
        if places and places[0].file.endswith(".py"):
            return len(files), places[0].line, places[0].column
        return -1, 0, 0

    found = list(problems)
    if any(each.code == "duplicate-key" for each in found):
        found = [each for each in found if each.severity is Severity.ERROR]
    first: dict[object, Problem] = {}
    for number, each in enumerate(found):
        first.setdefault((each.place or number, each.severity, each.message, each.fix), each)
    return sorted(first.values(), key=position)


def log_problems(problems: Iterable[Problem], log: Logger, *, embedded: bool) -> None:
    """Log problems that do not prevent a graph from running.

    Args:
        problems: The problems of its plan.
        log: The log to write to.
        embedded: Whether the graph is part of a program, which may publish the missing topics itself.
    """
    for problem in problems:
        quiet = problem.severity is not Severity.WARNING or (embedded and problem.code == "nobody-publishes")
        values = {key: str(at) for key, at in (("at", problem.place), ("fix", problem.fix)) if at}
        (log.debug if quiet else log.warning)(problem.message, **values)


_CODES = {"type": "wrong-type", "range": "out-of-range", "choice": "unknown-choice", "length": "wrong-length"}


_OF_ROS2 = {
    "ros__parameters": "write what is below it directly below parameters:",
    "use_sim_time": "leave it out: all nodes have the run's clock; clock: {mode: follow} follows /clock",
    "qos_overrides": "leave it out: QoS is stated under topics:, as /scan: {qos: {depth: 1}}",
}
"""By name, what to write in place of a parameter that every node of ROS 2 has."""


def parameter_problems(error: InvalidParameter, spec: NodeSpec) -> list[Problem]:
    """Return the faults of a node's parameters, at the places where the launch file states them."""
    faults = [
        replace(each, fix=_OF_ROS2.get(str(each.path[0]), each.fix)) if each.path else each for each in error.faults
    ]
    return problems(faults, spec.parameters, noun="parameter", subject=spec.full_name)


def problems(faults: Iterable[Fault], stated: Value, *, noun: str, subject: str = "") -> list[Problem]:
    """Return each fault as a problem at its value, or at the nearest stated parent.

    Args:
        faults: The faults of `stated.data`.
        stated: The data with its origins.
        noun: The word for one key: "parameter", "key", "argument".
        subject: The owner of the data; begins the message.
    """
    return [_problem(fault, stated, noun, subject) for fault in faults]


def problem_at(code: str, message: str, fix: str | None, origin: Origin, place: Place | None = None) -> Problem:
    """Return a problem at an origin, or at a `place` beside it."""
    return Problem(code, message, fix, place or origin.place, included_from=origin.included_from)


def warning_at(code: str, message: str, fix: str | None, origin: Origin) -> Problem:
    """Return a problem at an origin that does not prevent a run."""
    return replace(problem_at(code, message, fix, origin), severity=Severity.WARNING)


def key_origin(value: Value) -> Origin:
    """Return the origin of a value, with the place of its key."""
    return Origin(value.origin.source, value.key or value.origin.place, value.origin.included_from)


def _problem(fault: Fault, stated: Value, noun: str, subject: str) -> Problem:
    found = stated.nearest(fault.path)
    at_key = fault.code == "unknown" or isinstance(found.content, dict)
    code = _CODES.get(fault.code, f"{fault.code}-{noun}")
    message = f"{subject}: {fault.message}" if subject else fault.message
    if found.origin.through is not None and _is_at(found, stated, fault.path):
        message += f", from {found.origin.through}"
    fix = quoted_as_written(fault.fix, found)
    return problem_at(code, message, fix, found.origin, found.key if at_key else None)


def quoted_as_written(fix: str | None, value: Value) -> str | None:
    """Return the fix; where it says to quote a value, with the text as it is written: `"0483"`, not `"483"`."""
    place = value.origin.place
    if fix is None or not fix.startswith(QUOTE_IT) or place is None:
        return fix
    text = place.excerpt[place.column - 1 :][: place.width].strip()
    try:
        is_value = same(plain_scalar(text), value.content)
    except ValueError:
        return fix
    # A shell takes one pair of quotes away; the quotes of a list on the command line are within another pair.
    is_word = value.origin.source is StatedBy.COMMAND_LINE and place.column - 1 + place.width == len(place.excerpt)
    quoted = f"'\"{text}\"'" if is_word else f'"{text}"'
    return QUOTE_IT + quoted if is_value else fix


def _is_at(found: Value, stated: Value, path: KeyPath) -> bool:
    return stated.find(path) is found
