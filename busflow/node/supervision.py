"""Supervision of nodes: what Python code asks for them, when an ended node is restarted, and the order of stopping."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from busflow.bus.names import absolute_name
from busflow.launchfile.model.supervision import Condition, OnExit, Restart, RestartPolicy, Supervision, word

if TYPE_CHECKING:
    from busflow.node.node import Node


@dataclass(frozen=True, slots=True)
class Supervised:
    """A node made in Python code, not by a launch file, and its supervision."""

    node: Node | type[Node]
    supervision: Supervision


def supervised(
    node: Node | type[Node],
    *,
    restart: str | RestartPolicy = Restart.NEVER,
    depends_on: Mapping[str, str] | None = None,
    on_exit: str = OnExit.IGNORE,
) -> Supervised:
    """Give a node made in Python code the supervision that a launch file states, for `launch`, `run` and the harness.

        busflow.run(supervised(Camera(rate_hz=30), restart="on-failure"), supervised(Viewer, on_exit="shutdown"))

    Args:
        node: A node, or its class. A restart builds a new instance from the last parameters of the one that ended.
        restart: `never`, `on-failure` or `always`, or a whole `RestartPolicy`.
        depends_on: By the name of another node, the state to wait for: `started`, `ready` or `first_message`.
        on_exit: `shutdown` to end the run when the node's `run` returns, or `ignore`.

    Raises:
        InvalidDeclaration: a value is not one of these words.
    """
    policy = restart if isinstance(restart, RestartPolicy) else RestartPolicy(restart)
    needs = {
        absolute_name(name): word(Condition, f"depends_on {name}", what) for name, what in (depends_on or {}).items()
    }
    return Supervised(node, Supervision(policy, needs, word(OnExit, "on_exit", on_exit)))


class Backoff:
    """Decides when an ended node is restarted, and when its failure is final.

    The caller passes the time, in seconds of the run's clock.

    >>> backoff = Backoff(RestartPolicy(most=3, first_s=1, longest_s=3, window_s=60))
    >>> [backoff.next_s(lived_s=0, now_s=at) for at in (0, 2, 5, 9)]
    [1, 2, 3, None]
    """

    __slots__ = ("_policy", "_recent", "_row", "restarts")

    def __init__(self, policy: RestartPolicy) -> None:
        self.restarts: int = 0
        """The number of restarts, the one that `next_s` has just allowed included."""
        self._policy = policy
        self._recent: list[float] = []
        self._row = 0
        """The number of restarts in a row: since the node last ran for a whole window."""

    def next_s(self, *, lived_s: float, now_s: float) -> float | None:
        """Count a restart and return the pause before it, in seconds; None if the limit is reached.

        Args:
            lived_s: How long the node ran after its start had returned.
            now_s: The run's time.
        """
        policy, recent = self._policy, self._recent
        while recent and now_s - recent[0] >= policy.window_s:
            del recent[0]
        if len(recent) >= policy.most:
            return None
        recent.append(now_s)
        self.restarts += 1
        self._row = 0 if lived_s >= policy.window_s else self._row
        pause_s = min(policy.longest_s, policy.first_s * 2 ** min(self._row, 64))
        self._row += 1
        return pause_s


def cycle(needs: Mapping[str, Collection[str]]) -> list[str]:
    """Return the names of nodes that wait for each other in a circle, the first again at the end; empty if none do.

    >>> cycle({"/a": ["/b"], "/b": ["/c"], "/c": ["/b"]})
    ['/b', '/c', '/b']
    >>> cycle({"/a": ["/b", "/c"], "/b": ["/c"], "/c": []})
    []
    """
    done: set[str] = set()
    for name in needs:
        path: list[tuple[str, list[str]]] = [(name, list(needs[name]))]
        while path:
            here, left = path[-1]
            names = [each for each, _ in path]
            following = left.pop(0) if left else None
            if following is None:
                done.add(here)
                path.pop()
            elif following in names:
                return [*names[names.index(following) :], following]
            elif following not in done and following in needs:
                path.append((following, list(needs[following])))
    return []


def stop_order(names: Sequence[str], needs: Mapping[str, Collection[str]]) -> list[str]:
    """Return the order in which to stop nodes: the last one first, but none before the nodes that depend on it.

    If nodes depend on each other in a circle, the last of them is first.

    >>> stop_order(["/sensors", "/balance", "/motors"], {"/sensors": ["/motors"]})
    ['/balance', '/sensors', '/motors']
    """
    left = list(reversed(names))
    order: list[str] = []
    while left:
        free = next((name for name in left if not any(name in needs.get(other, ()) for other in left)), left[0])
        left.remove(free)
        order.append(free)
    return order
