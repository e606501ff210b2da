"""`Message`: a frozen pydantic model of ROS field types, which topics carry; a service is a pair of them.

Equality compares values, arrays too, and NaN equals NaN, so that what was recorded can be compared with what
was replayed. A message cannot change, therefore it is handed to every subscriber by reference.
"""

from __future__ import annotations

import importlib
import pkgutil
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self, cast, dataclass_transform, get_args, get_origin, get_type_hints

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler
from pydantic.errors import PydanticSchemaGenerationError, PydanticUndefinedAnnotation
from pydantic_core import CoreSchema

from busflow.errors import Fault, InvalidDeclaration, InvalidMessage, UnknownType
from busflow.interfaces import arrays
from busflow.interfaces import field_types as aliases
from busflow.interfaces.arrays import array, take, zeros
from busflow.interfaces.constructor import constructor, late_maker, plain_fields
from busflow.interfaces.field_types import *  # noqa: F403 - its __all__ is the list of the field words
from busflow.interfaces.fields import ArrayKind, FieldType, Length, Primitive, understand
from busflow.text import did_you_mean, printable, quoted
from busflow.validation.annotations import refuse_bare
from busflow.validation.as_written import written_annotations

__all__ = [
    "ArrayKind",
    "Constant",
    "FieldType",
    "Length",
    "Message",
    "ServiceType",
    "array",
    "constants_of",
    "fields_of",
    "find_type",
    "is_ros_type",
    "take",
    "type_name",
    "zeros",
]
__all__ += aliases.__all__

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass

    @dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(Field,))
    class _Frozen(ModelMetaclass): ...

else:
    _Frozen = type(BaseModel)

_FIELD_NAME = re.compile(r"[a-z](_?[a-z0-9])*")
_CONSTANT_NAME = re.compile(r"[A-Z](_?[A-Z0-9])*")
_TYPE_NAME = re.compile(r"[A-Z][A-Za-z0-9]*")
_PACKAGE_NAME = re.compile(r"[a-z](_?[a-z0-9])*")
_CLASS_VARIABLE = re.compile(r"([\w.]+\.)?_?ClassVar\b(?!\.)")
_SHOWN = 12
"""Longer sequences are cut short when a message is printed."""


