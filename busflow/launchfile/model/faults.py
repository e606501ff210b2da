"""From a fault of plain data to a `Problem` at the place of the file, or of the command line, that states it."""

from __future__ import annotations

from collections.abc import Iterable

from busflow.errors import Fault, InvalidParameter, KeyPath, Place, Problem
from busflow.launchfile.model.description import NodeSpec
from busflow.launchfile.yaml.value import Origin, Value

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
