"""Pieces of Python source: literals, docstrings, import statements, as a formatter leaves them."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Mapping

WIDTH = 120
"""The most characters of a line."""
_INDENT = "    "
_DIGITS = re.compile(r"(\d+)")


def literal(value: object) -> str:
    """Return a value as source, text in double quotes.

    >>> print(literal("it's"), literal(0.5))
    "it's" 0.5
    """
    text = repr(value)
    if isinstance(value, str) and text.startswith("'") and '"' not in text:
        return f'"{text[1:-1]}"'
    return text


def docstring(text: str, depth: int) -> list[str]:
    """Return the lines of a docstring at a depth of indentation; long lines are wrapped."""
    indent = _INDENT * depth
    safe = text.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
    if "\n" not in safe and len(indent) + len(safe) + 6 <= WIDTH and not safe.endswith('"'):
        return [f'{indent}"""{safe}"""']
    first, _, others = safe.partition("\n")
    rest = textwrap.dedent(others).split("\n")  # what indents all of them a formatter takes away
    lines = [
        *_wrapped(first, WIDTH - len(indent) - 3),
        *(part for line in rest for part in _wrapped(line, WIDTH - len(indent))),
    ]
    lines[0] = f'"""{lines[0]}'
    return [f"{indent}{line}".rstrip() for line in [*lines, '"""']]


def from_import(module: str, names: Iterable[str]) -> list[str]:
    """Return a `from … import …`, over several lines where it is long."""
    ordered = sorted(names, key=sort_key)
    line = f"from {module} import {', '.join(ordered)}"
    if len(line) <= WIDTH:
        return [line]
    return [f"from {module} import (", *(f"{_INDENT}{name}," for name in ordered), ")"]


def all_names(names: Iterable[str]) -> list[str]:
    """Return the `__all__` of a module."""
    ordered = [f'"{name}"' for name in sorted(names, key=sort_key)]
    line = f"__all__ = [{', '.join(ordered)}]"
    return [line] if len(line) <= WIDTH else ["__all__ = [", *(f"{_INDENT}{name}," for name in ordered), "]"]


def imports(modules: Mapping[str, Iterable[str]]) -> list[str]:
    """Return import statements in the three groups that sorters of imports make."""
    groups: tuple[list[str], ...] = ([], [], [])
    for module in sorted(modules, key=lambda each: (each.startswith("."), each)):
        group = 2 if module.startswith(".") else 1 if module.startswith("busflow") else 0
        groups[group].extend(from_import(module, modules[module]))
    return [line for group in groups if group for line in (*group, "")]


def sort_key(name: str) -> tuple[object, ...]:
    """Return the order of names in an import: constants, classes, others; numbers by their value."""
    kind = 0 if name.isupper() and len(name) > 1 else 1 if name[:1].isupper() else 2
    return (kind, *((int(part), "") if part.isdigit() else (-1, part) for part in _DIGITS.split(name)))


def _wrapped(line: str, width: int) -> list[str]:
    if len(line) <= width:
        return [line]
    indent = line[: len(line) - len(line.lstrip())]
    found = textwrap.wrap(
        line.strip(),
        width,
        initial_indent=indent,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return found or [""]
