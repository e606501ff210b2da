"""Type descriptions: a message type as plain data in ROS 2's own form, and the RIHS01 hash that names it.

A description has the shape of `type_description_interfaces/msg/TypeDescription`: the type and every type inside it, so
that its holder can read messages without any class. It is dictionaries, lists, text and numbers, ready to be JSON;
besides what ROS 2 says it may hold `constants`. Nothing heavy is imported here: the command line reads descriptions.
"""

from __future__ import annotations

import hashlib
import json
import re
import reprlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, NamedTuple, NotRequired, TypedDict, cast

from busflow.errors import KeyPath, MalformedMessage

DUMMY = "structure_needs_at_least_one_member"
"""The one `uint8` of a type without fields, which C++ would not let be empty."""

SERVICE_EVENT_INFO = "service_msgs/msg/ServiceEventInfo"
"""The type that the event of every service holds."""

ACTION_NEEDS = (SERVICE_EVENT_INFO, "builtin_interfaces/msg/Time", "unique_identifier_msgs/msg/UUID")
"""The types that ROS 2 puts into every action."""

DEPTH = 32
"""The greatest depth of nested types; ROS 2's own have seven, ETSI's messages between vehicles up to 22."""


class PrimitiveEncoding(NamedTuple):
    """ROS 2's number of a value's type, its `struct` code, and its size in bytes."""

    type_id: int
    code: str = ""
    size: int = 0
    """0 for text."""


PRIMITIVES: Mapping[str, PrimitiveEncoding] = {
    "int8": PrimitiveEncoding(2, "b", 1),
    "uint8": PrimitiveEncoding(3, "B", 1),
    "int16": PrimitiveEncoding(4, "h", 2),
    "uint16": PrimitiveEncoding(5, "H", 2),
    "int32": PrimitiveEncoding(6, "i", 4),
    "uint32": PrimitiveEncoding(7, "I", 4),
    "int64": PrimitiveEncoding(8, "q", 8),
    "uint64": PrimitiveEncoding(9, "Q", 8),
    "float32": PrimitiveEncoding(10, "f", 4),
    "float64": PrimitiveEncoding(11, "d", 8),
    "char": PrimitiveEncoding(13, "B", 1),
    "bool": PrimitiveEncoding(15, "?", 1),
    "byte": PrimitiveEncoding(16, "B", 1),
    "string": PrimitiveEncoding(17),
    "wstring": PrimitiveEncoding(18),
}
"""ROS 2's types of one value. What cannot be packed (long double, a wide character) is not known here."""

_NESTED = 1
_BOUNDED_TEXT = {"string": 21, "wstring": 22}
_BASES = {
    **{primitive.type_id: name for name, primitive in PRIMITIVES.items()},
    **{type_id: name for name, type_id in _BOUNDED_TEXT.items()},
}
_NUMBERS = ("type_id", "capacity", "string_capacity")
_TYPE_NAME = re.compile(r"[A-Za-z]\w*(/[A-Za-z]\w*)+", re.ASCII)
_FIELD_NAME = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_LONGEST_BITS = 14_000
"""The size of integers that Python always prints: 4,214 digits."""
_HASH = re.compile(r"RIHS01_[0-9a-f]{64}")


class FieldTypeDescription(TypedDict):
    """The type of a field."""

    type_id: int
    capacity: int
    string_capacity: int
    nested_type_name: str


class FieldDescription(TypedDict):
    """A field; its default is written as in a `.msg` file, empty where there is none."""

    name: str
    type: FieldTypeDescription
    default_value: NotRequired[str]


class ConstantDescription(TypedDict):
    """A constant; its value is written as in a `.msg` file."""

    name: str
    type: str
    value: str
    above: NotRequired[int]
    """The number of fields that stand above it, if there are any."""


class IndividualDescription(TypedDict):
    """One type, those within it only by name."""

    type_name: str
    fields: list[FieldDescription]
    constants: NotRequired[list[ConstantDescription]]


class TypeDescription(TypedDict):
    """A type and, sorted by name, all types within it."""

    type_description: IndividualDescription
    referenced_type_descriptions: list[IndividualDescription]


class Count(IntEnum):
    """The number of values of a field, as the amount that ROS 2 adds to the number of its type."""

    ONE = 0
    FIXED = 48
    BOUNDED = 96
    UNBOUNDED = 144


