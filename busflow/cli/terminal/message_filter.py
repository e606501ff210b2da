"""Filter: a condition on messages, which `--filter` states in the expression language.

    linear_acceleration.z > 9.5 and not header.frame_id == 'imu_link'
    len(m.name) > 2 and -1.5 < m.position[0] + m.position[1] < 1.5

A name is a field, whose path may begin with `m.`, or `m` itself, the whole message. The filter is false for a message
that lacks a field or item. Division follows IEEE 754: by zero it is infinite, or not a number.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, TypeAlias

from busflow.cli.terminal.field_paths import STEP, Shape, check_path, value_at
from busflow.errors import InvalidInput, KeyPath, Place, Problem
from busflow.launchfile.load.language import Dialect, Evaluate, InvalidExpression, parse
from busflow.text import printable

OPTION = "--filter"

Filter: TypeAlias = Callable[[Any], bool]

_NAMES = r"(?a:[A-Za-z_]\w*(?:\s*\.\s*[A-Za-z_]\w*|\s*\[\s*-?[0-9]{1,9}\s*\])*)"


def parse_filter(text: str, shape: Shape | None = None) -> Filter:
    """Parse a filter.

    >>> wanted = parse_filter("m.data > 0.5 and abs(m.data) < 2")
    >>> wanted({"data": 1.0}), wanted({"data": -1.0})
    (True, False)

    Args:
        text: The filter.
        shape: The shape of the messages, if it is known: then a missing field is an error at once.

    Raises:
        InvalidInput: It is not a filter; a caret shows where. The filter itself raises it for a message whose values
            do not fit an operation.
    """
    paths: list[tuple[KeyPath, list[int]]] = []

    def resolve(name: str, start: int) -> Evaluate:
        path, starts = _path(name, start, shape)
        paths.append((path, starts))
        return lambda message: value_at(path, message)

    try:
        wanted = parse(text, Dialect(_NAMES, resolve, _number, _shown, calculates=True))
    except InvalidExpression as error:
        raise _invalid(text, error) from None
    for path, starts in paths:
        check_path(path, starts, OPTION, text, shape)

    def matches(message: Any) -> bool:
        try:
            value = wanted.evaluate(message)
        except InvalidExpression as error:
            raise _invalid(text, error) from None
        except LookupError:
            return False
        if not isinstance(value, bool):
            what = f"a filter needs true or false, got {_shown(value)}"
            raise _invalid(text, InvalidExpression(what, "compare it with something", 0, len(text)))
        return value

    return matches


def _path(name: str, start: int, shape: Shape | None) -> tuple[KeyPath, list[int]]:
    """Return the path in a name, and where each of its steps begins."""
    steps = [(each["name"] or int(each["index"]), start + each.start()) for each in STEP.finditer(name)]
    fields = shape.fields if shape is not None and not shape.is_sequence else None
    if steps[0][0] == "m" and "m" not in (fields or ()):
        del steps[0]
    return tuple(step for step, _ in steps), [at for _, at in steps]


def _number(text: str) -> float:
    return float(text) if re.search(r"[.eE]", text) else int(text)


def _invalid(text: str, error: InvalidExpression) -> InvalidInput:
    place = Place(OPTION, 1, error.start + 1, error.width, text)
    return InvalidInput(Problem("filter", error.message, error.fix, place))


def _shown(value: Any) -> str:
    if isinstance(value, memoryview):
        return "a sequence"
    return printable(repr(value), limit=60)
