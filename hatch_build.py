"""The build hook: writes busflow's own message types, as their sources declare them, into a file beside their reader.

So the command line knows them without importing pydantic and numpy, and the build needs neither. The file is written
into the source tree, where an editable install and a plain checkout find it too.
"""

from __future__ import annotations

import ast
import json
import sys
from itertools import pairwise
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
    default_text,
    individual,
    written,
)

_PARTS = ("Request", "Response")
_WORDS = {"bool": "bool", "str": "string", "int": "int64", "float": "float64"}


class CustomBuildHook(BuildHookInterface[Any]):
    """Puts the file into the wheel; an editable install reads it where it was written."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002  # of the interface
        """Write the file before the wheel's files are collected."""
        text = json.dumps(described(SOURCES))
        inside = DATA.relative_to(ROOT).as_posix()
        try:
            _replace(DATA, text)
            build_data["artifacts"].append(f"/{inside}")
        except OSError:  # the source tree can only be read: the wheel has the file all the same
            made = Path(self.directory, DATA.name)
            _replace(made, text)
            build_data["force_include"][str(made)] = inside

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:  # noqa: ARG002  # of the interface
        """Remove what was written beside the wheel."""
        Path(self.directory, DATA.name).unlink(missing_ok=True)


def described(sources: Path) -> dict[str, Any]:
    """Every type below a folder: its fields, its comments, and what the sources were."""
    types: dict[str, ast.ClassDef] = {}
    services: dict[str, str] = {}
    for path in sorted(sources.rglob("*.py")):
        for statement in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(statement, ast.ClassDef):
                _collect(statement, types, services)
    return {
        "sources": fingerprint(sources),
        "types": {name: _description(name, declared, types) for name, declared in types.items()},
        "comments": {name: _comments(declared) for name, declared in types.items()}
        | {name: {"text": text, "fields": {}} for name, text in services.items()},
        "services": sorted(services),
    }


def _collect(declared: ast.ClassDef, types: dict[str, ast.ClassDef], services: dict[str, str]) -> None:
    """Add a message, or a service and its two halves."""
    package = next((ast.literal_eval(each.value) for each in declared.keywords if each.arg == "package"), None)
    if package is None:
        return
    if any(ast.unparse(base) == "Message" for base in declared.bases):
        types[f"{package}/msg/{declared.name}"] = declared
        return
    service = f"{package}/srv/{declared.name}"
    services[service] = ast.get_docstring(declared) or ""
    for part in declared.body:
        if isinstance(part, ast.ClassDef) and part.name in _PARTS:
            types[f"{service}_{part.name}"] = part


def _description(name: str, declared: ast.ClassDef, types: dict[str, ast.ClassDef]) -> IndividualDescription:
    annotated = [each for each in declared.body if isinstance(each, ast.AnnAssign)]
    statements = [each for each in annotated if not ast.unparse(each.target).startswith("_")]
    return individual(
        name,
        [_field(each, name, types).describe() for each in statements if not _is_constant(each)],
        [
            {"name": ast.unparse(each.target), "type": _constant_type(each), "value": written(_value(each))}
            for each in statements
            if _is_constant(each)
        ],
    )


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


def _field(statement: ast.AnnAssign, around: str, types: dict[str, ast.ClassDef]) -> Field:
    word, count, size = _shape(ast.unparse(statement.annotation))
    name = ast.unparse(statement.target)
    base = _WORDS.get(word, word)
    if base in PRIMITIVES:
        default = default_text(_value(statement), name, around)
        return Field(name, base, count=count, size=size, default=default)
    return Field(name, _full_name(word, around, types), nested=True, count=count, size=size)


def _full_name(word: str, around: str, types: dict[str, ast.ClassDef]) -> str:
    """The full name of a message within another: of the same package, or of the one that has it."""
    own = f"{around.partition('/')[0]}/msg/{word}"
    return own if own in types else next(name for name in sorted(types) if name.endswith(f"/msg/{word}"))


def _shape(annotation: str) -> tuple[str, Count, int]:
    """What one value of a field is, and how many of them it holds."""
    tree = ast.parse(annotation, mode="eval").body
    if isinstance(tree, ast.Subscript) and ast.unparse(tree.value) == "Annotated":
        inner, length = cast("ast.Tuple", tree.slice).elts
        call = cast("ast.Call", length)
        count = Count.FIXED if call.args else Count.BOUNDED  # Length(9), Length(max=1)
        (size,) = [*call.args, *(each.value for each in call.keywords)]
        return _shape(ast.unparse(inner))[0], count, ast.literal_eval(size)
    if isinstance(tree, ast.Subscript):  # Sequence[…]
        return ast.unparse(tree.slice), Count.UNBOUNDED, 0
    if annotation.endswith("Array") and annotation.removesuffix("Array").lower() in PRIMITIVES:
        return annotation.removesuffix("Array").lower(), Count.UNBOUNDED, 0
    return annotation, Count.ONE, 0


def _is_constant(statement: ast.AnnAssign) -> bool:
    return ast.unparse(statement.annotation).startswith("ClassVar[")


def _constant_type(statement: ast.AnnAssign) -> str:
    word = ast.unparse(cast("ast.Subscript", statement.annotation).slice)
    return _WORDS.get(word, word)


def _value(statement: ast.AnnAssign) -> Any:
    """A default, or a constant, that is written out; None for what has to be constructed: zeros(9), Header()."""
    try:
        return ast.literal_eval(statement.value) if statement.value is not None else None
    except ValueError:
        return None


def _replace(path: Path, text: str) -> None:
    """Write a file all at once, and only if it is another one: others may read it now."""
    if path.is_file() and path.read_text("utf-8") == text:
        return
    part = path.with_suffix(".part")
    part.write_text(text, "utf-8")
    part.replace(path)
