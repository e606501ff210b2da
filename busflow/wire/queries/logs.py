"""ParameterLog: the last changes of parameters in a run, numbered, so that whoever asks again misses none of them."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from busflow.clock import Clock
    from busflow.node.parameter_store import ParameterStore, SetResult
    from busflow.node.parameters import Parameters

_KEPT = 1000


class ParameterLog:
    """Remembers what was set while the graph ran; the oldest is forgotten first."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._changes: deque[dict[str, Any]] = deque(maxlen=_KEPT)
        self._last = 0

    def follow(self, store: ParameterStore) -> None:
        """Remember the changes of a node's parameters from now on."""

        def hear(_old: Parameters, result: SetResult) -> None:
            for change in result.changed:
                self._last += 1
                told = {"name": change.name, "old": change.old, "new": change.new}
                place = {"sequence": self._last, "stamp_ns": self._clock.now().nanoseconds, "node": store.node}
                self._changes.append(place | told)

        store.on_change.append(hear)

    def since(self, sequence: int | None) -> dict[str, Any]:
        """The changes after one of this number, all that are known where it is 0, and none for None: `{last, changes}`.

        A gap between the number and the first change says how many were forgotten.
        """
        changes = [] if sequence is None else [each for each in self._changes if each["sequence"] > sequence]
        return {"last": self._last, "changes": changes}
