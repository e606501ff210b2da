"""Arguments of a launch file: their declarations, their given values, and the checks of these."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, cast

from pydantic import ValidationError, create_model

from busflow.errors import Fault, LaunchError, Problem
from busflow.launchfile.load.resolver import Resolver
from busflow.launchfile.model.keys import ArgumentKeys
from busflow.launchfile.model.problems import Problems, key_origin, problem_at
from busflow.launchfile.model.problems import problems as located
from busflow.launchfile.yaml.document import parse_value
from busflow.launchfile.yaml.value import Origin, StatedBy, Value, on_command_line
from busflow.text import did_you_mean
from busflow.validation.annotations import Bounds, StrictModel
from busflow.validation.durations import UNITS_NS
from busflow.validation.faults import faults, shown

_TYPES: dict[str, Any] = {"float": float, "int": int, "bool": bool, "str": str}


@dataclass(frozen=True, slots=True)
class Argument:
    """One argument of a launch file, as it is declared, and its value."""

    name: str
    keys: ArgumentKeys
    default: Value | None
    """The value where none is given; None if one must be given."""
    value: Value


@dataclass(slots=True)
class Arguments:
    """Arguments of one file."""

    known: dict[str, Argument] = field(default_factory=dict[str, Argument])
    broken: set[str] = field(default_factory=set[str])
    """Arguments with a missing or wrong value, which is reported already."""

    @property
    def values(self) -> dict[str, Value]:
        """Values of `args.…` in expressions."""
        return {name: argument.value for name, argument in self.known.items()}


def bind(declared: Value | None, given: Mapping[str, Value], resolver: Resolver) -> Arguments:
    """Return the arguments with their values: the given one, else the default.

    Args:
        declared: The file's `args:`; wrong keys in it are reported elsewhere.
        given: Values from the command line (still text), a caller, or the `include` entry of another file.
        resolver: Resolves the defaults, which may use environment variables.
    """
    found = Arguments()
    entries: Mapping[str, Value] = declared.members if declared is not None else {}
    for name, value in given.items():
        if name not in entries:
            fix = did_you_mean(name, entries, none="leave it out, or declare it below `args:`")
            origin = key_origin(value)
            resolver.problems.add(problem_at("unknown-argument", f"unknown argument {name}", fix, origin))
    for name, entry in entries.items():
        try:
            keys = ArgumentKeys.model_validate(entry.data)
        except ValidationError:
            found.broken.add(name)
        else:
            _bind(found, name, entry, keys, given.get(name), resolver)
    return found


def _bind(
    found: Arguments, name: str, entry: Value, keys: ArgumentKeys, given: Value | None, resolver: Resolver
) -> None:
    default = entry.members.get("default")
    if default is not None and default.content is None:
        default = None
    if default is not None:
        path = ("args", name, "default")
        default = resolver.resolve(default, path, as_text=keys.type == "str")
        if path in resolver.failed:
            found.broken.add(name)
            return
    stated = given if given is not None else default
    argument = Argument(name, keys, default, Value(None, key_origin(entry)))
    found.known[name] = argument
    if stated is None:
        included = entry.origin.included_from
        fix = f"add `{name}:` to the `args` of the include" if included else f"add {name}:=<{keys.type}> to the command"
        message = f"the argument {name} has no value"
        resolver.problems.add(problem_at("missing-argument", message, fix, key_origin(entry)), left_out=())
        found.broken.add(name)
        return
    value, wrong = _typed(argument, stated)
    found.known[name] = replace(argument, value=value)
    if wrong:
        resolver.problems.add(*wrong, left_out=())
        found.broken.add(name)


def _typed(argument: Argument, stated: Value) -> tuple[Value, list[Problem]]:
    """Return a value as the argument's type, and its problems."""
    origin = stated.origin
    if origin.source is StatedBy.COMMAND_LINE and origin.place is not None:
        before = origin.place.excerpt[: origin.place.column - 1]
        try:
            text = argument.keys.type == "str"
            stated = parse_value(str(stated.content), origin.place.file, before, as_text=text)
        except LaunchError as error:
            return stated, list(error.problems)
    model, data = _model(argument.keys.type), {"value": stated.data}
    try:
        value: Any = model.model_validate(data).model_dump()["value"]
    except ValidationError as error:
        found = faults(error, model, data, noun="argument")
        named = [
            replace(each, path=each.path[1:], message=f"argument {argument.name}{each.message[5:]}") for each in found
        ]
        return stated, located(named, stated, noun="argument")
    wrong = located(_outside(argument, stated.data), stated, noun="argument")
    return (stated if isinstance(value, list) else replace(stated, content=value)), wrong


@cache
def _model(kind: str) -> type[StrictModel]:
    annotation = list[_TYPES[kind[5:-1]]] if kind.startswith("list") else _TYPES[kind]
    return create_model("Argument", __base__=StrictModel, value=(annotation, ...))


def _outside(argument: Argument, value: Any) -> Iterator[Fault]:
    """Yield a fault for each item outside the argument's choices or range."""
    keys = argument.keys
    bounds = Bounds(keys.min, keys.max)
    items = cast("list[Any]", value if isinstance(value, list) else [value])
    for index, item in enumerate(items):
        path = (index,) if isinstance(value, list) else ()
        name = f"argument {argument.name}[{index}]" if path else f"argument {argument.name}"
        if keys.choices is not None and item not in keys.choices:
            allowed = ", ".join(str(each) for each in keys.choices)
            fix = did_you_mean(str(item), map(str, keys.choices))
            yield Fault(path, f"{name} must be one of {allowed}, got {shown(item)}", fix, "choice")
        below = bounds.minimum is not None and not item >= bounds.minimum
        if below or (bounds.maximum is not None and not item <= bounds.maximum):
            yield Fault(path, f"{name} must be {bounds}, got {shown(item)}", None, "range")


def from_caller(args: Mapping[str, object]) -> dict[str, Value]:
    """Return the arguments that Python code passes."""
    return {name: Value.of(data, Origin(StatedBy.CALLER)) for name, data in args.items()}


def from_command_line(assignments: Iterable[str], problems: Problems) -> dict[str, Value]:
    """Return the arguments of `name:=value` texts; their values are still text."""
    given: dict[str, Value] = {}
    for text in assignments:
        name, sign, value = text.partition(":=")
        key = on_command_line(text, 0, len(name))
        if not sign or not name.strip():
            fix = "write name:=value, for instance rate_hz:=50"
            if text in UNITS_NS:
                fix = f"write the duration without a space: 5{text}"
            elif text.isidentifier():  # as behind the package in `ros2 run`
                fix += f"; busflow run --plugin {text} runs a plugin without a file"
            problems.add(Problem("bad-argument", "this is not an argument", fix, on_command_line(text, 0, len(text))))
            continue
        if name.strip() in given:
            message = f"the argument {name.strip()} is given twice"
            problems.add(Problem("duplicate-argument", message, "leave one of them out", key), left_out=())
        place = on_command_line(text, len(name) + 2, len(value))
        given[name.strip()] = Value(value, Origin(StatedBy.COMMAND_LINE, place), key)
    return given
