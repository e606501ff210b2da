"""`Supervision`: when a node, process or program starts and is restarted, and what its end means for the run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TypeVar

from busflow.errors import InvalidDeclaration

W = TypeVar("W", bound=StrEnum)


def word(kind: type[W], what: str, given: str) -> W:
    """Return the member of an enumeration that a text names.

    Raises:
        InvalidDeclaration: it names none; `what` says of what.
    """
    try:
        return kind(given)
    except ValueError:
        raise InvalidDeclaration(f"{what} is one of {', '.join(kind)}, got {given!r}") from None


class Restart(StrEnum):
    """Choice of when an ended node is restarted: never, after a failure, or after every end."""

    NEVER = "never"
    ON_FAILURE = "on-failure"
    ALWAYS = "always"


class Condition(StrEnum):
    """A state of another node; a node that depends on the other one waits for it before its start."""

    STARTED = "started"
    """Its `start` has begun."""
    READY = "ready"
    """Its `start` has returned: it handles messages."""
    FIRST_MESSAGE = "first_message"
    """It has published, on any of its topics."""


class OnExit(StrEnum):
    """The effect of a node's end on the run. A failure that no restart follows ends the run in any case."""

    IGNORE = "ignore"
    SHUTDOWN = "shutdown"


@dataclass(frozen=True, slots=True)
class RestartPolicy:
    """Rule for restarts of an ended node: when, how soon, and how often before its failure is final.

    Raises:
        InvalidDeclaration: a number is out of range, or the value of `when` is not one of `Restart`.
    """

    when: Restart | str = Restart.NEVER
    most: int = 10
    """The largest number of restarts within the window; one more failure is final."""
    first_s: float = 0.1
    """The pause before the first restart; each one after it is twice as long."""
    longest_s: float = 5.0
    """The longest pause; the pauses stop growing there."""
    window_s: float = 60.0
    """The time in which restarts are counted; a node that has run for this time begins with the first pause again."""

    def __post_init__(self) -> None:
        """Turn the text of `when` into a `Restart`, and refuse numbers that make no sense."""
        object.__setattr__(self, "when", word(Restart, "restart", self.when))
        if self.most < 1 or not 0 < self.first_s <= self.longest_s or self.window_s <= 0:
            raise InvalidDeclaration(
                f"{self}: most must be at least 1, first_s above 0 and at most longest_s, window_s above 0"
            )


@dataclass(frozen=True, slots=True)
class Supervision:
    """The supervision of one node."""

    restart: RestartPolicy = RestartPolicy()
    depends_on: Mapping[str, Condition] = field(default_factory=dict[str, Condition])
    """The conditions to wait for before the start, by the full name of another node."""
    on_exit: OnExit = OnExit.IGNORE
