"""Callbacks: the methods of a running node that are called when its parameters change or an event happens."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from inspect import iscoroutinefunction
from typing import TYPE_CHECKING, Any

from busflow.bus.events import Event
from busflow.bus.failure import is_failure, refuse_coroutine
from busflow.node.lifetime import NodeLifetime

if TYPE_CHECKING:
    from busflow.node.parameters import Parameters


class ParameterHandler:
    """One `@on_parameters` of a node that is part of a graph.

    What changes before the node is open, or while a call still awaits, is reported later, in one call for all of it.
    """

    __slots__ = ("_before", "_busy", "_function", "_is_async", "_life", "_origin")

    def __init__(self, function: Callable[[Any], Any], origin: str, life: NodeLifetime) -> None:
        self._function = function
        self._is_async = iscoroutinefunction(function)
        self._origin = origin
        self._life = life
        self._before: Parameters | None = None  # the parameters last reported to the handler, while newer ones are not
        self._busy = False

    def on_change(self, old: Parameters) -> None:
        """Report a change of parameters to the handler; until now they were `old`."""
        if self._before is None:
            self._before = old
        self.catch_up()

    def catch_up(self) -> None:
        """Call the method if parameters have changed and the node is open."""
        if self._before is None or self._busy or not self._life.is_open:
            return
        self._busy = True
        if self._is_async:
            self._life.spawn(self._await_calls(), self._origin)
        else:
            self._life.dispatcher.run_now(self._call)

    def _call(self) -> None:
        try:
            while self._before is not None:  # the handler itself may set parameters
                old, self._before = self._before, None
                refuse_coroutine(self._function(old), self._origin)
        except BaseException as error:  # noqa: BLE001  # a node may raise anything; its supervisor decides
            self._failed(error)
        finally:
            self._busy = False

    async def _await_calls(self) -> None:
        try:
            while self._before is not None:
                old, self._before = self._before, None
                await self._function(old)
        except BaseException as error:
            if not is_failure(error):
                raise
            self._failed(error)
        finally:
            self._busy = False

    def _failed(self, error: BaseException) -> None:
        self._life.fail(f"{self._origin} (parameters)", error)


class EventHandler:
    """One `@on_event` of a node in a graph; each event is handled in a turn of the loop of its own."""

    __slots__ = ("_event_type", "_function", "_life", "origin", "topic")

    def __init__(
        self, topic: str, event_type: type[Event], function: Callable[[Any], Any], origin: str, life: NodeLifetime
    ) -> None:
        self.topic: str = topic
        self.origin: str = origin
        self._event_type = event_type
        self._function = function
        self._life = life

    @property
    def node(self) -> str:
        """The full name of its node."""
        return self._life.name

    def wants(self, topic: str, kind: type[Event]) -> bool:
        """Return whether it listens for this kind of event of a topic."""
        return self.topic == topic and issubclass(kind, self._event_type)

    def notify(self, event: Event) -> None:
        """Call the method with an event, if it subscribes to it and its node is open."""
        if self._life.is_open and self.topic == event.topic and isinstance(event, self._event_type):
            asyncio.get_running_loop().call_soon(self._call_method, event)

    def _call_method(self, event: Event) -> None:
        if not self._life.is_open:
            return
        if iscoroutinefunction(self._function):
            self._life.spawn(self._function(event), self.origin)
            return
        try:
            self._life.dispatcher.run_now(lambda: refuse_coroutine(self._function(event), self.origin))
        except BaseException as error:  # noqa: BLE001  # a node may raise anything; its supervisor decides
            self._life.fail(f"{self.origin} (event {event})", error)
