"""The values of a message's sequences: a read element is a Python value, as in rclpy, and they compare as sequences.

`FieldArray` is numpy's array for numbers; `FieldTuple` is a tuple of texts or messages. Arithmetic of whole arrays is
numpy's: `data * 2` may overflow, as everywhere in numpy, where `data[0] * 2` does not. Slices, views and copies of a
`FieldArray` are of its class; results of arithmetic are plain arrays of numpy.
"""

from __future__ import annotations

from array import array as machine_array
from collections.abc import Callable, Iterator
from typing import Any, Never, SupportsIndex, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

T_co = TypeVar("T_co", covariant=True)

_ARRAY: Any = np.ndarray
_TUPLE: Any = tuple
_NUMBERS: Any = (np.number, np.bool_)
_SEQUENCES: Any = (list, tuple, machine_array)
_BYTES: Any = (bytes, bytearray)
_IN_MEMORYVIEWS = frozenset(map(np.dtype, "?bBhHiIlLqQfd"))
"""The types whose elements a memoryview can read."""


class _Unchangeable:
    """Raises AttributeError for a method of a list that changes it, and says what to write instead."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, instance: object, owner: type) -> Never:
        raise AttributeError(
            f"{owner.__name__} has no {self._name}: a message cannot change; "
            "write message.replace(field=[*message.field, value]), or change a list(message.field)"
        )


class _Array(np.ndarray[Any, Any]):
    """An array that is printed as numpy's, and whose results of arithmetic are numpy's."""

    __slots__ = ()

    def __repr__(self) -> str:
        return repr(self.view(np.ndarray))

    def __array_wrap__(self, array: Any, *_: Any) -> Any:
        if array is self:  # changed in place
            return array
        return array.view(np.ndarray)[() if array.ndim == 0 else ...]


class _Comparison(_Array):
    """The result of `==` or `!=` for each element; as a truth value it is the result for both sequences."""

    truth: Callable[[Any], Any] | None = None
    """Combines the elements; None for a part of a result."""

    def __bool__(self) -> bool:
        return super().__bool__() if self.truth is None else bool(self.truth(self))


class FieldArray(_Array):
    """The numbers of a field: an array of numpy whose elements are read as Python's numbers.

    >>> data = FieldArray(2, np.dtype(np.int8), bytes([100, 3]))
    >>> data[0] * 2, [*data[::-1]], data == [100, 3], (data * 2).tolist()
    (200, [3, 100], array([ True,  True]), [-56, 6])
    """

    __slots__ = ()

    def __getitem__(self, key: Any) -> Any:
        found = _ARRAY.__getitem__(self, key)
        return found.item() if isinstance(found, _NUMBERS) else found

    def __iter__(self) -> Iterator[Any]:
        # A view of the memory reads one number after the other, without numpy's scalars.
        is_readable = self.ndim == 1 and self.dtype in _IN_MEMORYVIEWS
        return iter(cast("Any", memoryview)(self)) if is_readable else _ARRAY.__iter__(self)

    def __bool__(self) -> bool:
        """Return whether there are elements, as for a list."""
        return len(self) > 0 if self.ndim == 1 else super().__bool__()

    def __eq__(self, other: object) -> Any:
        return _compared(self, other, _ARRAY.__eq__, same=True)

    def __ne__(self, other: object) -> Any:
        return _compared(self, other, _ARRAY.__ne__, same=False)

    __hash__ = None  # type: ignore[assignment]  # as numpy's array


class FieldTuple(tuple[T_co, ...]):
    """The texts or messages of a field: a tuple that equals a list of the same items.

    >>> FieldTuple(["hip", "knee"]) == ["hip", "knee"], FieldTuple(["hip"]) + ["knee"]
    (True, ['hip', 'knee'])
    """

    __slots__ = ()

    def __getitem__(self, key: SupportsIndex | slice) -> Any:
        found = _TUPLE.__getitem__(self, key)
        return FieldTuple(found) if type(key) is slice else found

    def __eq__(self, other: object) -> bool:
        return _TUPLE.__eq__(self, _TUPLE(other) if isinstance(other, list) else other)

    def __ne__(self, other: object) -> bool:
        return _TUPLE.__ne__(self, _TUPLE(other) if isinstance(other, list) else other)

    def __hash__(self) -> int:
        return _TUPLE.__hash__(self)

    def __add__(self, other: Any) -> Any:
        return [*self, *cast("list[Any]", other)] if isinstance(other, list) else _TUPLE.__add__(self, other)

    def __radd__(self, other: Any) -> Any:
        return [*cast("list[Any]", other), *self] if isinstance(other, list) else NotImplemented


for _class in (FieldArray, FieldTuple):
    for _name in ("append", "extend", "insert", "pop", "remove"):
        setattr(_class, _name, _Unchangeable(_name))


def _compared(array: FieldArray, other: Any, compare: Callable[[Any, Any], Any], *, same: bool) -> Any:
    """Compare an array with anything: with a sequence so that it has a truth value, with the rest as numpy does."""
    if isinstance(other, _BYTES) and array.dtype == np.uint8:
        other = np.frombuffer(other, np.uint8)
    is_sequence = array.ndim == 1 and (getattr(other, "ndim", 0) == 1 or isinstance(other, _SEQUENCES))
    as_long = is_sequence and len(array) == len(other)
    if is_sequence and not as_long and 1 not in (len(array), len(other)):
        return np.bool_(not same)  # numpy would refuse
    found = compare(array, other)
    if not (is_sequence and isinstance(found, np.ndarray)):
        return found
    result = cast("NDArray[Any]", found).view(_Comparison)
    whole = _ARRAY.all if same else _ARRAY.any
    result.truth = whole if as_long else lambda _: not same
    return result
