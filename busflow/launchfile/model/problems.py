"""`Problems`: what is wrong with a launch file, each at its place, collected up to a number that still helps."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from busflow.errors import Fault, InvalidParameter, KeyPath, LaunchError, Place, Problem, Severity
from busflow.launchfile.model.description import NodeSpec
from busflow.launchfile.yaml.value import Origin, Value

if TYPE_CHECKING:
    from structlog.typing import FilteringBoundLogger

MOST = 100


class Problems:
    """The problems of one load. One too many ends it: nobody reads more, and a hostile file has thousands."""

    def __init__(self) -> None:
        self._found: list[Problem] = []
        self.left_out: set[KeyPath] = set()
        """The keys of a launch file of which nobody knows, because of these problems, what they should be."""

    def __bool__(self) -> bool:
        return bool(self._found)

    def add(self, *problems: Problem, left_out: Iterable[KeyPath] = ((),)) -> None:
        """Keep problems, each one once.

        Args:
            problems: Those that were found.
            left_out: The keys that are not known because of them; unless said, any.

        Raises:
            LaunchError: There are too many.
        """
        self._found += [each for each in dict.fromkeys(problems) if each not in self._found]
        self.left_out.update(left_out if problems else ())
        if len(self._found) > MOST:
            raise LaunchError([])

    @contextmanager
    def collecting(self) -> Generator[None]:
        """Keep the problems that are raised inside, and go on after it."""
        try:
            yield
        except LaunchError as error:
            self._found += error.problems
            self.left_out.add(())

    def sorted(self, files: Iterable[str]) -> tuple[Problem, ...]:
        """The problems in the order of these files, up to a number that still helps."""
        found = list(in_order(self._found[:MOST], tuple(files)))
        if len(self._found) > MOST:
            found.append(Problem("more-problems", f"there are more than {MOST} problems", "begin with these"))
        return tuple(found)


def in_order(problems: Iterable[Problem], files: Sequence[str]) -> list[Problem]:
    """Problems by file, in this order, and line, each once.

    Those of no file, as of the command line, come first and as they are; those in nodes' code come last, unless a
    launch file names the node.
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
    return sorted((each for n, each in enumerate(found) if each.place is None or each not in found[:n]), key=position)


def log_problems(problems: Iterable[Problem], log: FilteringBoundLogger, *, embedded: bool) -> None:
    """Log what does not keep a graph from running.

    Args:
        problems: Those of its plan.
        log: Where to.
        embedded: Whether a program is around the graph: it may publish yet what no node does.
    """
    for problem in problems:
        quiet = problem.severity is not Severity.WARNING or (embedded and problem.code == "nobody-publishes")
        values = {key: str(at) for key, at in (("at", problem.place), ("fix", problem.fix)) if at}
        (log.debug if quiet else log.warning)(problem.message, **values)


_CODES = {"type": "wrong-type", "range": "out-of-range", "choice": "unknown-choice", "length": "wrong-length"}


def parameter_problems(error: InvalidParameter, spec: NodeSpec) -> list[Problem]:
    """The faults of a node's parameters, where its launch file states them."""
    return problems(error.faults, spec.parameters, noun="parameter", subject=spec.full_name)


def problems(faults: Iterable[Fault], stated: Value, *, noun: str, subject: str = "") -> list[Problem]:
    """Each fault at its value, or at the nearest parent that is stated.

    Args:
        faults: What is wrong with `stated.data`.
        stated: The data with its origins.
        noun: What one key is called: "parameter", "key", "argument".
        subject: What the data belongs to; begins the message.
    """
    return [_problem(fault, stated, noun, subject) for fault in faults]


def problem_at(code: str, message: str, fix: str | None, origin: Origin, place: Place | None = None) -> Problem:
    """A problem at an origin, or at a `place` beside it."""
    return Problem(code, message, fix, place or origin.place, included_from=origin.included_from)


def key_origin(value: Value) -> Origin:
    """The origin of a value, pointing at its key."""
    return Origin(value.origin.source, value.key or value.origin.place, value.origin.included_from)


def _problem(fault: Fault, stated: Value, noun: str, subject: str) -> Problem:
    found = stated.nearest(fault.path)
    at_key = fault.code == "unknown" or isinstance(found.content, dict)
    code = _CODES.get(fault.code, f"{fault.code}-{noun}")
    message = f"{subject}: {fault.message}" if subject else fault.message
    if found.origin.through is not None and _is_at(found, stated, fault.path):
        message += f", from {found.origin.through}"
    return problem_at(code, message, fault.fix, found.origin, found.key if at_key else None)


def _is_at(found: Value, stated: Value, path: KeyPath) -> bool:
    return stated.find(path) is found
