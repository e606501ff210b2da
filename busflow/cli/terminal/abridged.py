"""Abridger: cuts long sequences and texts of a message for printing, so that an image takes a few lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

from busflow.cli.terminal.field_paths import Shape
from busflow.interfaces.encoding.description import Count

TRUNCATED_AFTER = 128
"""The default most items of a sequence, or characters of a text, as in ROS 2."""
_IDL_WORDS = {"float64": "double", "float32": "float", "bool": "boolean", "byte": "octet", "char": "uint8"}
"""ROS 2's names of types in place of a sequence that is left out."""


@dataclass(frozen=True, slots=True)
class Abridger:
    """A function that abridges a value: sequences become lists, and cut ones end with `...`."""

    truncate_after: int | None = TRUNCATED_AFTER
    """The most items or characters; None for no limit."""
    no_arrays: bool = False
    """Show only the type and length of sequences."""
    no_texts: bool = False
    """Show only the length of texts."""

    def __call__(self, value: Any, shape: Shape | None = None) -> Any:
        """Return the value as plain mappings, lists, text and numbers.

        >>> Abridger(2)({"data": memoryview(bytes(3)), "text": "abc"})
        {'data': [0, 0, '...'], 'text': 'ab...'}
        """
        if isinstance(value, Mapping):
            fields = (shape and shape.fields) or {}
            members = cast("Mapping[str, Any]", value).items()
            return {key: self(each, fields.get(key)) for key, each in members}
        if isinstance(value, str):
            if self.no_texts:
                return f"<string length: <{len(value)}>>"
            return value if self._fits(value) else value[: self.truncate_after] + "..."
        if isinstance(value, Sequence):
            return self._items(cast("Sequence[Any]", value), shape)
        return value

    def _items(self, value: Sequence[Any], shape: Shape | None) -> Any:
        if self.no_arrays:
            return _abbreviated(value, shape)
        first = value[: self.truncate_after]
        item = shape and shape.item
        shown = first.tolist() if isinstance(first, memoryview) else [self(each, item) for each in first]
        return shown if self._fits(value) else [*shown, "..."]

    def _fits(self, value: Sequence[Any]) -> bool:
        return self.truncate_after is None or len(value) <= self.truncate_after


def _abbreviated(value: Sequence[Any], shape: Shape | None) -> str:
    """Return the text for a sequence that `ros2 topic echo --no-arr` prints."""
    if shape is None:
        return f"<sequence length: {len(value)}>"
    word = _IDL_WORDS.get(shape.base, shape.base)
    if shape.count is Count.FIXED:
        return f"<array type: {word}[{shape.size}]>"
    bound = f"[{shape.size}]" if shape.count is Count.BOUNDED else ""
    return f"<sequence type: {word}{bound}, length: {len(value)}>"
