"""The constructors of message classes, each written for its class, so that plain values need no detour.

To make a message of values that already are what it will hold, it is enough to see that they are: that takes half the
time of pydantic's general way. A value that has to be converted is, one by one. Whatever is not taken here goes
pydantic's way, which says what is wrong with it: both ways accept the same and make the same message.
"""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from busflow.annotation import at
from busflow.errors import Fault, InvalidMessage
from busflow.fields import PRIMITIVES, ArrayKind, FieldType, Primitive, round_float32
from busflow.source import Source, word
from busflow.text import did_you_mean
from busflow.validation import MOST_FAULTS, dotted, located

MISSING: Any = object()
"""Stands for a field that was not given and has no default."""
_set_class: Any = vars(object)["__class__"].__set__


def fill(message: BaseModel, data: Mapping[str, Any]) -> None:
    """Make a new message hold `data`, pydantic's way.

    Raises:
        InvalidMessage: with everything that is wrong with `data`.
    """
    given = {name: value for name, value in data.items() if value is not MISSING}
    try:
        message.__pydantic_validator__.validate_python(given, self_instance=message)
    except ValidationError as error:
        cls = type(message)
        errors = error.errors(include_url=False)[:MOST_FAULTS]
        raise InvalidMessage(cls.__name__, [_fault(each, errors, cls, given) for each in errors]) from None


def fill_with(message: BaseModel, /, **data: Any) -> None:
    """The constructor of a class that has rules of its own, or fields that ROS cannot describe."""
    fill(message, data)


def constructor(cls: type[BaseModel], fields: Sequence[FieldType]) -> Callable[..., None]:
    """An `__init__` for `cls`, which has these fields, in this order, and no rules beyond their types."""
    source = Source()
    give = source.give
    # A field may have any name but one that begins with an underscore: those are the function's own.
    defaults = {each.name: give(MISSING if each.default is None else each.default) for each in fields}
    source.add("if not _unknown:", "    try:")
    source.indent(2)
    for each in fields:
        source.add(*_checked(each, defaults[each.name], give))
    source.add("pass")
    source.indent(-1)
    source.add(f"except {give((ValueError, TypeError))}:", "    pass", "else:")
    source.indent(1)
    source.add(f"{give(_set_class)}(_message, {give(blank())})")
    source.add(*(f"_message.{word(each.name)} = {each.name}" for each in fields))
    source.add(*finished("_message", give(cls), give(set(defaults))))
    source.add("return")
    source.indent(-2)
    given = "".join(f"{each!r}: {each}, " for each in defaults)
    source.add(f"{give(fill)}(_message, {{{given}**_unknown}})")
    arguments = ", ".join(f"{each}={default}" for each, default in defaults.items())
    return source.function(f"_message, /, *, {arguments}, **_unknown" if fields else "_message, /, **_unknown")


def blank() -> type[BaseModel]:
    """The class of what becomes a message of some class.

    A frozen model refuses to have its attributes set. A blank takes them at the full speed of Python, being plain and
    having them in one order always, and then changes its class: half the time of filling a message in any other way.
    """

    class Blank(BaseModel):
        __setattr__ = object.__setattr__
        __delattr__ = object.__delattr__  # or else Python would not take the above for plain

    return Blank


def finished(message: str, cls: str, given: str) -> tuple[str, ...]:
    """The lines that make a filled blank a message of `cls`, of which pydantic is told that these fields were given."""
    return (
        f"{message}.__pydantic_fields_set__ = {given}",
        f"{message}.__pydantic_extra__ = None",
        f"{message}.__class__ = {cls}",
    )


def has_rules(cls: type[BaseModel], plain: type[BaseModel]) -> bool:
    """Whether messages of the class obey more than the types of their fields, unlike those of the class `plain`."""
    known: Any = cls
    decorators = known.__pydantic_decorators__
    return bool(
        decorators.validators
        or decorators.field_validators
        or decorators.root_validators
        or decorators.model_validators
        or known.__private_attributes__
        or cls.model_post_init is not plain.model_post_init
        or cls.model_config != plain.model_config
        or cls.__basicsize__ != plain.__basicsize__
        or any(field.validation_alias is not None for field in cls.model_fields.values())
        or any(type(rule) is not FieldType for field in cls.model_fields.values() for rule in field.metadata)
    )


