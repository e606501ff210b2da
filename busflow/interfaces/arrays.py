"""Read-only numpy arrays: how the numeric sequence of a message is checked, copied at most once and frozen.

A frozen array is a view of memory that cannot be written through it: of `bytes`, or of a read-only array. A
read-only array that owns its memory is not enough, for `setflags(write=True)` opens it again.
"""

from __future__ import annotations

import math
from array import array as machine_array
from collections.abc import Callable, Sequence
from functools import lru_cache
from operator import countOf
from struct import Struct
from struct import error as StructError  # noqa: N812 - it is an exception, whatever the standard library calls it
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray
from pydantic_core import PydanticCustomError

from busflow.interfaces.sequences import FieldArray
from busflow.text import printable
from busflow.validation.annotations import EXACT

Scalar = TypeVar("Scalar", bound=np.generic)
AnyArray = NDArray[Any]

_ARRAYS = (np.ndarray, FieldArray)
_BYTES = (bytes, bytearray, memoryview)
_LISTS = (list, tuple)
_CODES = {
    np.dtype(name): code
    for code, name in zip(
        "?bhiqBHIQfd",
        ["bool", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64", "float32", "float64"],
        strict=True,
    )
}
_ACCEPTED: dict[str, tuple[tuple[type, ...], str, str]] = {
    # the kind of array: which single values it takes, which kinds of array, how an error calls them
    "f": ((float, int, np.floating, np.integer), "fiu", "numbers"),
    "i": ((int, np.integer), "iu", "integers"),
    "u": ((int, np.integer), "iu", "integers"),
    "b": ((bool, np.bool_), "b", "booleans"),
}
_USUAL: dict[str, type] = {"f": float, "i": int, "u": int, "b": bool}
"""The element types that lists mostly hold, for each kind of array: these need no further check."""


def take(array: NDArray[Scalar]) -> NDArray[Scalar]:
    """Give `array` up to a message without copying it: freezes it and the arrays it is a view of.

    A message copies a writeable array, which is cheap for a few numbers and expensive for an image. A node that
    will not write to it again avoids the copy: `Image(data=take(frame))`. numpy cannot freeze views that were made
    earlier and are still writeable: make none. Memory that numpy does not own (a mapped file, a
    driver's buffer) can change behind its back and is copied.

    >>> frame = np.zeros(4, np.uint8)
    >>> given = take(frame)
    >>> np.shares_memory(frame, given), frame.flags.writeable, given.flags.writeable
    (True, False, False)
    """
    chain: list[AnyArray] = [array]
    base: Any = array.base
    while isinstance(base, np.ndarray):
        chain.append(cast("AnyArray", base))
        base = chain[-1].base
    if not (base is None or isinstance(base, bytes)):
        return frozen(array.copy())
    for each in chain:
        each.flags.writeable = False
    return array.view(np.ndarray).view(FieldArray)


def zeros(length: int = 0) -> Any:
    """Return the default of a field of numbers: that many zeros of its type, typed for a type checker."""
    return frozen(np.zeros(length, np.uint8))


def array(values: Sequence[float]) -> Any:
    """Return these values as the default of an array field, typed for a type checker."""
    made = np.array(values)
    if made.dtype.kind == "f" and all(isinstance(each, int) for each in values):
        made = np.array(values, np.uint64)  # numpy makes floats of integers of which one is beyond 2^63
    return frozen(made)


def frozen(value: NDArray[Scalar]) -> NDArray[Scalar]:
    """Return `value` itself, or a view of it, if it cannot be written to; else a frozen copy."""
    if not value.flags.writeable and (value.base is None or is_frozen(value)):
        return value if type(value) is FieldArray and value.base is not None else value.view(FieldArray)
    return FieldArray(value.shape, value.dtype, value.tobytes())


def is_frozen(value: AnyArray) -> bool:
    """Return whether `value` is a view that cannot be written to and cannot be made writable again."""
    while not value.flags.writeable:
        base: Any = value.base
        if type(base) is bytes:
            return True
        if type(base) not in _ARRAYS:
            return False
        if base.base is None:
            return not base.flags.writeable
        value = base
    return False


def checker(
    dtype: DTypeLike, *, low: int = 0, high: int = 0, exactly: int | None = None, at_most: int | None = None
) -> Callable[[Any], AnyArray]:
    """Return a function that turns a constructor's argument into a frozen one-dimensional array of `dtype`.

    An array of several dimensions is flattened row by row where that is how it is meant: a picture's or a map's bytes,
    a matrix in a field of fixed length. Elsewhere it is a mistake.
    """
    wanted, numbers = np.dtype(dtype), cast("Any", FieldArray)
    is_bytes, usual, code = wanted == np.uint8, _USUAL[wanted.kind], _CODES[wanted]
    is_unlimited = exactly is None and at_most is None
    by_rows = exactly is not None or (wanted.itemsize == 1 and wanted.kind in "iu")

    def check(value: Any) -> AnyArray:
        # A frozen array of the right type passes here, without a copy: this is the path that must be fast.
        if type(value) is numbers and value.dtype is wanted and value.ndim == 1 and type(value.base) is bytes:
            if is_unlimited or len(value) == exactly:
                return value
            checked: AnyArray = value
        elif (kind := cast("Any", type(value))) in _LISTS and value and countOf(map(type, value), usual) == len(value):
            # Packing into bytes checks the range of each value and makes memory that stays read-only, in one go.
            try:
                checked = numbers(len(value), wanted, _packer(len(value), code)(*value))
            except (StructError, OverflowError):
                raise _unfit(value, wanted, low, high) from None
        elif kind in _ARRAYS and value.dtype is wanted and value.ndim == 1:
            checked = numbers(len(value), wanted, value.tobytes()) if value.flags.writeable else frozen(value)
        elif is_bytes and kind is bytes:
            checked = numbers(len(value), wanted, value)
        else:
            if not by_rows:
                _refuse_dimensions(value)
            checked = frozen(_convert(value, wanted, low, high))
        if exactly is not None and len(checked) != exactly:
            raise _refused(f"takes exactly {exactly} values, not {len(checked)}")
        if at_most is not None and len(checked) > at_most:
            raise _refused(f"takes at most {at_most} values, not {len(checked)}")
        return checked

    return check


def same(left: AnyArray, right: AnyArray) -> bool:
    """Return whether two arrays hold the same values, NaN counting as equal to NaN."""
    return np.array_equal(left, right, equal_nan=left.dtype.kind == "f")


def _convert(value: Any, dtype: np.dtype[Any], low: int, high: int) -> AnyArray:
    """Return a new or flattened array of `dtype` with the values of `value`, each of which must fit exactly."""
    if isinstance(value, (*_LISTS, range)):
        values = cast("Sequence[Any]", value)
        return _from_list(values, dtype, low, high) if values else np.empty(0, dtype)
    if isinstance(value, _BYTES):
        return _from_bytes(cast("bytes", value), dtype)
    if isinstance(value, machine_array):
        value = np.asarray(cast("ArrayLike", value))
    given = cast("AnyArray", value)
    if not isinstance(value, np.ndarray) or hasattr(given, "mask"):
        raise _refused(f"takes a numpy array, a list or a tuple, not {type(given).__name__}")
    if given.ndim == 0:
        raise _refused("takes a sequence, not a single value")
    flat = given.view(np.ndarray).reshape(-1)
    if flat.dtype == dtype:
        return flat
    if flat.size == 0:
        return np.empty(0, dtype)
    if flat.dtype.kind == "O":
        return _from_list(flat.tolist(), dtype, low, high)
    _, kinds, words = _ACCEPTED[dtype.kind]
    if flat.dtype.kind not in kinds:
        raise _refused(f"takes {words}, not an array of {flat.dtype}")
    if dtype.kind == "f":
        return _narrow(flat, dtype)
    if int(flat.min()) < low or int(flat.max()) > high:
        raise _refused(f"takes integers from {low} to {high}, not {int(flat.min())} to {int(flat.max())}")
    return flat.astype(dtype)


def _refuse_dimensions(value: Any) -> None:
    if getattr(value, "ndim", 1) > 1:
        raise _refused(f"takes one dimension, not the shape {value.shape}; array.ravel() has its values in one")


def _from_list(values: Sequence[Any], dtype: np.dtype[Any], low: int, high: int) -> AnyArray:
    """Return an array of any numbers that fit, e.g. of numpy's; `check` takes a list of the usual ones itself."""
    _refuse_others(values, dtype)
    try:
        packed = FieldArray(len(values), dtype, _packer(len(values), _CODES[dtype])(*values))
    except (StructError, OverflowError):
        raise _unfit(values, dtype, low, high) from None
    if dtype.kind == "f":
        _refuse_inexact(values, packed)
    return packed


def _unfit(values: Sequence[Any], dtype: np.dtype[Any], low: int, high: int) -> PydanticCustomError:
    between = f" from {low} to {high}" if dtype.kind in "iu" else ""
    return _refused(f"takes {_ACCEPTED[dtype.kind][2]}{between} that fit {dtype}, not {values!r:.200}")


def _refuse_others(values: Sequence[Any], dtype: np.dtype[Any]) -> None:
    """Raise for the first value that is not a number of the array's kind."""
    classes, _, words = _ACCEPTED[dtype.kind]
    for kind in {*map(type, values)}:
        if not issubclass(kind, classes) or (kind is bool and dtype.kind != "b"):
            index = next(i for i, each in enumerate(values) if type(each) is kind)
            raise _refused(f"takes {words}; item {index} is {values[index]!r}")


def _refuse_inexact(values: Sequence[Any] | AnyArray, floats: AnyArray) -> None:
    """Raise for the first integer that no float has as its value; `floats` are the values as floats."""
    for index in np.flatnonzero(np.abs(floats) >= EXACT).tolist():
        each: Any = values[index]
        if math.isfinite(nearest := float(each)) and nearest != int(each):
            reason = f"takes numbers; item {index} is {printable(each, limit=40)}, which no float is"
            raise _refused(f"{reason}: the nearest is {nearest}")


@lru_cache(256)
def _packer(count: int, code: str) -> Callable[..., bytes]:
    return Struct(f"={count}{code}").pack


def _from_bytes(value: bytes, dtype: np.dtype[Any]) -> AnyArray:
    if dtype != np.uint8:
        raise _refused(f"takes {_ACCEPTED[dtype.kind][2]}, not bytes")
    if memoryview(value).itemsize != 1:
        raise _refused("takes a memoryview of bytes, not of wider items")
    return np.frombuffer(bytes(value), np.uint8) if len(value) else np.empty(0, np.uint8)


def _narrow(values: AnyArray, dtype: np.dtype[Any]) -> AnyArray:
    """Return `values` rounded to `dtype`; a finite value must stay finite."""
    if values.dtype.kind in "iu":
        rounded = values.astype(dtype)
        _refuse_inexact(values, rounded)
        return rounded
    if np.can_cast(values.dtype, dtype):
        return values.astype(dtype)
    with np.errstate(over="ignore"):
        rounded = values.astype(dtype)
    overflowed = np.isinf(rounded)
    if overflowed.any() and (overflowed & np.isfinite(values)).any():
        raise _refused(f"holds values that {dtype} cannot")
    return rounded


def _refused(reason: str) -> PydanticCustomError:
    return PydanticCustomError("array", "{reason}", {"reason": f"The array {reason}"})
