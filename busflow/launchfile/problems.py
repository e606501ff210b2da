"""`Problems`: what is wrong with a launch file, collected up to a number that still helps."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from contextlib import contextmanager
from typing import TYPE_CHECKING

from busflow.errors import LaunchError, Problem, Severity

if TYPE_CHECKING:
    from structlog.typing import FilteringBoundLogger

MOST = 100


class Problems:
    """The problems of one load. One too many ends it: nobody reads more, and a hostile file has thousands."""

    def __init__(self) -> None:
        self._found: list[Problem] = []

    def __bool__(self) -> bool:
        return bool(self._found)

    def add(self, *problems: Problem) -> None:
        """Keep problems, each one once.

        Raises:
            LaunchError: There are too many.
        """
        self._found += [each for each in dict.fromkeys(problems) if each not in self._found]
        if len(self._found) > MOST:
            raise LaunchError([])

    @contextmanager
    def collecting(self) -> Generator[None]:
        """Keep the problems that are raised inside, and go on after it."""
        try:
            yield
        except LaunchError as error:
            self._found += error.problems

    def sorted(self, files: Iterable[str]) -> tuple[Problem, ...]:
        """The problems by file, in this order, and line; those of no file first."""
        order = {file: index for index, file in enumerate(files)}

        def position(problem: Problem) -> tuple[int, int, int]:
            place = problem.place
            return (order.get(place.file, -1), place.line, place.column) if place else (-1, 0, 0)

        found = sorted(self._found[:MOST], key=position)
        if len(self._found) > MOST:
            found.append(Problem("more-problems", f"there are more than {MOST} problems", "begin with these"))
        return tuple(found)


def tell(problems: Iterable[Problem], log: FilteringBoundLogger, *, embedded: bool) -> None:
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
