"""Supervision: what is asked for a node: when it starts, what happens when it fails, and when it ends."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, TypeVar

from busflow.errors import InvalidDeclaration

if TYPE_CHECKING:
    from busflow.node.node import Node


W = TypeVar("W", bound=StrEnum)


def _word(kind: type[W], what: str, given: str) -> W:
    try:
        return kind(given)
    except ValueError:
        raise InvalidDeclaration(f"{what} is one of {', '.join(kind)}, got {given!r}") from None


class Restart(StrEnum):
    """Whether a node is started anew."""

    NEVER = "never"
    ON_FAILURE = "on-failure"
    ALWAYS = "always"


class Condition(StrEnum):
    """What a node waits for in another one."""

    STARTED = "started"
    """Its `start` has begun."""
    READY = "ready"
    """Its `start` has returned: it reacts."""
    FIRST_MESSAGE = "first_message"
    """It has published, on any of its topics."""


class OnExit(StrEnum):
    """What the end of a node means for the others. A failure that is not mended by a restart ends the run anyway."""

    IGNORE = "ignore"
    SHUTDOWN = "shutdown"


@dataclass(frozen=True, slots=True)
class RestartPolicy:
    """Whether a node is started anew, how soon, and how often before it is given up.

    Raises:
        InvalidDeclaration: a number is out of range, or `when` none of the words.
    """

    when: Restart | str = Restart.NEVER
    most: int = 10
    """How many restarts within the window; one more failure is final."""
    first_s: float = 0.1
    """The pause before the first restart; each one after it is twice as long."""
    longest_s: float = 5.0
    window_s: float = 60.0
    """What the limit counts in; a node that has run for so long begins with the first pause again."""

    def __post_init__(self) -> None:
        """Take the word for what it means, and refuse what cannot be meant."""
        object.__setattr__(self, "when", _word(Restart, "restart", self.when))
        if self.most < 1 or not 0 < self.first_s <= self.longest_s or self.window_s <= 0:
            raise InvalidDeclaration(
                f"{self}: at least one restart, the longest pause not below the first, all above 0"
            )


@dataclass(frozen=True, slots=True)
class Supervision:
    """What is asked for one node."""

    restart: RestartPolicy = RestartPolicy()
    depends_on: Mapping[str, Condition] = field(default_factory=dict[str, Condition])
    """By the full name of another node, what to wait for before the start."""
    on_exit: OnExit = OnExit.IGNORE


@dataclass(frozen=True, slots=True)
class Supervised:
    """A node made by hand, and what is asked for it."""

    node: Node | type[Node]
    supervision: Supervision


def supervised(
    node: Node | type[Node],
    *,
    restart: str | RestartPolicy = Restart.NEVER,
    depends_on: Mapping[str, str] | None = None,
    on_exit: str = OnExit.IGNORE,
) -> Supervised:
    """A node made by hand with what a launch file says of one, for `launch`, `run` and the harness.

        busflow.run(supervised(Camera(rate_hz=30), restart="on-failure"), supervised(Viewer, on_exit="shutdown"))

    Args:
        node: A node, or its class. A restart builds a new instance from the parameters of the one before.
        restart: `never`, `on-failure` or `always`, or a whole `RestartPolicy`.
        depends_on: By the name of another node what to wait for: `started`, `ready` or `first_message`.
        on_exit: `shutdown` to end the run when the node's `run` returns, or `ignore`.

    Raises:
        InvalidDeclaration: a word is none of these.
    """
    policy = restart if isinstance(restart, RestartPolicy) else RestartPolicy(restart)
    needs = {
        f"/{name.removeprefix('/')}": _word(Condition, f"depends_on {name}", what)
        for name, what in (depends_on or {}).items()
    }
    return Supervised(node, Supervision(policy, needs, _word(OnExit, "on_exit", on_exit)))
