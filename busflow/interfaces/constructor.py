"""Constructors of message classes, each generated for its class.

For values that already have the right types, a check of these types is enough: that takes half the time of pydantic's
general way. Other values are converted one by one. A value that is not accepted here goes to pydantic, whose error says
what is wrong with it. Both ways accept the same values and make the same message.
"""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Mapping, Sequence
from operator import countOf
from typing import Any, cast

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from busflow.errors import Fault, InvalidMessage
from busflow.interfaces.codegen import FunctionSource, word
from busflow.interfaces.fields import PRIMITIVES, ArrayKind, FieldType, Primitive, round_float32
from busflow.interfaces.sequences import FieldTuple
from busflow.text import did_you_mean, printable
from busflow.validation.annotations import at
from busflow.validation.faults import MOST_FAULTS, dotted, located

MISSING: Any = object()
"""Stands for a field that was not given and has no default."""


def fill(message: BaseModel, data: Mapping[str, Any]) -> None:
    """Set the fields of a new message to `data`, which pydantic checks.

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


def fill_with(message: BaseModel, /, *values: object, **data: Any) -> None:
    """Construct a message of a class that has rules of its own, or fields that ROS cannot describe."""
    if values:
        refuse_nameless(message, values)
    fill(message, data)


def refuse_nameless(message: BaseModel, values: Sequence[object]) -> None:
    """Refuse values that are given without the names of their fields, as rclpy does, and say how they are written.

    Raises:
        TypeError: always.
    """
    cls = type(message)
    named = [
        f"{name}={printable(repr(value), limit=40)}" for name, value in zip(cls.model_fields, values, strict=False)
    ]
    raise TypeError(f"{cls.__name__} takes its fields by name: write {cls.__name__}({', '.join(named)})")


def constructor(cls: type[BaseModel], plain: type[BaseModel]) -> Callable[..., None]:
    """Return an `__init__` for `cls`, written for it where it has no more rules than the class `plain`."""
    if (fields := plain_fields(cls, plain)) is None:
        return fill_with
    source = FunctionSource()
    give = source.give
    # A field may have any name but one that begins with an underscore: those are the function's own.
    defaults = _defaults(fields, give)
    source.add("if _nameless:", f"    {give(refuse_nameless)}(_message, _nameless)")
    source.add("if not _unknown:", "    try:")
    source.indent(2)
    _check(source, fields, defaults)
    source.add("pass")
    source.indent(-1)
    source.add(f"except {give((ValueError, TypeError))}:", "    pass", "else:")
    source.indent(1)
    # A frozen model refuses to have its attributes set; its `__dict__` takes them. Python has made the message already,
    # and to change its class to a blank's and back costs more.
    source.add("_values = _message.__dict__", *(f"_values[{each!r}] = {each}" for each in defaults), "return")
    source.indent(-2)
    given = "".join(f"{each!r}: {each}, " for each in defaults)
    source.add(f"{give(fill)}(_message, {{{given}**_unknown}})")
    return source.function(f"_message, /, *_nameless, {_arguments(defaults)}**_unknown")


def late_maker(cls: type[BaseModel], plain: type[BaseModel]) -> Callable[..., Any]:
    """Generate the `maker` of `cls` when the first dict becomes a nested `cls`."""

    def of_keys(**data: Any) -> Any:
        known: Any = cls
        known.__of_keys__ = maker(cls, plain)
        return known.__of_keys__(**data)

    return of_keys


def maker(cls: type[BaseModel], plain: type[BaseModel]) -> Callable[..., Any]:
    """Return a function that makes a nested message of `cls` from a dict's keys, in half the time of calling the class.

    What it does not take raises ValueError or TypeError, and then pydantic says why.
    """
    if (fields := plain_fields(cls, plain)) is None:
        return cls
    source = FunctionSource()
    defaults = _defaults(fields, source.give)
    _check(source, fields, defaults)
    source.add(f"_message = {source.give(object.__new__)}({source.give(blank())})")
    source.add(*(f"_message.{word(each)} = {each}" for each in defaults))
    source.add(f"_message.__class__ = {source.give(cls)}", "return _message")
    return source.function(f"*, {_arguments(defaults)}" if defaults else "")


def plain_fields(cls: type[BaseModel], plain: type[BaseModel]) -> list[FieldType] | None:
    """Return the fields; None if ROS cannot describe all of them, or the class has rules beyond their types."""
    known: Any = cls
    fields = [*known.__ros_fields__.values()]
    return None if None in fields or has_rules(cls, plain) else fields


def _defaults(fields: Sequence[FieldType], give: Callable[[Any], str]) -> dict[str, str]:
    return {each.name: give(MISSING if each.default is None else each.default) for each in fields}


def _arguments(defaults: Mapping[str, str]) -> str:
    """Return the arguments with their defaults and a comma after each."""
    return "".join(f"{each}={default}, " for each, default in defaults.items())


def _check(source: FunctionSource, fields: Sequence[FieldType], defaults: Mapping[str, str]) -> None:
    for each in fields:
        source.add(*_checked(each, defaults[each.name], source.give))


def blank() -> type[BaseModel]:
    """Return a class for messages under construction.

    A frozen model refuses new attributes. A blank takes them at the full speed of Python, since it is plain and its
    attributes always have one order. Then its class is changed: the quickest way to make a new message.
    """

    class Blank(BaseModel):
        __setattr__ = object.__setattr__
        __delattr__ = object.__delattr__  # without it Python does not use the fast path for __setattr__

    return Blank


def has_rules(cls: type[BaseModel], plain: type[BaseModel]) -> bool:
    """Return whether the class has rules beyond the types of its fields; the class `plain` has none."""
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
    """Return the lines that check an argument of a field, and convert it or raise if it does not fit."""
    name, kind = word(field.name), f"{give(type)}({field.name})"
    primitive = PRIMITIVES[field.base] if isinstance(field.base, str) else None
    if field.array is not ArrayKind.NONE:
        array = primitive is not None and primitive.dtype is not None
        check = cast("Primitive", primitive).array_check(field.array, field.size) if array else _items_check(field)
        convert = f"{name} = {give(check)}({name})"
        return (convert,) if field.default is None else (f"if {name} is not {default}:", f"    {convert}")
    if primitive is None:
        message = give(field.base)
        made = f"{message}.__of_keys__(**{name}) if {kind} is {give(dict)} else {give(_stamp)}({name}, {message})"
        return f"if {kind} is not {message}:", f"    {name} = {made}"
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


def _items_check(field: FieldType) -> Callable[[Any], FieldTuple[Any]]:
    """Return a function that makes a tuple of the value given for a sequence of texts or messages."""
    text = None if isinstance(field.base, type) else _text_check(field.string_bound)
    kind = field.base if isinstance(field.base, type) else str
    least, most = field.size if field.array is ArrayKind.FIXED else 0, field.size

    known: tuple[object, FieldTuple[Any]] = (object(), FieldTuple())  # one tuple: other threads construct too

    def check(value: Any) -> FieldTuple[Any]:
        nonlocal known
        former, made = known
        if value is former:  # a tuple that was found right before, as of the names of joints
            return made
        given = cast("Any", type(value))
        if given not in (FieldTuple, tuple, list):
            raise ValueError
        count = len(value)
        if countOf(map(type, value), kind) < count or count < least or (most and count > most):
            raise ValueError
        made = value if given is FieldTuple else FieldTuple(value)
        if text is not None:
            text("".join(value)) if field.string_bound is None else [*map(text, value)]
            known = (made if given is list else value, made)
        return made

    return check


def _fault(error: ErrorDetails, errors: Sequence[ErrorDetails], cls: type[BaseModel], data: object) -> Fault:
    """Return the text of one error that pydantic found."""
    path, value = located(error, errors, cls, data)
    name, kind, reason = dotted(path), error["type"], error["msg"]
    if kind == "extra_forbidden":
        parent, _ = at(cls, path[:-1])
        known = parent.model_fields if isinstance(parent, type) and issubclass(parent, BaseModel) else ()
        fix = did_you_mean(str(path[-1]), known, none="leave it out: there are no fields")
        return Fault(path, f"unknown field {name}", fix, "unknown")
    if kind == "missing":
        return Fault(path, f"the field {name} is required", f"write {path[-1]}=…", "missing")
    if kind in ("value_error", "assertion_error"):
        reason = str(error.get("ctx", {})["error"])
        return Fault(path, f"{name}: {reason}" if name else reason)
    if reason.startswith("Input should be "):
        return Fault(path, f"{name} must be {reason[16:]}, got {reprlib.repr(value)}", None, "type")
    return Fault(path, f"{name}: {reason[:1].lower()}{reason[1:].replace(' should ', ' must ')}")


def _stamp(value: Any, message: type[BaseModel]) -> Any:
    """Return the message for a time or duration of a clock, if the field takes one."""
    made = value.to_msg() if getattr(message, "__takes_to_msg__", False) and hasattr(value, "to_msg") else None
    if type(made) is not message:
        raise ValueError
    return made
