"""Failure: a node that raised, and how that is told: in one block that names node, handler, line and message."""

from __future__ import annotations

from dataclasses import dataclass

from busflow.blame import blame
from busflow.message import Message, type_name
from busflow.text import printable

_SHOWN = 400
"""Characters of a message that a block shows: enough to recognise it by."""


@dataclass(frozen=True, slots=True)
class Failure:
    """What a node raised, where, and on which message."""

    node: str
    origin: str
    """What raised, for people: `SensorProcessor.on_imu (subscription /imu/data)`."""
    error: BaseException
    message: Message | None = None

    @property
    def summary(self) -> str:
        """The failure in one line."""
        place = blame(self.cause)
        return f"failed in {self.origin}: {self._raised()}{f' ({place})' if place else ''}"

    @property
    def cause(self) -> BaseException:
        """The exception itself, or the first one of a group."""
        error = self.error
        while isinstance(error, BaseExceptionGroup):
            error = error.exceptions[0]
        return error

    def render(self) -> str:
        """The failure as a block for people."""
        lines = [f"node {self.node} failed in {self.origin}"]
        place = blame(self.cause)
        if place is not None:
            lines += [f"  at {place}", f"    {printable(place.excerpt.strip())}"]
        lines.append(f"  {self._raised()}")
        if self.message is not None:
            shown = printable(repr(self.message), limit=_SHOWN)
            lines.append(f"  on {type_name(type(self.message))}: {shown}")
        return "\n".join(lines)

    def _raised(self) -> str:
        error = self.cause
        text = printable(str(error), limit=_SHOWN)
        return f"{type(error).__name__}: {text}" if text else type(error).__name__