@dataclass(frozen=True, slots=True)
class Field:
    """A field in the form that codecs use."""

    name: str
    base: str
    """A primitive's name, or the name of a type if `nested`."""
    nested: bool = False
    count: Count = Count.ONE
    size: int = 0
    """The length of a fixed array, the most of a bounded one."""
    string_bound: int = 0
    """The bound of a text, in characters, as rclpy counts them; 0 is no bound."""
    default: str = ""

    def describe(self) -> FieldDescription:
        """Return the field in ROS 2's form."""
        bounded = _BOUNDED_TEXT if self.string_bound else {}
        # A `.msg` file's char is an IDL uint8, and that is what ROS 2 hashes.
        base = "uint8" if self.base == "char" else self.base
        type_id = _NESTED if self.nested else bounded.get(base) or PRIMITIVES[base].type_id
        return {
            "name": self.name,
            "type": {
                "type_id": type_id + self.count,
                "capacity": self.size,
                "string_capacity": self.string_bound,
                "nested_type_name": self.base if self.nested else "",
            },
            "default_value": self.default,
        }


_STATED = {
    "geometry_msgs/msg/Quaternion": {"x", "y", "z"},
    "rcl_interfaces/msg/ParameterDescriptor": {"dynamic_typing", "read_only"},
}
"""Fields whose `.msg` file states the default that ROS assumes anyway; viewers compare the texts of a type."""


def default_text(value: bool | float | str | None, field: str, around: str) -> str:
    """Return the default of one value as the `.msg` file of the type `around` writes it, empty where it writes none."""
    if value is None:
        return ""
    return written(value) if _is_stated(value) or field in _STATED.get(around, ()) else ""


def array_text(values: Sequence[bool | float | str], count: Count) -> str:
    """Return the default of an array as a `.msg` file writes it, empty where it writes none."""
    idle = not any(map(_is_stated, values)) if count is Count.FIXED else not values
    return "" if idle else f"[{', '.join(map(written, values))}]"


def _is_stated(value: bool | float | str) -> bool:
    """Return whether a value differs from the zero that ROS assumes; -0.0 does."""
    return bool(value) or repr(value) == "-0.0"


def written(value: bool | float | str) -> str:
    """Return a default or constant as `.msg` files write it.

    >>> written(1.0), written(True), written("a")
    ('1', 'true', '"a"')
    """
    if isinstance(value, str):
        return '"' + value.replace('"', '\\"') + '"'
    return str(value).lower() if isinstance(value, bool) else repr(value).removesuffix(".0")


def fields_of(individual: IndividualDescription) -> tuple[Field, ...]:
    """Return the fields of a type; an empty type has the dummy field."""
    return tuple(_field(each) for each in individual["fields"])


def is_empty(individual: IndividualDescription) -> bool:
    """Return whether the type has only the dummy field."""
    return [field["name"] for field in individual["fields"]] == [DUMMY]


def individual(
    name: str, fields: list[FieldDescription], constants: list[ConstantDescription] | None = None
) -> IndividualDescription:
    """Return one type; without a field it gets the dummy."""
    described: IndividualDescription = {
        "type_name": name,
        "fields": fields or [Field(DUMMY, "uint8").describe()],
    }
    return {**described, "constants": constants} if constants else described


def assemble(name: str, types: Mapping[str, IndividualDescription]) -> TypeDescription:
    """Return the description of one of `types`, with those of the others that it needs.

    Raises:
        MalformedMessage: One of them is missing, a type holds itself, or they lie too deep within each other.
    """
    heights: dict[str, int] = {}
    _height(name, types, heights, ())
    return {
        "type_description": types[name],
        "referenced_type_descriptions": [types[each] for each in sorted(heights.keys() - {name})],
    }


def service_types(name: str) -> list[IndividualDescription]:
    """Return the types of a service besides its request and response: the service itself and its event."""
    request, response, event = (f"{name}_{part}" for part in ("Request", "Response", "Event"))
    fields = [
        Field("info", SERVICE_EVENT_INFO, nested=True),
        Field("request", request, nested=True, count=Count.BOUNDED, size=1),
        Field("response", response, nested=True, count=Count.BOUNDED, size=1),
    ]
    parts = [
        Field("request_message", request, nested=True),
        Field("response_message", response, nested=True),
        Field("event_message", event, nested=True),
    ]
    return [
        individual(event, [field.describe() for field in fields]),
        individual(name, [field.describe() for field in parts]),
    ]


