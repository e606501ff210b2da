"""Code lines: the lines of a file with code on them, without blank lines, comments and docstrings.

`.ci/cost` prints them, and `tests/test_structure.py` compares them with `[tool.busflow.budget]` of pyproject.toml.
"""

import ast
from collections.abc import Iterable
from functools import cache, lru_cache
from pathlib import Path

PROJECT = Path(__file__).parents[1]
BESIDE = {
    "ui": ("ui/*.py", "ui/busflow_ui/**/*.py", "ui/page/src/**/*.ts", "ui/page/src/**/*.tsx"),
    "assistant": ("assistant/busflow_assistant/**/*.py", "assistant/tools/**/*.py"),
    "tests": ("tests/**/*.py",),
}
"""The files of each row of the budget outside of `busflow/`."""
DATA = PROJECT / "tests/cases"
"""Facts from elsewhere, and files of released versions, which count for nothing."""


@lru_cache(1)  # many trees at once slow down Python's garbage collection
def tree(path: Path) -> ast.Module:
    """Return the syntax tree of a module."""
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def code_lines(path: Path) -> dict[int, str]:
    """Return the lines of code by their numbers; of TypeScript, a line of a block comment begins with `*`."""
    text = path.read_text(encoding="utf-8")
    marks = "#" if path.suffix.startswith(".py") else ("//", "/*", "*")
    every = dict(enumerate(text.splitlines(), 1))
    lines = {number: line for number, line in every.items() if line.strip() and not line.lstrip().startswith(marks)}
    docstrings: set[int] = set()
    for node in ast.walk(tree(path)) if path.suffix.startswith(".py") else ():
        if isinstance(node, ast.JoinedStr | ast.Constant) and node.end_lineno != node.lineno:
            lines |= {number: every[number] for number in range(node.lineno, (node.end_lineno or 0) + 1)}
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            docstrings.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return {number: line for number, line in lines.items() if number not in docstrings}


def rows() -> dict[str, list[Path]]:
    """Return the files of each row of the budget; `root` has the modules directly in `busflow/`."""
    found = {"root": sorted(PROJECT.glob("busflow/*.py*"))}  # also stubs, `.pyi`
    for package in sorted(PROJECT.glob("busflow/*/__init__.py")):
        found[package.parent.name] = sorted(each for end in ("py", "pyi") for each in package.parent.rglob(f"*.{end}"))
    for row, patterns in BESIDE.items():
        paths = (path for pattern in patterns for path in PROJECT.glob(pattern) if ".test." not in path.name)
        found[row] = sorted(path for path in paths if DATA not in path.parents)
    return {row: paths for row, paths in found.items() if paths}  # a source distribution has busflow's own alone


def total(paths: Iterable[Path]) -> int:
    """Return the number of code lines of all these files."""
    return sum(len(code_lines(path)) for path in paths)
