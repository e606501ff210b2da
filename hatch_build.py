"""The build hook: writes busflow's own message types, as their sources declare them, into a file beside their reader.

So the command line knows them without importing pydantic and numpy, and the build needs neither. The file is written
into the source tree, where an editable install and a plain checkout find it too.
"""

from __future__ import annotations

import ast
import json
import sys
from collections.abc import Mapping
from itertools import pairwise, takewhile
from pathlib import Path
from typing import Any, cast

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ROOT = Path(__file__).parent
sys.path.insert(0, str(ROOT))  # busflow is not installed where it is built

from busflow.interfaces.encoding.builtin_types import DATA, SOURCES, fingerprint  # noqa: E402  # as above
from busflow.interfaces.encoding.description import (  # noqa: E402  # as above
    PRIMITIVES,
    Count,
    Field,
    IndividualDescription,
    array_text,
    constant,
    default_text,
    individual,
    written,
)

_KINDS = {"ServiceType": ("srv", ("Request", "Response")), "ActionType": ("action", ("Goal", "Result", "Feedback"))}
"""The folder and the parts of a service and of an action."""
_WORDS = {"bool": "bool", "str": "string", "int": "int64", "float": "float64"}


class CustomBuildHook(BuildHookInterface[Any]):
    """Puts the file into the wheel; an editable install reads it where it was written."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002  # of the interface
        """Write the file before the wheel's files are collected."""
        inside = DATA.relative_to(ROOT).as_posix()
        try:
            describe_messages()
            build_data["artifacts"].append(f"/{inside}")
        except OSError:  # the source tree can only be read: the wheel has the file all the same
            made = Path(self.directory, DATA.name)
            _replace(made, json.dumps(described(SOURCES)))
            build_data["force_include"][str(made)] = inside

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:  # noqa: ARG002  # of the interface
        """Remove what was written beside the wheel."""
        Path(self.directory, DATA.name).unlink(missing_ok=True)


def describe_messages() -> None:
    """Write the file into the source tree."""
    _replace(DATA, json.dumps(described(SOURCES)))


def described(sources: Path) -> dict[str, Any]:
    """Every type below a folder: its fields, its comments, and what the sources were."""
    types: dict[str, ast.ClassDef] = {}
    homes: dict[str, Mapping[str, str]] = {}
    wholes: dict[str, str] = {}
    for path in sorted(sources.rglob("*.py")):
        statements = ast.parse(path.read_text(encoding="utf-8")).body
        known = len(types)
        for statement in statements:
            if isinstance(statement, ast.ClassDef):
                _collect(statement, types, wholes)
        homes |= dict.fromkeys(list(types)[known:], _homes(statements))
    return {
        "sources": fingerprint(sources),
        "types": {name: _description(name, declared, homes[name]) for name, declared in types.items()},
        "comments": {name: _comments(declared) for name, declared in types.items()}
        | {name: {"text": text, "fields": {}} for name, text in wholes.items()},
        "services": sorted(name for name in wholes if "/srv/" in name),
        "actions": sorted(name for name in wholes if "/action/" in name),
    }


def _collect(declared: ast.ClassDef, types: dict[str, ast.ClassDef], wholes: dict[str, str]) -> None:
    """Add a message, or a service or an action and its parts."""
    package = next((ast.literal_eval(each.value) for each in declared.keywords if each.arg == "package"), None)
    if package is None:  # a class around types, as control_msgs has one
        for inner in declared.body:
            if isinstance(inner, ast.ClassDef):
                _collect(inner, types, wholes)
        return
    base = ast.unparse(declared.bases[0])
    if base == "Message":
        types[f"{package}/msg/{declared.name}"] = declared
        return
    kind, parts = _KINDS[base]
    whole = f"{package}/{kind}/{declared.name}"
    wholes[whole] = ast.get_docstring(declared) or ""
    for part in declared.body:
        if isinstance(part, ast.ClassDef) and part.name in parts:
            types[f"{whole}_{part.name}"] = part