class Message(BaseModel, metaclass=_Frozen):
    """A value that travels on a topic. Subclasses declare its fields in ROS field types.

    The type's name is `package/msg/Class`. The package is the one given, else the installed package that
    the class belongs to, the folder around its plugin folder, or the name of the script. A field that ROS has no
    word for (optional, a union, a dict) is pydantic's to check, and the message then travels as JSON.

    >>> class Balance(Message, package="my_robot"):
    ...     value: float = 0.0
    ...     side: str = ""
    >>> type_name(Balance)
    'my_robot/msg/Balance'
    >>> Balance(value=1).replace(side="left")
    Balance(value=1.0, side='left')
    """

    model_config: ClassVar[ConfigDict] = ConfigDict(
        frozen=True,
        extra="forbid",
        ser_json_inf_nan="constants",
        defer_build=True,  # until pydantic is asked for more than the fields: most classes of a package never are
    )

    if TYPE_CHECKING:  # pydantic would evaluate these annotations again for each subclass
        __ros_name__: ClassVar[str]
        __ros_fields__: ClassVar[Mapping[str, FieldType | None]]
        __ros_constants__: ClassVar[tuple[Constant, ...]]
        __of_keys__: ClassVar[Callable[..., Message]]  # what makes one within another message, of the keys of a dict

    def __init_subclass__(cls, *, package: str | None = None, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        refuse_bare(cls)
        outer = cls.__qualname__.rpartition(".")[0]
        if cls.__name__ in ("Request", "Response") and outer and not outer.endswith("<locals>"):
            cls.__ros_name__ = cls.__qualname__  # the service around it gives it its name
        else:
            cls.__ros_name__ = full_name(cls, "msg", package)
        for name, annotation in written_annotations(cls).items():
            if not _is_class_variable(annotation) and not name.startswith("_"):
                _check_field_name(cls, name)

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        if not cls.model_config.get("frozen") or cls.model_config.get("extra") != "forbid":
            raise InvalidDeclaration(f"{cls.__name__}: every message is frozen, without unknown fields")
        if is_complete := cls.__pydantic_fields_complete__:
            _set_fields(cls)
        try:
            if not is_complete or plain_fields(cls, Message) is None:
                cls.model_rebuild()
        except PydanticUndefinedAnnotation as error:
            raise InvalidDeclaration(
                f"{cls.__name__}: {error.name!r} in an annotation is not known when the class is created; "
                "define or import it before, and not under TYPE_CHECKING alone"
            ) from None
        cls.__ros_constants__ = tuple(_constants(cls))
        _set_constructor(cls)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler, /) -> CoreSchema:
        if "__ros_fields__" not in vars(cls):
            _set_fields(cls)
        try:
            return handler(source)
        except PydanticSchemaGenerationError as error:
            raise InvalidDeclaration(f"{cls.__name__}: {str(error).splitlines()[0]}") from None

    def replace(self, **changes: Any) -> Self:
        """Return a copy with other values in these fields, checked like a new message."""
        return type(self)(**{**self.__dict__, **changes})

    __replace__ = replace

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return the message itself, or `replace`: pydantic's own would let wrong values in."""
        copied = deepcopy(self) if deep else self
        return copied.replace(**update) if update else copied

    if not TYPE_CHECKING:  # pragma: no branch  # or else a type checker would believe in any attribute

        def __getattr__(self, name: str) -> Any:
            # What pydantic notes beside the values is the same for every message that was not made by pydantic; to
            # look it up on request costs nothing where a message is made.
            if name == "__pydantic_fields_set__":
                return set(self.__dict__)
            if name == "__pydantic_extra__":
                return None
            return super().__getattr__(name)

    def __setattr__(self, name: str, value: Any) -> None:
        if name.startswith("_"):  # a private attribute, or one of pydantic's own
            super().__setattr__(name, value)
        else:
            raise _unchangeable(self, name)

    def __delattr__(self, name: str) -> None:
        raise _unchangeable(self, name)

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Self:
        if is_ros_type(type(self)):
            return self
        return type(self)(**deepcopy(self.__dict__, memo))

    def __reduce__(self) -> tuple[Any, ...]:
        return _restore, (type(self), self.__dict__)

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return _same(self.__dict__, other.__dict__)

    def __hash__(self) -> int:
        raise TypeError(
            f"a message has no hash: {type(self).__name__} may hold arrays; "
            "use a tuple of the fields that matter as the key"
        )

    def __str__(self) -> str:
        return repr(self)

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        for name, value in super().__repr_args__():
            yield name, _shown(value)


