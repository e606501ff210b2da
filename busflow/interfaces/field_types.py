"""The words that annotate a message's fields: `float64`, `uint8`, `string`, `Float64Array` and others.

A type checker reads a field of `Float64Array` as a numpy array and lets a list be given for it when the
message is made. To it a scalar is Python's own type: numpy's float64 is one, the others are accepted at run
time, and both take `float(x)`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, Generic, Self, TypeAlias, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from busflow.interfaces.fields import PRIMITIVES

__all__ = [
    "BoolArray",
    "ByteArray",
    "CharArray",
    "Float32Array",
    "Float64Array",
    "Int8Array",
    "Int16Array",
    "Int32Array",
    "Int64Array",
    "UInt8Array",
    "UInt16Array",
    "UInt32Array",
    "UInt64Array",
    "byte",
    "char",
    "float32",
    "float64",
    "int8",
    "int16",
    "int32",
    "int64",
    "string",
    "uint8",
    "uint16",
    "uint32",
    "uint64",
    "wstring",
]

float32 = Annotated[float, PRIMITIVES["float32"]]
float64 = Annotated[float, PRIMITIVES["float64"]]
int8 = Annotated[int, PRIMITIVES["int8"]]
int16 = Annotated[int, PRIMITIVES["int16"]]
int32 = Annotated[int, PRIMITIVES["int32"]]
int64 = Annotated[int, PRIMITIVES["int64"]]
uint8 = Annotated[int, PRIMITIVES["uint8"]]
uint16 = Annotated[int, PRIMITIVES["uint16"]]
uint32 = Annotated[int, PRIMITIVES["uint32"]]
uint64 = Annotated[int, PRIMITIVES["uint64"]]
byte = Annotated[int, PRIMITIVES["byte"]]
char = Annotated[int, PRIMITIVES["char"]]
string = Annotated[str, PRIMITIVES["string"]]
wstring = Annotated[str, PRIMITIVES["wstring"]]

if TYPE_CHECKING:
    # For a field whose class has __set__, a type checker takes the type of its value for the constructor's
    # argument and that of __get__ for reading. Only type checkers ever see these classes.
    _Scalar = TypeVar("_Scalar", bound=np.generic)
    _Given = TypeVar("_Given")
    _Integer: TypeAlias = int | np.integer[Any]
    _Number: TypeAlias = float | np.floating[Any] | _Integer
    _Numbers: TypeAlias = Sequence[_Number] | NDArray[np.floating[Any] | np.integer[Any]]
    _Integers: TypeAlias = Sequence[_Integer] | NDArray[np.integer[Any]]
    _Bytes: TypeAlias = _Integers | bytes | bytearray | memoryview

    class _ArrayField(Generic[_Scalar, _Given]):
        @overload
        def __get__(self, message: None, owner: Any = None) -> Self: ...
        @overload
        def __get__(self, message: object, owner: Any = None) -> NDArray[_Scalar]: ...
        def __get__(self, message: object, owner: Any = None) -> Any: ...
        def __set__(self, message: object, value: _Given) -> None: ...

    class BoolArray(_ArrayField[np.bool_, Sequence[bool | np.bool_] | NDArray[np.bool_]]):
        """`bool[]`."""

    class ByteArray(_ArrayField[np.uint8, _Bytes]):
        """`byte[]`."""

    class CharArray(_ArrayField[np.uint8, _Bytes]):
        """`char[]`."""

    class Float32Array(_ArrayField[np.float32, _Numbers]):
        """`float32[]`."""

    class Float64Array(_ArrayField[np.float64, _Numbers]):
        """`float64[]`."""

    class Int8Array(_ArrayField[np.int8, _Integers]):
        """`int8[]`."""

    class Int16Array(_ArrayField[np.int16, _Integers]):
        """`int16[]`."""

    class Int32Array(_ArrayField[np.int32, _Integers]):
        """`int32[]`."""

    class Int64Array(_ArrayField[np.int64, _Integers]):
        """`int64[]`."""

    class UInt8Array(_ArrayField[np.uint8, _Bytes]):
        """`uint8[]`."""

    class UInt16Array(_ArrayField[np.uint16, _Integers]):
        """`uint16[]`."""

    class UInt32Array(_ArrayField[np.uint32, _Integers]):
        """`uint32[]`."""

    class UInt64Array(_ArrayField[np.uint64, _Integers]):
        """`uint64[]`."""

else:
    BoolArray = Annotated[NDArray[np.bool_], PRIMITIVES["bool"]]
    ByteArray = Annotated[NDArray[np.uint8], PRIMITIVES["byte"]]
    CharArray = Annotated[NDArray[np.uint8], PRIMITIVES["char"]]
    Float32Array = Annotated[NDArray[np.float32], PRIMITIVES["float32"]]
    Float64Array = Annotated[NDArray[np.float64], PRIMITIVES["float64"]]
    Int8Array = Annotated[NDArray[np.int8], PRIMITIVES["int8"]]
    Int16Array = Annotated[NDArray[np.int16], PRIMITIVES["int16"]]
    Int32Array = Annotated[NDArray[np.int32], PRIMITIVES["int32"]]
    Int64Array = Annotated[NDArray[np.int64], PRIMITIVES["int64"]]
    UInt8Array = Annotated[NDArray[np.uint8], PRIMITIVES["uint8"]]
    UInt16Array = Annotated[NDArray[np.uint16], PRIMITIVES["uint16"]]
    UInt32Array = Annotated[NDArray[np.uint32], PRIMITIVES["uint32"]]
    UInt64Array = Annotated[NDArray[np.uint64], PRIMITIVES["uint64"]]