def _checked(field: FieldType, default: str, give: Callable[[Any], str]) -> tuple[str, ...]:
    """The lines that see whether an argument is what the field holds, and otherwise make it that or raise."""
    name, kind = word(field.name), f"{give(type)}({field.name})"
    primitive = PRIMITIVES[field.base] if isinstance(field.base, str) else None
    if field.array is not ArrayKind.NONE:
        array = primitive is not None and primitive.dtype is not None
        check = cast("Primitive", primitive).array_check(field.array, field.size) if array else _items_check(field)
        convert = f"{name} = {give(check)}({name})"
        return (convert,) if field.default is None else (f"if {name} is not {default}:", f"    {convert}")
    if primitive is None:
        return f"if {kind} is not {give(field.base)}:", f"    {name} = {give(_stamp)}({name}, {give(field.base)})"
    check = give(_text_check(field.string_bound) if primitive.python is str else primitive.check)
    if primitive.name == "float32":
        return (f"{name} = {give(round_float32)}({name}) if {kind} is {give(float)} else {check}({name})",)
    unlike = f"{kind} is not {give(primitive.python)}"
    if primitive.python is int:
        unlike += f" or not {primitive.low} <= {name} <= {primitive.high}"
    elif primitive.python is str:
        unlike += f" or not {name}.isascii()" if field.string_bound is None else " or True"
    return f"if {unlike}:", f"    {name} = {check}({name})"


def _text_check(bound: int | None) -> Callable[[Any], str]:
    def check(value: Any) -> str:
        if type(value) is not str or (bound is not None and len(value) > bound):
            raise ValueError
        value.encode()  # there is text that UTF-8 cannot express
        return value

    return check


def _items_check(field: FieldType) -> Callable[[Any], tuple[Any, ...]]:
    """What makes a tuple of what is given for a sequence of texts or messages."""
    text = None if isinstance(field.base, type) else _text_check(field.string_bound)
    kind = field.base if isinstance(field.base, type) else str
    least = field.size if field.array is ArrayKind.FIXED else 0

    def check(value: Any) -> tuple[Any, ...]:
        right = type(value) in (list, tuple) and [*map(type, value)].count(kind) == len(value)
        if not right or len(value) < least or len(value) > (field.size or len(value)):
            raise ValueError
        if text is not None:
            text("".join(value)) if field.string_bound is None else [*map(text, value)]
        return tuple(value)

    return check


def _fault(error: ErrorDetails, errors: Sequence[ErrorDetails], cls: type[BaseModel], data: object) -> Fault:
    """One of the errors that pydantic found, in words."""
    path, value = located(error, errors, cls, data)
    name, kind, reason = dotted(path), error["type"], error["msg"]
    if kind == "extra_forbidden":
        parent, _ = at(cls, path[:-1])
        known = parent.model_fields if isinstance(parent, type) and issubclass(parent, BaseModel) else ()
        return Fault(path, f"unknown field {name}", did_you_mean(str(path[-1]), known), "unknown")
    if kind == "missing":
        return Fault(path, f"the field {name} is required", f"write {path[-1]}=…", "missing")
    if kind in ("value_error", "assertion_error"):
        reason = str(error.get("ctx", {})["error"])
        return Fault(path, f"{name}: {reason}" if name else reason)
    if reason.startswith("Input should be "):
        return Fault(path, f"{name} must be {reason[16:]}, got {reprlib.repr(value)}", None, "type")
    return Fault(path, f"{name}: {reason[:1].lower()}{reason[1:].replace(' should ', ' must ')}")


def _stamp(value: Any, message: type[BaseModel]) -> Any:
    """The message that a clock's time or duration makes of itself, where the field takes such."""
    made = value.to_msg() if getattr(message, "__takes_to_msg__", False) and hasattr(value, "to_msg") else None
    if type(made) is not message:
        raise ValueError
    return made
