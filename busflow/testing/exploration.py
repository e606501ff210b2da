"""Exploration: one test under many orders of events, and the choices that matter in a failing order."""

from __future__ import annotations

import functools
import sys
from collections import Counter
from collections.abc import Callable, Coroutine, Mapping
from typing import Any, ParamSpec, overload

from busflow.errors import InvalidDeclaration
from busflow.runner.loops.schedule import Place, Schedule
from busflow.runner.loops.virtual import HORIZON_S, VirtualLoop
from busflow.runner.loops.virtual_test import refuse_plain, run_virtual
from busflow.testing.harnesses import given_seed

P = ParamSpec("P")
Test = Callable[P, Coroutine[Any, Any, object]]

SCHEDULES = 100
"""Default number of orders that a test runs under."""
_ATTEMPTS = 400
"""Most runs that the search for the choices that matter may take."""
_MOST_SHOWN = 5
"""Most choices that are shown."""


@overload
def explore(test: Test[P], /) -> Callable[P, None]: ...
@overload
def explore(*, schedules: int = SCHEDULES, horizon_s: float = HORIZON_S) -> Callable[[Test[P]], Callable[P, None]]: ...
def explore(
    test: Test[P] | None = None, /, *, schedules: int = SCHEDULES, horizon_s: float = HORIZON_S
) -> Callable[P, None] | Callable[[Test[P]], Callable[P, None]]:
    """Run an async test under many orders of events, each on a virtual loop of its own.

    The first order is the plain one, first in, first out. Where an order fails, the error says which one, how to run
    the test under it alone (`BUSFLOW_SEED=…`), and which of its choices matter.

    Args:
        test: The test. It runs once for each order, each time with the same arguments.
        schedules: How many orders.
        horizon_s: Where virtual time ends.

    Raises:
        InvalidDeclaration: fewer than one order.
    """
    if schedules < 1:
        raise InvalidDeclaration(f"explore(schedules={schedules!r}): a test needs one order at least")

    def decorate(test: Test[P]) -> Callable[P, None]:
        refuse_plain(test, "@explore")

        @functools.wraps(test)
        def run(*args: P.args, **kwargs: P.kwargs) -> None:
            def once(schedule: Schedule) -> None:
                loop = VirtualLoop(schedule=schedule, horizon_s=horizon_s)
                run_virtual(test(*args, **kwargs), name=test.__name__, loop=loop)

            _explore(once, schedules)

        return run

    return decorate if test is None else decorate(test)


def _explore(once: Callable[[Schedule], None], schedules: int) -> None:
    asked = given_seed()
    for seed in range(schedules) if asked is None else [asked]:
        schedule = Schedule(seed or None)
        error = _error_of(once, schedule)
        if error is None:
            continue
        if seed == 0:
            error.add_note("under the plain order, first in, first out; other orders were not looked at")
            raise error
        error.add_note(f"under order {seed} of {schedules}; BUSFLOW_SEED={seed} runs the test under it alone")
        for line in _what_matters(once, seed, error):
            error.add_note(line)
        raise error


def _error_of(once: Callable[[Schedule], None], schedule: Schedule) -> BaseException | None:
    """Return what a test raises under a schedule, if it fails; a skip or the end of the session is raised on."""
    try:
        once(schedule)
    except Exception as error:  # noqa: BLE001  # whatever a test raises is what is looked for
        return error
    except BaseException as error:
        outcomes = sys.modules.get("_pytest.outcomes")  # pytest's own failure is not an Exception
        if outcomes is not None and isinstance(error, outcomes.Failed):
            return error
        raise
    return None


def _what_matters(once: Callable[[Schedule], None], seed: int, error: BaseException) -> list[str]:
    """Describe the fewest choices found with which the test fails in the same way."""

    def failing(schedule: Schedule) -> Schedule | None:
        again = _error_of(once, schedule)
        return schedule if again is not None and _kind(again) == _kind(error) else None

    recorded = failing(Schedule(seed, record=True))
    if recorded is None or failing(Schedule(given=recorded.choices)) is None:
        return ["it does not fail every time under this order: something besides the order of events varies"]
    fewest = minimised(recorded, lambda fewer: failing(Schedule(given=fewer, record=True)))
    lines = [f"{line} ({times} times)" if times > 1 else line for line, times in Counter(fewest.explanations).items()]
    if len(lines) > _MOST_SHOWN:
        lines[_MOST_SHOWN:] = [f"and {len(lines) - _MOST_SHOWN} choices more"]
    return [f"what matters of it: {lines[0]}", *(f"  then {line}" for line in lines[1:])]


def _kind(error: BaseException) -> tuple[str, ...]:
    """Return what two failures of one cause have in common: the types of the error and of its causes."""
    kinds: list[str] = []
    cause: BaseException | None = error
    while cause is not None:
        kinds.append(type(cause).__qualname__)
        cause = cause.__cause__
    return tuple(kinds)


def minimised(recorded: Schedule, fails: Callable[[Mapping[Place, int]], Schedule | None]) -> Schedule:
    """Return a schedule that still fails, with as many choices as possible set back to first in, first out.

    Args:
        recorded: One that fails.
        fails: Runs under fewer choices, and returns what was recorded then; None where it does not fail any more.
    """
    best, attempts = recorded, 0
    size = len(best.choices)
    while size > 0:
        start, fewer_found = 0, False
        while attempts < _ATTEMPTS and start < len(places := list(best.choices)):
            attempts += 1
            away = set(places[start : start + size])
            found = fails({place: each for place, each in best.choices.items() if place not in away})
            if found is not None and len(found.choices) < len(places):
                best, fewer_found = found, True
            else:
                start += size
        if size > 1 or not fewer_found or attempts >= _ATTEMPTS:
            size //= 2
    return best