def _homes(statements: list[ast.stmt]) -> Mapping[str, str]:
    """The package of each name that a module imports from one: `from busflow.msgs.std_msgs import Header`."""
    return {
        alias.name: statement.module.split(".")[2]
        for statement in statements
        if isinstance(statement, ast.ImportFrom) and statement.module and statement.module.startswith("busflow.msgs.")
        for alias in statement.names
    }


def _description(name: str, declared: ast.ClassDef, homes: Mapping[str, str]) -> IndividualDescription:
    annotated = [each for each in declared.body if isinstance(each, ast.AnnAssign)]
    statements = [each for each in annotated if not ast.unparse(each.target).startswith("_")]
    return individual(
        name,
        [_field(each, name, homes).describe() for each in statements if not _is_constant(each)],
        [
            constant(ast.unparse(each.target), _constant_type(each), written(_value(each)), _above(each, statements))
            for each in statements
            if _is_constant(each)
        ],
    )


def _above(statement: ast.AnnAssign, statements: list[ast.AnnAssign]) -> int:
    """The number of fields above a constant."""
    return sum(not _is_constant(each) for each in takewhile(lambda each: each is not statement, statements))


def _comments(declared: ast.ClassDef) -> dict[str, Any]:
    """The docstrings of a type and of its fields."""
    fields = {
        ast.unparse(statement.target): str(after.value.value)
        for statement, after in pairwise(declared.body)
        if isinstance(statement, ast.AnnAssign)
        and isinstance(after, ast.Expr)
        and isinstance(after.value, ast.Constant)
    }
    return {"text": ast.get_docstring(declared) or "", "fields": fields}


def _field(statement: ast.AnnAssign, around: str, homes: Mapping[str, str]) -> Field:
    word, count, size, bound = _shape(statement.annotation)
    name, value = ast.unparse(statement.target), _value(statement)
    base = _WORDS.get(word, word)
    if base in PRIMITIVES:
        stated = default_text(value, name, around) if count is Count.ONE else array_text(value or [], count)
        return Field(name, base, False, count, size, bound, stated)
    package, _, own = word.rpartition(".")
    home = package or homes.get(own) or around.partition("/")[0]
    return Field(name, f"{home}/msg/{own}", nested=True, count=count, size=size)


def _shape(annotation: ast.expr) -> tuple[str, Count, int, int]:
    """What one value of a field is, how many of them it holds, and the bound of a text."""
    if not isinstance(annotation, ast.Subscript):
        word = ast.unparse(annotation)
        single = word.removesuffix("Array").lower()
        return (
            (single, Count.UNBOUNDED, 0, 0)
            if word.endswith("Array") and single in PRIMITIVES
            else (word, Count.ONE, 0, 0)
        )
    if ast.unparse(annotation.value) != "Annotated":  # Sequence[…]
        word, _, _, bound = _shape(annotation.slice)
        return word, Count.UNBOUNDED, 0, bound
    inner, length = cast("ast.Tuple", annotation.slice).elts
    call = cast("ast.Call", length)
    (size,) = [ast.literal_eval(each) for each in [*call.args, *(each.value for each in call.keywords)]]
    word, count, _, bound = _shape(inner)
    if count is Count.ONE:
        return word, count, 0, size
    return word, Count.FIXED if call.args else Count.BOUNDED, size, bound  # Length(9), Length(max=1)


def _is_constant(statement: ast.AnnAssign) -> bool:
    return ast.unparse(statement.annotation).startswith("ClassVar[")


def _constant_type(statement: ast.AnnAssign) -> str:
    word = ast.unparse(cast("ast.Subscript", statement.annotation).slice)
    return _WORDS.get(word, word)


def _value(statement: ast.AnnAssign) -> Any:
    """A default, or a constant, that is written out; None for what has to be constructed: zeros(9), Header()."""
    value = statement.value
    if isinstance(value, ast.Call) and ast.unparse(value.func) == "array":
        value = value.args[0]
    try:
        return ast.literal_eval(value) if value is not None else None
    except ValueError:
        return None


def _replace(path: Path, text: str) -> None:
    """Write a file all at once, and only if it is another one: others may read it now."""
    if path.is_file() and path.read_text("utf-8") == text:
        return
    part = path.with_suffix(".part")
    part.write_text(text, "utf-8")
    part.replace(path)
