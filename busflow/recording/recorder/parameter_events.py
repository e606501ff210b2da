"""`ParameterTrack`: the nodes' parameters as events: all of them at the start, then each change when it happens."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

from busflow.msgs.rcl_interfaces import ParameterEvent
from busflow.node.parameter_messages import event_message
from busflow.node.parameter_store import ParameterChange, ParameterStore, SetResult

if TYPE_CHECKING:
    from busflow.clock import Clock
    from busflow.node.parameters import Parameters

Write = Callable[[ParameterEvent], None]


class ParameterTrack:
    """What is known of each node's parameters, so that nothing is told twice when it is started anew."""

    message_type = ParameterEvent

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._known: dict[str, dict[str, object]] = {}

    def follow(self, store: ParameterStore, write: Write) -> None:
        """Tell of a node's parameters now, as far as they are not known, and of all changes from now on."""
        known = self._known.setdefault(store.node, {})
        found = {row.name: row.value for row in store.describe()}
        changes = [ParameterChange(name, known.get(name), found.get(name)) for name in {**known, **found}]
        self._tell(store, write, [change for change in changes if change.old != change.new])
        store.on_change.append(partial(self._on_change, store, write))

    def _on_change(self, store: ParameterStore, write: Write, _old: Parameters, result: SetResult) -> None:
        self._tell(store, write, result.changed)

    def _tell(self, store: ParameterStore, write: Write, changes: Sequence[ParameterChange]) -> None:
        self._known[store.node].update({change.name: change.new for change in changes})
        if changes:
            write(event_message(self._clock.now(), store.node, changes, store.infos))