def action_types(name: str) -> list[IndividualDescription]:
    """Return the types of an action besides its goal, result and feedback: services, a message, the action itself."""
    _, stamp, uuid = ACTION_NEEDS
    send_goal, get_result, feedback = (f"{name}_{part}" for part in ("SendGoal", "GetResult", "FeedbackMessage"))
    goal_id = Field("goal_id", uuid, nested=True)
    own = [Field(part, f"{name}_{part.title()}", nested=True) for part in ("goal", "result", "feedback")]
    fields = {
        f"{send_goal}_Request": [goal_id, own[0]],
        f"{send_goal}_Response": [Field("accepted", "bool"), Field("stamp", stamp, nested=True)],
        f"{get_result}_Request": [goal_id],
        f"{get_result}_Response": [Field("status", "int8"), own[1]],
        feedback: [goal_id, own[2]],
        name: [
            *own,
            Field("send_goal_service", send_goal, nested=True),
            Field("get_result_service", get_result, nested=True),
            Field("feedback_message", feedback, nested=True),
        ],
    }
    described = [individual(each, [field.describe() for field in of]) for each, of in fields.items()]
    return [*described, *service_types(send_goal), *service_types(get_result)]


def types_in(description: TypeDescription) -> dict[str, IndividualDescription]:
    """Return all types of a description by name, the described one first."""
    types = [description["type_description"], *description["referenced_type_descriptions"]]
    return {each["type_name"]: each for each in types}


def rihs01(description: TypeDescription) -> str:
    """Return the type's hash as ROS 2 computes it: only from its fields and those of all types within it."""
    plain = {
        "type_description": _hashed(description["type_description"]),
        "referenced_type_descriptions": [_hashed(each) for each in description["referenced_type_descriptions"]],
    }
    return "RIHS01_" + hashlib.sha256(json.dumps(plain).encode()).hexdigest()


def is_rihs01(text: str) -> bool:
    """Return whether `text` has the form of a RIHS01 hash."""
    return _HASH.fullmatch(text) is not None


def check(value: object) -> TypeDescription:
    """Check parsed JSON from another process and return it as a description.

    Raises:
        MalformedMessage: it is malformed.
    """
    given = _mapping(value, ())
    main = _individual(given.get("type_description"), ("type_description",))
    where = "referenced_type_descriptions"
    others = [_individual(each, (where, i)) for i, each in enumerate(_list(given.get(where), (where,)))]
    types = {each["type_name"]: each for each in (main, *others)}
    if len(types) != 1 + len(others):
        raise _refused("a type is described twice", (where,))
    return assemble(main["type_name"], types)


class _Brief(reprlib.Repr):
    """Text of values without integers of thousands of digits, which Python refuses to print."""

    def repr_int(self, x: int, level: int) -> str:
        return super().repr_int(x, level) if x.bit_length() <= _LONGEST_BITS else "so large a number"


def brief(value: object) -> str:
    """Return a value as an error shows it, however long or deep it is."""
    return _Brief().repr(value)


def _hashed(individual: IndividualDescription) -> dict[str, object]:
    """Return the parts of a type that its hash covers, in order."""
    fields = [{"name": each["name"], "type": each["type"]} for each in individual["fields"]]
    return {"type_name": individual["type_name"], "fields": fields}


