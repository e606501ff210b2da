"""Comparison: where two messages differ, field by field, as plain data."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from busflow.clock import NS_PER_S
from busflow.text import printable

_MOST_OF_AN_ARRAY = 3
"""The limit of shown differences in one message: two pictures may differ in every byte."""
_TIME = {"sec", "nanosec"}


@dataclass(frozen=True, slots=True)
class FieldDifference:
    """A field of two messages that is not the same in both."""

    path: str
    """`linear_acceleration.x`, `position[3]`; empty for the message itself."""
    left: object
    right: object

    def __str__(self) -> str:
        return f"{self.path}: {_shown(self.left)} -> {_shown(self.right)}"


@dataclass(frozen=True, slots=True)
class Comparison:
    """The distances up to which two values count as the same."""

    tolerance: float = 0.0
    """The tolerance of floating-point numbers, absolute; NaN equals NaN."""
    time_tolerance_ns: int = 0
    """The tolerance of times and durations: stamps that a handler takes from a running clock."""

    def differences(self, left: Any, right: Any, path: str = "") -> Iterator[FieldDifference]:
        """Yield the differences of two messages in the order of their fields; both are data of `Channel.plain`."""
        match left, right:
            case Mapping(), Mapping():
                yield from self._of_mappings(cast("Mapping[str, Any]", left), cast("Mapping[str, Any]", right), path)
            case (memoryview() | np.ndarray(), memoryview() | np.ndarray()):
                yield from self._of_arrays(np.asarray(left), np.asarray(right), path)
            case (list() | tuple(), list() | tuple()):
                yield from self._of_sequences(cast("Sequence[Any]", left), cast("Sequence[Any]", right), path)
            case float(), float():
                if not self._near(left, right):
                    yield FieldDifference(path, left, right)
            case _:
                if type(left) is not type(right) or left != right:
                    yield FieldDifference(path, left, right)

    def _of_mappings(self, left: Mapping[str, Any], right: Mapping[str, Any], path: str) -> Iterator[FieldDifference]:
        if set(left) == set(right) == _TIME:
            if abs(_ns(left) - _ns(right)) > self.time_tolerance_ns:
                yield FieldDifference(path, _seconds(left), _seconds(right))
            return
        for name in {**left, **right}:
            inner = f"{path}.{name}" if path else name
            if name not in left or name not in right:
                yield FieldDifference(inner, left.get(name), right.get(name))
            else:
                yield from self.differences(left[name], right[name], inner)

    def _of_sequences(self, left: Sequence[Any], right: Sequence[Any], path: str) -> Iterator[FieldDifference]:
        if len(left) != len(right):
            yield FieldDifference(path, f"{len(left)} values", f"{len(right)} values")
        for index, (one, other) in enumerate(zip(left, right, strict=False)):
            yield from self.differences(one, other, f"{path}[{_key(index, one, other)}]")

    def _of_arrays(
        self, left: np.ndarray[Any, Any], right: np.ndarray[Any, Any], path: str
    ) -> Iterator[FieldDifference]:
        if left.dtype != right.dtype or left.shape != right.shape:
            yield FieldDifference(path, f"{left.size} x {left.dtype}", f"{right.size} x {right.dtype}")
            return
        if left.dtype.kind == "f":
            with np.errstate(invalid="ignore"):
                same = (np.abs(left - right) <= self.tolerance) | (left == right) | (np.isnan(left) & np.isnan(right))
        else:
            same = left == right
        found = np.flatnonzero(~same)
        for index in found[:_MOST_OF_AN_ARRAY].tolist():
            yield FieldDifference(f"{path}[{index}]", left[index].item(), right[index].item())
        if len(found) > _MOST_OF_AN_ARRAY:
            yield FieldDifference(path, f"{len(found)} of {left.size} values", "others")

    def _near(self, left: float, right: float) -> bool:
        return left == right or abs(left - right) <= self.tolerance or (math.isnan(left) and math.isnan(right))


def _key(index: int, left: Any, right: Any) -> str:
    """Return the index of two items, or the name that both state, as parameters do."""
    match left, right:
        case {"name": str(name)}, {"name": str(other)} if name == other != "":
            return printable(repr(name), limit=80)
        case _:
            return str(index)


def _ns(time: Mapping[str, Any]) -> int:
    return int(time["sec"]) * NS_PER_S + int(time["nanosec"])


def _seconds(time: Mapping[str, Any]) -> str:
    return f"{time['sec']}.{int(time['nanosec']):09} s"


def _shown(value: object) -> str:
    return printable(value if isinstance(value, str) else repr(value), limit=80)
