"""ROS field types: the meaning of an annotation, and the pydantic schema that checks its values.

A scalar goes through pydantic's own check first, in Rust; only what that refuses (numpy's scalars) reaches
Python. So a message of plain floats costs what pydantic costs.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated, Any, cast, get_args, get_origin

import numpy as np
from pydantic import BaseModel, GetCoreSchemaHandler, GetJsonSchemaHandler, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticUndefined
from pydantic_core import core_schema as cs

from busflow.errors import InvalidDeclaration
from busflow.interfaces import arrays
from busflow.interfaces.sequences import FieldTuple
from busflow.text import printable
from busflow.validation.annotations import EXACT

_FLOAT32 = struct.Struct("<f")  # the native "f" would turn what is too large into infinity
_TAKES: dict[type, Any] = {
    str: (str,),
    bool: (bool, np.bool_),
    int: (int, np.integer),
    float: (float, int, np.floating, np.integer),
}
_HOME = "from busflow.interfaces.message"
"""Where the words that annotate fields are imported from, in errors."""
_JSON_WORDS = {int: "integer", float: "number", bool: "boolean", str: "string"}


class ArrayKind(Enum):
    """The number of values of a field."""

    NONE = "one"
    FIXED = "exactly size"
    BOUNDED = "at most size"
    UNBOUNDED = "any number"


@dataclass(frozen=True, slots=True)
class Primitive:
    """A ROS type that is one value; in an annotation's metadata it makes pydantic check values of it."""

    name: str
    python: type
    dtype: type[np.generic] | None = None
    """The type of an array of it; None for text, of which there are tuples."""
    low: int = 0
    high: int = 0

    @property
    def meaning(self) -> str:
        """The word for a value of it, in errors."""
        if self.python is int:
            return f"an integer from {self.low} to {self.high}"
        return {float: "a number", bool: "true or false", str: "text"}[self.python]

    def check(self, value: Any) -> Any:
        """Return the value as the plain Python value that a message holds. The schema is a fast path of this rule.

        Raises:
            ValueError: The value is of another kind or out of range.
        """
        accepted = isinstance(value, _TAKES[self.python]) and (
            self.python is bool or not isinstance(value, _TAKES[bool])
        )
        if not accepted or (self.python is int and not self.low <= value <= self.high):
            raise ValueError(f"{self.name} takes {self.meaning}, not {value!r}")
        try:
            plain = self.python(value)
        except OverflowError:
            raise ValueError(f"{self.name} cannot hold so large a number") from None
        if self.python is float and isinstance(value, _TAKES[int]) and plain != int(value):
            raise ValueError(f"no {self.name} is {printable(value, limit=40)}; the nearest is {plain}")
        return round_float32(plain) if self.name == "float32" else plain

    def array_check(self, kind: ArrayKind, size: int) -> Callable[[Any], arrays.AnyArray]:
        """Return a function that makes a frozen array from the value of a sequence."""
        exactly = size if kind is ArrayKind.FIXED else None
        at_most = size if kind is ArrayKind.BOUNDED else None
        dtype = cast("type[np.generic]", self.dtype)
        return arrays.checker(dtype, low=self.low, high=self.high, exactly=exactly, at_most=at_most)

    def schema(self, bound: int | None = None) -> CoreSchema:
        """Return the schema with which pydantic checks one value; `bound` limits a string's characters."""
        if self.python is str:
            # A length limit, even an idle one, makes pydantic refuse text that UTF-8 cannot express.
            return cs.str_schema(strict=True, min_length=0, max_length=bound)
        fast: list[CoreSchema]
        checked = cs.no_info_plain_validator_function(self.check)
        if self.python is bool:
            fast = [cs.bool_schema(strict=True)]
        elif self.python is int:
            fast = [cs.int_schema(strict=True, ge=self.low, le=self.high)]
        else:
            # A strict float alone takes whatever has __float__: numpy's booleans, decimals.
            number = cs.float_schema(strict=True)
            floats = cs.chain_schema([cs.is_instance_schema(float), number])
            integers = cs.chain_schema([cs.int_schema(strict=True, ge=-EXACT, le=EXACT), number])
            # JSON has one kind of number: a strict float would round an integer that no float is.
            fast = [cs.json_or_python_schema(checked, floats), integers]
        schema = cs.union_schema(
            [*fast, checked],
            mode="left_to_right",
            custom_error_type=self.name,
            custom_error_message=f"Input should be {self.name}, {self.meaning}",
            serialization=cs.simple_ser_schema(cast("Any", self.python.__name__)),
        )
        return cs.no_info_after_validator_function(round_float32, schema) if self.name == "float32" else schema

    def json_schema(self) -> JsonSchemaValue:
        """Return the JSON Schema of one value."""
        limits = {"minimum": self.low, "maximum": self.high} if self.python is int else {}
        return {"type": _JSON_WORDS[self.python], **limits}

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        # Reached only inside what ROS cannot describe, as in dict[str, float64].
        return cast("FieldType", _read(source, (self,))).__get_pydantic_core_schema__(source, handler)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        one = self.json_schema()
        inner = cast("Any", schema).get("schema", schema)  # a length may be around it
        return {"type": "array", "items": one} if inner["type"] == "function-plain" else one