def _field(field: FieldDescription) -> Field:
    kind = field["type"]
    count = Count(kind["type_id"] // 48 * 48)
    base = kind["type_id"] - count
    nested = base == _NESTED
    bound = kind["string_capacity"] if base in _BOUNDED_TEXT.values() else 0
    name = kind["nested_type_name"] if nested else _BASES[base]
    size = kind["capacity"] if count in (Count.FIXED, Count.BOUNDED) else 0
    return Field(field["name"], name, nested, count, size, bound, field.get("default_value", ""))


def _height(
    name: str, types: Mapping[str, IndividualDescription], heights: dict[str, int], around: tuple[str, ...]
) -> int:
    """Return the depth of nested types from this one on."""
    if name in around:
        raise _refused(f"{name} holds itself", ())
    if name not in types:
        raise _refused(f"{name}, which {around[-1] if around else 'it'} needs, is not described", ())
    if name not in heights:
        if len(around) >= DEPTH:
            raise _refused(f"types lie more than {DEPTH} deep within each other", ())
        inner = [field["type"]["nested_type_name"] for field in types[name]["fields"]]
        heights[name] = 1 + max((_height(each, types, heights, (*around, name)) for each in inner if each), default=0)
    if len(around) + heights[name] > DEPTH:
        raise _refused(f"types lie more than {DEPTH} deep within each other", ())
    return heights[name]


def _individual(value: object, path: KeyPath) -> IndividualDescription:
    given = _mapping(value, path)
    fields = [_checked_field(each, (*path, "fields", i)) for i, each in enumerate(_list(given.get("fields"), path))]
    if not fields:
        raise _refused("a type has one field at least", path)
    if len({field["name"] for field in fields}) != len(fields):
        raise _refused("two fields have one name", path)
    constants = list(_constants(given.get("constants", []), (*path, "constants")))
    return individual(_word(given.get("type_name"), _TYPE_NAME, (*path, "type_name")), fields, constants)


def constant(name: str, kind: str, value: str, above: int) -> ConstantDescription:
    """Return the description of a constant."""
    described: ConstantDescription = {"name": name, "type": kind, "value": value}
    return {**described, "above": above} if above else described


def _constants(value: object, path: KeyPath) -> Iterator[ConstantDescription]:
    for index, each in enumerate(_list(value, path)):
        given = _mapping(each, (*path, index))
        name = _word(given.get("name"), _FIELD_NAME, (*path, index, "name"))
        kind, text = given.get("type", ""), given.get("value")
        if not isinstance(kind, str) or kind not in PRIMITIVES or not isinstance(text, str):
            raise _refused("a constant has a primitive type and a value in text", (*path, index))
        yield constant(name, kind, text, _number(given.get("above", 0), (*path, index, "above")))


def _checked_field(value: object, path: KeyPath) -> FieldDescription:
    given = _mapping(value, path)
    kind, within = _mapping(given.get("type"), (*path, "type")), (*path, "type")
    type_id, capacity, bound = (_number(kind.get(key, 0), (*within, key)) for key in _NUMBERS)
    nested, default = kind.get("nested_type_name", ""), given.get("default_value", "")
    base = type_id % 48
    if type_id >= 192 or (base != _NESTED and base not in _BASES):
        raise _refused(f"ROS 2's type {type_id} cannot be read", within)
    if Count(type_id - base) in (Count.FIXED, Count.BOUNDED) and capacity == 0:
        raise _refused("an array has one item at least", within)
    if base == _NESTED or nested != "":
        nested = _word(nested, _TYPE_NAME, (*within, "nested_type_name"))
    if base != _NESTED and nested:
        raise _refused(f"a field of type {type_id} holds no {nested}", within)
    if not isinstance(default, str):
        raise _refused("a default is given in text", (*path, "default_value"))
    return {
        "name": _word(given.get("name"), _FIELD_NAME, (*path, "name")),
        "type": {"type_id": type_id, "capacity": capacity, "string_capacity": bound, "nested_type_name": nested},
        "default_value": default,
    }


def _number(value: object, path: KeyPath) -> int:
    if type(value) is not int or not 0 <= value < 1 << 32:
        raise _refused(f"{brief(value)} is not a number of 32 bits", path)
    return value


def _mapping(value: object, path: KeyPath) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise _refused(f"{brief(value)} is not a mapping", path)
    return cast("Mapping[str, Any]", value)


def _list(value: object, path: KeyPath) -> list[object]:
    if not isinstance(value, list):
        raise _refused(f"{brief(value)} is not a list", path)
    return cast("list[object]", value)


def _word(value: object, pattern: re.Pattern[str], path: KeyPath) -> str:
    if not isinstance(value, str) or not pattern.fullmatch(value):
        raise _refused(f"{brief(value)} is not a name", path)
    return value


def _refused(reason: str, path: KeyPath) -> MalformedMessage:
    return MalformedMessage(reason, type_name="type description", path=path)
