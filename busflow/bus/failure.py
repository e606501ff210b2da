"""Failure: an exception of a node, and its text, which names node, handler, line and message."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from inspect import isasyncgen, iscoroutine, isgenerator
from typing import cast

from busflow.errors import InvalidDeclaration
from busflow.interfaces.message import Message, type_name
from busflow.text import printable
from busflow.validation.tracebacks import user_line

_SHOWN = 400
"""The number of characters shown of a message, enough to recognise it."""


@dataclass(frozen=True, slots=True)
class Failure:
    """An exception of a node, its place, and the message being handled."""

    node: str
    origin: str
    """The code that raised, for people: `SensorProcessor.on_imu (subscription /imu/data)`."""
    error: BaseException
    message: Message | None = None

    def __post_init__(self) -> None:
        from busflow.validation.advice import close_unawaited  # here, as it is needed for errors alone

        close_unawaited(self.cause)

    @property
    def summary(self) -> str:
        """The failure in one line."""
        place = user_line(self.cause)
        return f"failed in {self.origin}: {self._raised()}{f' ({place})' if place else ''}"

    @property
    def cause(self) -> BaseException:
        """The exception itself, or the first one of a group."""
        error = self.error
        while isinstance(error, BaseExceptionGroup):
            error = cast("BaseExceptionGroup[BaseException]", error).exceptions[0]
        return error

    def render(self) -> str:
        """Return the failure as several lines of text for people."""
        lines = [f"node {self.node} failed in {self.origin}"]
        place = user_line(self.cause)
        if place is not None:
            lines += [f"  at {place}", f"    {printable(place.excerpt.strip())}"]
        lines.append(f"  {self._raised()}")
        if self.message is not None:
            shown = printable(repr(self.message), limit=_SHOWN)
            lines.append(f"  on {type_name(type(self.message))}: {shown}")
        return "\n".join(lines)

    def _raised(self) -> str:
        from busflow.validation.advice import advice  # as above

        error = self.cause
        text = "; ".join(filter(None, [printable(str(error), limit=_SHOWN), advice(error)]))
        return f"{type(error).__name__}: {text}" if text else type(error).__name__


def is_failure(error: BaseException) -> bool:
    """Return whether an exception is the node code's own, and not a cancellation or an end from outside."""
    if isinstance(error, asyncio.CancelledError):
        task = asyncio.current_task()
        return task is None or task.cancelling() == 0
    if isinstance(error, GeneratorExit):  # Python raises one in a coroutine that waits for a loop that is gone
        try:
            return asyncio.current_task() is not None
        except RuntimeError:
            return False
    return True


def refuse_coroutine(result: object, origin: str) -> None:
    """Refuse a coroutine or generator as the result of a plain handler, since no code would run it.

    Raises:
        InvalidDeclaration: it is a coroutine or a generator.
    """
    if iscoroutine(result):
        result.close()
        raise InvalidDeclaration(f"{origin} returned a coroutine, which is not awaited; make it an async def handler")
    if isgenerator(result) or isasyncgen(result):
        raise InvalidDeclaration(f"{origin} returned a generator, of which nothing has run; a handler has no yield")