def _integer(name: str, dtype: str) -> Primitive:
    limits = np.iinfo(dtype)
    return Primitive(name, int, np.dtype(dtype).type, int(limits.min), int(limits.max))


_SIZED = [f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)]
PRIMITIVES: Mapping[str, Primitive] = {
    primitive.name: primitive
    for primitive in (
        Primitive("bool", bool, np.bool_),
        _integer("byte", "uint8"),
        _integer("char", "uint8"),
        Primitive("float32", float, np.float32),
        Primitive("float64", float, np.float64),
        *(_integer(name, name) for name in _SIZED),
        Primitive("string", str),
        Primitive("wstring", str),
    )
}
"""ROS 2's primitive types by name."""

_PLAIN = {bool: "bool", int: "int64", float: "float64", str: "string"}
# Bytes and characters are unsigned too; uint8, which comes last, is what an array of them is called.
_OF_DTYPE = {np.dtype(each.dtype).name: each for each in PRIMITIVES.values() if each.dtype}


@dataclass(frozen=True, slots=True, init=False)
class Length:
    """The length of a sequence, in an annotation: `Length(9)` is exact, `Length(max=9)` a bound.

    Of text it bounds the characters: `Annotated[str, Length(max=10)]`.
    """

    exactly: int | None
    max: int | None

    def __init__(self, exactly: int | None = None, *, max: int | None = None) -> None:  # noqa: A002 - reads best
        limits = [limit for limit in (exactly, max) if limit is not None]
        if len(limits) != 1 or type(limits[0]) is not int or limits[0] < 1:
            raise InvalidDeclaration(
                f"a length is Length(9) or Length(max=9), of 1 at least, not Length({exactly!r}, max={max!r})"
            )
        object.__setattr__(self, "exactly", exactly)
        object.__setattr__(self, "max", max)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        # Reached only inside what ROS cannot describe, as Primitive's.
        def check(value: Any) -> Any:
            if self.exactly not in (None, len(value)) or (self.max is not None and len(value) > self.max):
                raise ValueError(f"{len(value)} items break {self}")
            return value

        return cs.no_info_after_validator_function(check, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        limits = {"minItems": self.exactly, "maxItems": self.exactly or self.max}
        return handler(schema) | {word: limit for word, limit in limits.items() if limit}


@dataclass(frozen=True, slots=True)
class FieldType:
    """One field of a message as ROS describes it.

    >>> print(FieldType("covariance", "float64", ArrayKind.FIXED, 9))
    float64[9] covariance
    """

    name: str
    base: str | type[BaseModel]
    """A primitive's name, or the class of the nested message."""
    array: ArrayKind = ArrayKind.NONE
    size: int = 0
    """The length of a fixed array, the most of a bounded one."""
    string_bound: int | None = None
    default: Any = field(default=None, compare=False)
    """The value of a field that is not given, as the message holds it; None where it has to be given."""

    def __str__(self) -> str:
        base = self.base if isinstance(self.base, str) else _name_of(self.base)
        bound = f"<={self.string_bound}" if self.string_bound is not None else ""
        limit = "<=" if self.array is ArrayKind.BOUNDED else ""
        array = "" if self.array is ArrayKind.NONE else f"[{limit}{self.size or ''}]"
        return f"{base}{bound}{array} {self.name}"

    def rest(self, value: Any) -> Any:
        """Return a default as the message holds it.

        Raises:
            InvalidDeclaration: The field does not take the value.
        """
        primitive = PRIMITIVES[self.base] if isinstance(self.base, str) else None
        try:
            if primitive and self.array is ArrayKind.NONE and primitive.python is not str:
                return primitive.check(value)
            if primitive and primitive.dtype and self.array is not ArrayKind.NONE:
                return primitive.array_check(self.array, self.size)(value)
            if value == () and self.array is not ArrayKind.FIXED:
                return FieldTuple()
            if type(value) is self.base or (value == "" and self.array is ArrayKind.NONE):
                return value
            return TypeAdapter(cast("Any", Annotated[Any, self])).validate_python(value)
        except ValueError as error:
            reason = error.errors()[0]["msg"] if isinstance(error, ValidationError) else str(error)
            raise InvalidDeclaration(f"its default does not fit: {reason}") from None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        if isinstance(self.base, str):
            primitive = PRIMITIVES[self.base]
            if primitive.dtype and self.array is not ArrayKind.NONE:
                # A frozen array stays an array in Python and becomes a list in JSON.
                listed = cs.plain_serializer_function_ser_schema(np.ndarray.tolist, when_used="json")
                check = primitive.array_check(self.array, self.size)
                return cs.no_info_plain_validator_function(check, serialization=listed)
            item = primitive.schema(self.string_bound)
        else:
            item = _nested(self.base, handler)
        if self.array is ArrayKind.NONE:
            return item
        plain = cs.tuple_schema(
            [item],
            variadic_item_index=0,
            min_length=self.size if self.array is ArrayKind.FIXED else None,
            max_length=self.size or None,
        )
        items = cs.no_info_after_validator_function(FieldTuple, plain)
        # A set has no order and text is a sequence of text: only lists and tuples are meant.
        ordered = cs.chain_schema([cs.is_instance_schema((list, tuple), cls_repr="list or tuple"), items])
        return cs.json_or_python_schema(items, ordered)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        if not isinstance(self.base, str):
            return handler(cast("Any", schema["choices"][0] if schema["type"] == "union" else schema))
        item = PRIMITIVES[self.base].json_schema()
        if self.string_bound is not None:
            item["maxLength"] = self.string_bound
        if self.array is ArrayKind.NONE:
            return item
        limits = {"minItems": self.size} if self.array is ArrayKind.FIXED else {}
        limits |= {"maxItems": self.size} if self.size else {}
        return {"type": "array", "items": item, **limits}


def round_float32(value: float) -> float:
    """Return the nearest number that 32 bits hold; a finite number stays finite.

    Raises:
        ValueError: The number is too large.
    """
    try:
        return _FLOAT32.unpack(_FLOAT32.pack(value))[0]
    except OverflowError:
        raise ValueError("float32 cannot hold so large a number") from None


def understand(name: str, info: FieldInfo) -> FieldType | None:
    """Return the ROS type of a field's annotation, None if ROS has none; sets pydantic's schema too.

    Raises:
        InvalidDeclaration: The annotation is a mistake, or the default does not fit it.
    """
    for known in info.metadata:
        if isinstance(known, FieldType):
            return known
    meaning = _read(info.annotation, info.metadata)
    if meaning is None:
        return None
    default = None
    if info.default is not PydanticUndefined:
        default = meaning.rest(info.default)
        if isinstance(default, np.ndarray | BaseModel):
            # Pydantic deep-copies a default that has no hash, for each message; all share this one instead.
            info.default, info.default_factory = PydanticUndefined, lambda: cast("Any", default)
        elif isinstance(default, FieldTuple):
            # Pydantic writes a plain tuple into its schemas, and makes the field's own of it where it is used.
            info.default, info.validate_default = tuple(cast("FieldTuple[Any]", default)), True
        else:
            info.default = default
    elif info.default_factory is not None:
        info.validate_default = True
    field_type = FieldType(name, meaning.base, meaning.array, meaning.size, meaning.string_bound, default)
    others = [each for each in info.metadata if not isinstance(each, Primitive | Length)]
    info.metadata = [field_type, *others]
    return field_type


def is_message(annotation: object) -> bool:
    """Return whether an annotation is a complete message class; ROS has no recursive types."""
    return isinstance(annotation, type) and issubclass(annotation, BaseModel) and "__ros_fields__" in vars(annotation)


def _name_of(message: type[BaseModel]) -> str:
    return cast("Any", message).__ros_name__


def _read(annotation: Any, metadata: Sequence[Any]) -> FieldType | None:
    """Return the meaning of an annotation and its metadata."""
    base: Any
    while (origin := get_origin(annotation) or annotation) is Annotated or hasattr(origin, "__value__"):
        if origin is Annotated:
            annotation, *inner = get_args(annotation)
            metadata = [*inner, *metadata]
        else:  # `type Name[T] = …`, as numpy writes NDArray since 2.5
            annotation = origin.__value__[get_args(annotation)] if get_args(annotation) else origin.__value__
    primitive = next((each for each in metadata if isinstance(each, Primitive)), None)
    length = next((each for each in metadata if isinstance(each, Length)), None)
    kind = ArrayKind.UNBOUNDED if length is None else ArrayKind.FIXED if length.exactly else ArrayKind.BOUNDED
    size = 0 if length is None else length.exactly or length.max or 0
    if origin is np.ndarray:
        return FieldType("", (primitive or _of_dtype(annotation)).name, kind, size)
    if origin in (Sequence, tuple, list):
        return _read_sequence(annotation, kind, size)
    _refuse_mistakes(annotation)
    if primitive is None and annotation in _PLAIN:
        primitive = PRIMITIVES[_PLAIN[annotation]]
    if primitive or is_message(annotation):
        text = primitive is not None and primitive.python is str
        if length and not (text and length.max):
            raise InvalidDeclaration(f"{length} needs a sequence, or text to bound with Length(max=…)")
        base = primitive.name if primitive else annotation
        return FieldType("", base, string_bound=length.max if length else None)
    return None


def _read_sequence(annotation: Any, kind: ArrayKind, size: int) -> FieldType | None:
    """Return the meaning of a sequence of text or messages."""
    items = get_args(annotation)
    if len(items) != (2 if get_origin(annotation) is tuple else 1) or items[1:] not in ((), (Ellipsis,)):
        return None
    item = _read(items[0], ())
    if item is None:
        return None
    if item.array is not ArrayKind.NONE:
        raise InvalidDeclaration("ROS has no sequences of sequences; put the inner one into a message of its own")
    if isinstance(item.base, str) and PRIMITIVES[item.base].dtype:
        alias = item.base.title().replace("Uint", "UInt") + "Array"
        raise InvalidDeclaration(f"a sequence of {item.base} is a numpy array; write {alias}, {_HOME}")
    if get_origin(annotation) is list:
        raise InvalidDeclaration("a message cannot change, a list can; write Sequence[…]")
    return FieldType("", item.base, kind, size, item.string_bound)


def _of_dtype(annotation: Any) -> Primitive:
    """Return the primitive that a numpy array annotation states."""
    scalar = get_args(get_args(annotation)[1])[0] if len(get_args(annotation)) == 2 else None
    known = _OF_DTYPE.get(np.dtype(scalar).name) if isinstance(scalar, type) else None
    if known is None:
        raise InvalidDeclaration(f"{annotation!r} states no ROS type; write Float64Array, {_HOME}")
    return known


def _refuse_mistakes(annotation: Any) -> None:
    """Raise for an annotation that looks like a ROS type and is not one."""
    if is_message(annotation) and not hasattr(annotation, "__ros_name__"):
        raise InvalidDeclaration("Message is what message classes are made from; write one of those")
    if annotation is bytes or annotation is bytearray:
        raise InvalidDeclaration(f"bytes are a UInt8Array, {_HOME}")
    if isinstance(annotation, type) and issubclass(annotation, np.generic):
        word = np.dtype(cast("Any", annotation)).name
        raise InvalidDeclaration(f"numpy's {annotation.__name__} is not a field type; write {word}, {_HOME}")


def _nested(message: type[BaseModel], handler: GetCoreSchemaHandler) -> CoreSchema:
    """Return the schema of a nested message; some classes also take a value with `to_msg`."""
    schema = handler.generate_schema(message)
    if not getattr(message, "__takes_to_msg__", False):
        return schema

    def convert(value: Any) -> Any:
        made = value.to_msg() if hasattr(value, "to_msg") else None
        if type(made) is not message:
            raise ValueError(f"{value!r} is no {message.__name__}")
        return made

    return cs.union_schema(
        [schema, cs.no_info_plain_validator_function(convert)],
        mode="left_to_right",
        custom_error_type="message",
        custom_error_message=f"Input should be a {_name_of(message)} or a clock's {message.__name__}",
    )