class ServiceType:
    """A pair of messages, asked and answered; subclasses hold them as `Request` and `Response`.

    >>> class Reset(ServiceType, package="my_robot"):
    ...     class Request(Message):
    ...         hard: bool = False
    ...     class Response(Message):
    ...         success: bool = False
    >>> type_name(Reset), type_name(Reset.Request)
    ('my_robot/srv/Reset', 'my_robot/srv/Reset_Request')
    """

    Request: ClassVar[type[Message]]
    Response: ClassVar[type[Message]]
    __ros_name__: ClassVar[str]

    def __init_subclass__(cls, *, package: str | None = None, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.__ros_name__ = full_name(cls, "srv", package)
        name_parts(cls, ("Request", "Response"))


def name_parts(cls: type[Any], parts: Sequence[str]) -> None:
    """Name the messages inside a service or action type after it.

    Raises:
        InvalidDeclaration: one is missing, or is no message class.
    """
    for part in parts:
        message: Any = vars(cls).get(part)
        if not (isinstance(message, type) and issubclass(message, Message)):
            raise InvalidDeclaration(f"{cls.__name__} needs inside it `class {part}(Message): …`")
        message.__ros_name__ = f"{cls.__ros_name__}_{part}"


@dataclass(frozen=True, slots=True)
class Constant:
    """A named value that belongs to a message type."""

    name: str
    base: str
    value: bool | int | float | str
    above: int
    """The number of fields that stand above it."""


def type_name(cls: type[Message | ServiceType]) -> str:
    """Return the full name of a message or service type: `sensor_msgs/msg/Imu`."""
    if not hasattr(cls, "__ros_name__"):
        raise InvalidDeclaration(f"{cls!r} is not a message type; write one: class Balance(Message): …")
    return cls.__ros_name__


def shown_value(value: object) -> str:
    """Return what an error calls a value that should be a message of another type: its type, or its text."""
    if isinstance(value, Message):
        return type_name(type(value))
    text = repr(value)
    if isinstance(value, type) and issubclass(value, Message):
        text = f"the class {value.__qualname__}: write {value.__qualname__}()"
    return printable(text, limit=200)


def fields_of(cls: type[Message]) -> tuple[FieldType, ...]:
    """Return the fields of a message type in order, as ROS describes them.

    Raises:
        InvalidDeclaration: ROS has no word for one of them; such a message travels as JSON.
    """
    fields: list[FieldType] = []
    for name, field in cls.__ros_fields__.items():
        if field is None:
            annotation = cls.model_fields[name].annotation
            raise InvalidDeclaration(f"{type_name(cls)}: ROS has no type for {name}: {annotation}")
        fields.append(field)
    return tuple(fields)


def is_ros_type(cls: type[Message]) -> bool:
    """Return whether ROS can describe the message type and the types inside it."""
    return all(
        field is not None and (isinstance(field.base, str) or is_ros_type(cast("type[Message]", field.base)))
        for field in cls.__ros_fields__.values()
    )


def constants_of(cls: type[Message]) -> tuple[Constant, ...]:
    """Return the constants of a message type: its class variables of a ROS type, as in `OK: ClassVar[byte] = 0`."""
    return cls.__ros_constants__


def find_type(name: str) -> type[Message | ServiceType]:
    """Return the standard type of this name, `sensor_msgs/msg/Imu` or `sensor_msgs/Imu`; imports only its package.

    Raises:
        UnknownType: there is no such type.
    """
    packages = _standard_packages()
    package, _, rest = name.partition("/")
    if package not in packages:
        text = f"no type {quoted(name)}: no package {quoted(package)}; {did_you_mean(package, packages)}"
        raise UnknownType(text)
    module = importlib.import_module(f"busflow.msgs.{package}")
    kind, _, word = rest.rpartition("/")
    found = getattr(module, word) if word in module.__all__ else None
    if kind in module.__all__ and hasattr(getattr(module, kind), word):  # a class around types with others' names
        found = getattr(getattr(module, kind), word)
    if found is None or name not in (type_name(found), f"{package}/{word}"):
        raise UnknownType(f"no type {quoted(name)} in {package}; {did_you_mean(word, module.__all__)}")
    return found


@cache
def _standard_packages() -> list[str]:
    msgs = importlib.import_module("busflow.msgs")
    return [module.name for module in pkgutil.iter_modules(msgs.__path__)]


def _set_fields(cls: type[Message]) -> None:
    cls.__ros_fields__ = {name: _understood(cls, name) for name in cls.model_fields}


_set_fields(Message)


def _understood(cls: type[Message], name: str) -> FieldType | None:
    try:
        return understand(name, cls.model_fields[name])
    except InvalidDeclaration as error:
        raise InvalidDeclaration(f"{cls.__name__}.{name}: {error}") from None


def _set_constructor(cls: type[Message]) -> None:
    """Give the class an `__init__`; the first message of the class has one written for it."""
    if "__init__" in vars(cls):
        raise InvalidDeclaration(f"{cls.__name__} has an __init__; write a class method that makes one")

    def __init__(self: Message, /, *values: Any, **data: Any) -> None:  # noqa: N807 - it becomes that method
        _become_constructor(cls, constructor(cls, Message))
        self.__init__(*values, **data)

    _become_constructor(cls, __init__)
    cls.__of_keys__ = late_maker(cls, Message)


def _become_constructor(cls: type[Message], made: Any) -> None:
    # To pydantic it is as good as its own, and Python names it so where it is called with the wrong arguments.
    made.__pydantic_base_init__, made.__qualname__ = True, f"{cls.__name__}.__init__"
    cls.__init__ = made


def _constants(cls: type[Message]) -> Iterator[Constant]:
    """Yield the class variables whose annotation is a ROS type."""
    above = 0
    for name, annotation in written_annotations(cls).items():
        if name.startswith("_") or not _is_class_variable(annotation):
            above += name in cls.model_fields
            continue
        try:
            (hint,) = get_args(_evaluated(cls, name, annotation)) or (None,)
            primitive = next((each for each in getattr(hint, "__metadata__", ()) if isinstance(each, Primitive)), None)
            if primitive is not None:
                yield Constant(name, primitive.name, primitive.check(getattr(cls, name)), above)
        except (NameError, AttributeError, ValueError) as error:
            raise InvalidDeclaration(f"{cls.__name__}.{name}: {error}") from None
        if primitive is not None and not _CONSTANT_NAME.fullmatch(name):
            raise InvalidDeclaration(f"{cls.__name__}.{name}: ROS names a constant in upper case")


def _is_class_variable(annotation: Any) -> bool:
    """Return whether an annotation, or its text, is a `ClassVar`; a message type may have that name too."""
    if isinstance(annotation, str):
        return _CLASS_VARIABLE.match(annotation) is not None
    return (get_origin(annotation) or annotation) is ClassVar


def _evaluated(cls: type[Message], name: str, annotation: Any) -> Any:
    """Return the annotation of a class variable; its text is evaluated."""
    if not isinstance(annotation, str):
        return annotation
    # Only a class may have class variables, and one at a time shows which of them is not known.
    stand_in = type(cls.__name__, (), {"__annotations__": {name: annotation}, "__module__": cls.__module__})
    return get_type_hints(stand_in, include_extras=True)[name]


def _check_field_name(cls: type[Message], name: str) -> None:
    if not _FIELD_NAME.fullmatch(name):
        raise InvalidDeclaration(f"{cls.__name__}.{name}: ROS names a field in lower case, digits, single underscores")
    if hasattr(Message, name):
        raise InvalidDeclaration(f"{cls.__name__}.{name}: this is a method of every message; name the field otherwise")


def full_name(cls: type, kind: str, package: str | None) -> str:
    """Return `package/kind/Class`; raise an error that names the wrong part."""
    if not _TYPE_NAME.fullmatch(cls.__name__):
        raise InvalidDeclaration(f"{cls.__name__}: a message type is named in letters and digits, a capital first")
    given = _package_of(cls.__module__) if package is None else package
    if not _PACKAGE_NAME.fullmatch(given):
        raise InvalidDeclaration(
            f"{cls.__name__}: {given!r} cannot name a ROS package (a letter, then lower case, digits, single "
            f'underscores); write class {cls.__name__}(Message, package="my_robot")'
        )
    return f"{given}/{kind}/{cls.__name__}"


def _package_of(module_name: str) -> str:
    """Return the package that the types of a module belong to unless they say otherwise."""
    top = module_name.partition(".")[0]
    module = sys.modules.get(top)
    name = top
    if top == "__main__":
        spec, file = getattr(module, "__spec__", None), getattr(module, "__file__", None)
        path = Path(file).resolve() if file else Path("main")
        name = path.parent.name if path.stem == "__main__" else path.stem
        if spec is not None and spec.name != "__main__":
            name = spec.name.partition(".")[0]
    elif folder := next(iter(getattr(module, "__path__", ())), None):
        # A plugin folder stands in sys.modules under a name that is not its own.
        name = top if Path(folder).name == top else Path(folder).resolve().parent.name
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")


def _restore(cls: type[Message], values: dict[str, Any]) -> Message:
    """Return a checked message from pickled values, its arrays frozen again."""
    return cls(**values)


def _unchangeable(message: Message, name: str) -> InvalidMessage:
    fault = Fault((name,), f"{name} cannot change, a message is frozen", f"make a new one: message.replace({name}=…)")
    return InvalidMessage(type(message).__name__, [fault])


def _same(left: Any, right: Any) -> bool:
    """Return whether two values of a field are equal, NaN being equal to NaN."""
    if left is right:
        return True
    if isinstance(left, np.ndarray):
        return isinstance(right, np.ndarray) and arrays.same(cast("Any", left), cast("Any", right))
    if type(left) is type(right) and isinstance(left, dict):
        pairs = cast("dict[Any, Any]", left)
        return pairs.keys() == right.keys() and all(_same(each, right[key]) for key, each in pairs.items())
    if type(left) is type(right) and isinstance(left, tuple | list):
        items = cast("list[Any]", left)
        return len(items) == len(right) and all(map(_same, items, right))
    return bool(left == right or (left != left and right != right))  # NaN alone differs from itself


def _shown(value: Any) -> Any:
    """Return the text of a value in a printed message."""
    if isinstance(value, np.ndarray):
        numbers = cast("arrays.AnyArray", value)
        items = ", ".join(map(str, numbers[:_SHOWN].tolist()))
        return _Text(f"[{items}]" if len(numbers) <= _SHOWN else f"[{items}, … {len(numbers)} × {numbers.dtype}]")
    if isinstance(value, tuple):
        things = cast("tuple[Any, ...]", value)
        items = ", ".join(map(repr, things[:3]))
        return _Text(f"({items}, … {len(things)} items)") if len(things) > _SHOWN else things
    return value


class _Text(str):
    """Text that is printed unquoted."""

    __slots__ = ()
    __repr__ = str.__str__
