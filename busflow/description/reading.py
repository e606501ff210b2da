"""Reading: one file while it is read, with its numbers, and its problems at their places."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite

from busflow.description.xml_file import Element, XmlFile
from busflow.errors import LaunchError, Problem, Severity
from busflow.text import quoted

MOST_PROBLEMS = 100
_COUNTS = {1: "a number", 3: "three numbers", 4: "four numbers"}


class Reading:
    """A file, what is wrong with it, and what is only doubtful."""

    def __init__(self, file: XmlFile) -> None:
        self.file: XmlFile = file
        self.problems: list[Problem] = []
        self._doubts: dict[tuple[str, str], list[Problem]] = {}

    @property
    def doubts(self) -> tuple[Problem, ...]:
        """The warnings, one for all places of a kind."""
        return tuple(
            replace(first, message=f"{first.message} ({len(others)} more like this)") if others else first
            for first, *others in self._doubts.values()
        )

    def report(self, code: str, message: str, fix: str | None, element: Element, attribute: str | None = None) -> None:
        """Add a mistake.

        Raises:
            LaunchError: With all mistakes, once there are too many.
        """
        problem = Problem(code, message, fix, self.file.place(element, attribute))
        if problem not in self.problems:
            self.problems.append(problem)
        if len(self.problems) == MOST_PROBLEMS:  # more do not help, and a hostile file has thousands
            raise LaunchError(self.problems)

    def doubt(self, code: str, message: str, fix: str | None, element: Element, attribute: str | None = None) -> None:
        """Add a warning; others with its code and message are counted."""
        place = self.file.place(element, attribute)
        self._doubts.setdefault((code, message), []).append(Problem(code, message, fix, place, Severity.WARNING))

    def numbers(self, element: Element, attribute: str, default: str) -> tuple[float, ...] | None:
        """Return as many finite numbers as the default has; report an attribute that states no such numbers."""
        texts, count = element.attributes.get(attribute, default).split(), len(default.split())
        values = [self._finite(element, attribute, each) for each in texts]
        if len(values) != count:
            message = f"{attribute} is {_COUNTS[count]}, and here are {len(values)}"
            self.report("bad-number", message, f'write {attribute}="{default}"', element, attribute)
        found = tuple(each for each in values if each is not None)
        return found if len(found) == len(values) == count else None

    def number(self, element: Element, attribute: str, default: float = 0.0) -> float:
        """Return a finite number; report any other text."""
        stated = element.attributes.get(attribute)
        return default if stated is None else self._finite(element, attribute, stated) or 0.0

    def _finite(self, element: Element, attribute: str, text: str) -> float | None:
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if isfinite(value) and "_" not in text and text.isascii():
            return value
        fix = "xacro's ${…} is expanded first: xacro robot.xacro > robot.urdf" if "${" in text else None
        self.report("bad-number", f"{quoted(text)} is not a finite number", fix, element, attribute)
        return None
