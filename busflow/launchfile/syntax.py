"""YAML's syntax errors in a launch file's words, each at the place where something can be done about it."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TypeAlias

import yaml

from busflow.errors import Place, Problem
from busflow.text import printable

PlaceAt: TypeAlias = Callable[[int, int, int | None], Place]
"""Line, column and width, all from 0, to a place."""

_EXPRESSION = re.compile(r"\$\{[^}\n]*\}?")
_MISALIGNED = ("expected <block end>", "did not find expected key", "did not find expected '-' indicator")
_LEFT_OVER = ("did not find expected <document start>", "expected '<document start>'")


def explain(error: yaml.MarkedYAMLError, text: str, place_at: PlaceAt) -> Problem:
    """What is wrong, said for someone who did not write a YAML parser."""
    mark = error.problem_mark or error.context_mark
    opened = error.context_mark
    if mark is None:
        return Problem("yaml", f"not valid YAML: {error.problem}")
    here = place_at(mark.line, mark.column, 1)
    problem, context = error.problem or "", error.context or ""
    found = text[mark.index : mark.index + 1]

    def said(message: str, fix: str | None = None, place: Place = here) -> Problem:
        return Problem("yaml", message, fix, place)

    if "parsing a flow" in context and opened is not None:
        return _in_flow(text, mark, place_at, place_at(opened.line, opened.column, 1))
    if "quoted scalar" in context and opened is not None and ("end of stream" in problem or "document" in problem):
        return said("this quote is never closed", None, place_at(opened.line, opened.column, 1))
    if "escape" in problem:
        return said(
            f"a double-quoted text has a wrong escape: {problem}",
            r"use single quotes, or write \\ for a backslash",
        )
    if "cannot start any token" in problem:
        if found == "\t":
            return said("a tab cannot indent", "indent with spaces")
        return said(f"a value cannot begin with {printable(found)!r}", "quote it")
    if "mapping values are not allowed" in problem:
        return said("a ':' cannot stand here", _without_colon(mark, place_at))
    if "could not find expected ':'" in problem:
        where = place_at(opened.line, opened.column, None) if opened is not None else here
        return said("a ':' is missing after this", "write `key: value`", where)
    if problem.startswith((*_MISALIGNED, *_LEFT_OVER)):
        if problem.startswith(_LEFT_OVER) or here.excerpt[: here.column - 1].strip():
            return said("this cannot follow what is before it", "quote the whole text if it is one")
        return said("this does not line up with what is around it", "indent it like its neighbours")
    return said(f"not valid YAML: {problem}")


def _without_colon(mark: yaml.Mark, place_at: PlaceAt) -> str:
    """What to do about a second ':', which is often the first one missing on the line before."""
    before = place_at(mark.line - 1, 0, None).excerpt if mark.line > 0 else ""
    if before.strip() and ":" not in before:
        return f"end line {mark.line} with a ':', or quote the text"
    here = place_at(mark.line, 0, None).excerpt
    if len(before) - len(before.lstrip()) < len(here) - len(here.lstrip()):
        return f"indent it like line {mark.line}, whose value is on that line, or quote the text"
    return "quote the text, or put a nested mapping on lines of its own, indented"


def _in_flow(text: str, mark: yaml.Mark, place_at: PlaceAt, opened: Place) -> Problem:
    """Something unexpected inside `{…}` or `[…]`."""
    dollar = mark.index - 1
    expression = _EXPRESSION.match(text, dollar) if dollar >= 0 else None
    if expression is not None:
        whole = expression.group()
        return Problem(
            "unquoted-expression",
            "an expression inside {…} or […] must be quoted",
            f'quote it: "{whole}"',
            place_at(mark.line, mark.column - 1, len(whole)),
        )
    here = place_at(mark.line, mark.column, 1)
    closing = {"{": "}", "[": "]"}.get(opened.excerpt[opened.column - 1 : opened.column])
    if closing is None or opened == here:
        return Problem("yaml", "inside brackets, a value is missing here", "close the bracket, or quote a text", here)
    if not text[mark.index :].strip():
        return Problem("yaml", f"this bracket is never closed with {closing!r}", None, opened)
    return Problem(
        "yaml",
        f"',' or {closing!r} is missing before this; the bracket was opened at {opened}",
        "quote a text that holds any of [ ] { } ,",
        here,
    )
