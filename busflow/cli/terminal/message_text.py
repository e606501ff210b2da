"""Message text: a message as `busflow topic echo` and `bag echo` print it, in each of their formats."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import TYPE_CHECKING, Any

from busflow.cli.terminal.abridged import Abridger
from busflow.cli.terminal.field_paths import Shape, parse_path, shape_at, shape_of, value_at
from busflow.cli.terminal.message_filter import Filter, parse_filter
from busflow.cli.terminal.one_line import csv_line
from busflow.cli.terminal.output import line_of
from busflow.cli.terminal.yaml_text import yaml_lines
from busflow.errors import KeyPath
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.wire.client.listener import Received


class TextForm(Enum):
    """The format of a printed message."""

    YAML = auto()
    FLOW = auto()
    """YAML whose sequences are on one line."""
    CSV = auto()
    RAW = auto()
    """The encoded bytes."""
    JSON = auto()


@dataclass(frozen=True, slots=True)
class Wanted:
    """The choices of the command line for printing messages: format, limits, field and filter."""

    form: TextForm
    abridger: Abridger
    field: str | None = None
    filter: str | None = None

    def printer(self, topic: str, type_: ForeignType) -> Printer:
        """Return a printer for messages of a type.

        Raises:
            InvalidInput: The type has no such field, or the filter is not valid.
        """
        shape = shape_of(type_)
        path: KeyPath = ()
        if self.field is not None:
            path = parse_path(self.field, "--field", shape)
        shape = shape_at(path, shape)
        matches = None if self.filter is None else parse_filter(self.filter, shape)
        return Printer(topic, type_.decode, self, path, shape, matches)


@dataclass(frozen=True, slots=True)
class Printer:
    """A function that returns messages of one topic as text."""

    topic: str
    decode: Callable[[bytes], Any]
    wanted: Wanted
    path: KeyPath
    shape: Shape | None
    """The shape of the printed value."""
    matches: Filter | None

    def __call__(self, received: Received) -> str | None:
        """Return a message as text, or None if the filter leaves it out.

        Raises:
            MalformedMessage: The bytes are not a message of the type.
            Absent: It has no value at the field's path.
            InvalidInput: The filter does not fit its values.
        """
        form = self.wanted.form
        if form is TextForm.RAW and self.matches is None:
            return self._raw(received.payload)
        value = value_at(self.path, self.decode(received.payload))
        if self.matches is not None and not self.matches(value):
            return None
        if form is TextForm.RAW:
            return self._raw(received.payload)
        shown = self.wanted.abridger(value, self.shape)
        if form is TextForm.JSON:
            return self._json(received, shown)
        if form is TextForm.CSV:
            return csv_line(shown)
        if isinstance(shown, str):  # a single text field is printed as plain text, not as YAML
            return f"{printable(shown, limit=len(shown) + 1)}\n---"
        return "\n".join([*yaml_lines(shown, flow=form is TextForm.FLOW), "---"])

    def _raw(self, payload: bytes) -> str:
        most = self.wanted.abridger.truncate_after
        if most is None or len(payload) <= most:
            return repr(payload)
        return f"{payload[:most]!r}... ({len(payload)} bytes)"

    def _json(self, received: Received, shown: Any) -> str:
        content = {"field": self.wanted.field, "value": shown} if self.path else {"message": shown}
        numbers = {"sequence": received.sequence or None, "published_ns": received.stamp_ns or None}
        return line_of({"topic": self.topic, **numbers, **content})
