"""EventHandler: a method of a node that hears what happens to one of its ends besides messages."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from inspect import iscoroutinefunction
from typing import Any

from busflow.bus.events import Event
from busflow.bus.failure import refuse_coroutine
from busflow.node.lifetime import Life


class EventHandler:
    """One `@on_event` of a node that is part of a graph; it is told in a turn of the loop of its own."""

    __slots__ = ("_event_type", "_function", "_life", "origin", "topic")

    def __init__(
        self, topic: str, event_type: type[Event], function: Callable[[Any], Any], origin: str, life: Life
    ) -> None:
        self.topic = topic
        self.origin = origin
        self._event_type = event_type
        self._function = function
        self._life = life

    @property
    def node(self) -> str:
        """The full name of its node."""
        return self._life.name

    def wants(self, topic: str, kind: type[Event]) -> bool:
        """Whether it listens for this kind of event of a topic."""
        return self.topic == topic and issubclass(kind, self._event_type)

    def hear(self, event: Event) -> None:
        """Tell the method of an event, if it is one that it listens for and its node is open."""
        if self._life.is_open and self.topic == event.topic and isinstance(event, self._event_type):
            asyncio.get_running_loop().call_soon(self._tell, event)

    def _tell(self, event: Event) -> None:
        if not self._life.is_open:
            return
        if iscoroutinefunction(self._function):
            self._life.spawn(self._function(event), self.origin)
            return
        try:
            self._life.dispatcher.run_now(lambda: refuse_coroutine(self._function(event), self.origin))
        except BaseException as error:  # noqa: BLE001  # a node may raise anything; whoever supervises it decides
            self._life.fail(f"{self.origin} (event {event})", error)
