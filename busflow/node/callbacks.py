"""ParameterHandler: a method of a node that hears of changed parameters, one call at a time."""

from __future__ import annotations

from collections.abc import Callable
from inspect import iscoroutinefunction
from typing import TYPE_CHECKING, Any

from busflow.bus.failure import is_failure, refuse_coroutine
from busflow.node.lifetime import Life

if TYPE_CHECKING:
    from busflow.node.parameters import Parameters


class ParameterHandler:
    """One `@on_parameters` of a node that is part of a graph.

    What changes before the node is open, or while a call still awaits, is told later, in one call for all of it.
    """

    __slots__ = ("_before", "_busy", "_function", "_is_async", "_life", "_origin")

    def __init__(self, function: Callable[[Any], Any], origin: str, life: Life) -> None:
        self._function = function
        self._is_async = iscoroutinefunction(function)
        self._origin = origin
        self._life = life
        self._before: Parameters | None = None  # what the handler takes for the parameters, while that is outdated
        self._busy = False

    def tell(self, old: Parameters) -> None:
        """The parameters have changed; until now they were `old`."""
        if self._before is None:
            self._before = old
        self.catch_up()

    def catch_up(self) -> None:
        """Call the method if there is something to tell, and the node is open to hear it."""
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
        except BaseException as error:  # noqa: BLE001  # a node may raise anything; whoever supervises it decides
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
