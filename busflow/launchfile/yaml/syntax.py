"""Explains YAML's syntax errors, each at the place where it can be corrected."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any, TypeAlias, cast

import yaml

from busflow.errors import Place, Problem
from busflow.text import counted, printable

PlaceAt: TypeAlias = Callable[[int, int, int | None], Place]
"""Function from a line, column and width, all counted from 0, to a place."""

_EXPRESSION = re.compile(r"\$\{[^}\n]*\}?")
_MISALIGNED = ("expected <block end>", "did not find expected key", "did not find expected '-' indicator")
_LEFT_OVER = ("did not find expected <document start>", "expected '<document start>'")
_KEY = re.compile(r"""\s*(- +)?(["']?)[A-Za-z_/~][^\s:,#"']*\2:(\s|$)""")
"""A line that begins with a key."""
_GLUED = re.compile(r"\s*(?:- +)?([A-Za-z_][\w/~-]*):(?=[^\s:/])")
"""A line that begins with `key:value`, without a space after the colon."""


def explain(error: yaml.MarkedYAMLError, text: str, place_at: PlaceAt) -> Problem:
    """Return the problem in words that need no knowledge of YAML parsers."""
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
        return _late_quote(text, mark, place_at) or _in_flow(text, mark, place_at, opened)
    if "quoted scalar" in context and opened is not None and ("end of stream" in problem or "document" in problem):
        place = place_at(opened.line, opened.column, 1)
        return said("this quote is never closed", f"write {text[opened.index]} at the end of the text", place)
    if "escape" in problem:
        return said(
            f"a double-quoted text has a wrong escape: {problem}",
            r"use single quotes, or write \\ for a backslash",
        )
    if found == "\t" and ("cannot start any token" in problem or "tab character" in problem):
        return said("a tab cannot indent", "indent with spaces")
    if "cannot start any token" in problem:
        return said(f"a value cannot begin with {printable(found)!r}", "quote it")
    if "mapping values are not allowed" in problem:
        return _glued(mark, place_at) or said("a ':' cannot stand here", _without_colon(mark, place_at))
    if "could not find expected ':'" in problem:
        where = place_at(opened.line, opened.column, None) if opened is not None else here
        return said("a ':' is missing after this", "write `key: value`", where)
    if problem.startswith((*_MISALIGNED, *_LEFT_OVER)):
        if here.excerpt[: here.column - 1].strip():
            return _late_quote(text, mark, place_at) or said(*_left_over(text, mark))
        return said("this does not line up with what is around it", _alignment(mark, place_at))
    return said(f"not valid YAML: {problem}")


def _left_over(text: str, mark: yaml.Mark) -> tuple[str, str]:
    """Return message and fix for text that follows a complete value."""
    found, before = text[mark.index : mark.index + 1], text[: mark.index].rstrip()[-1:]
    if found in {"]", "}"}:
        return f"no bracket is open that this {found!r} could close", "leave it out"
    message = "this cannot follow what is before it"
    if before == "'" and found not in {"", ","}:
        return message, "inside '…' write '' for a quote, or put the whole text into \"…\""
    return message, "quote the whole text if it is one"


def _glued(mark: yaml.Mark, place_at: PlaceAt) -> Problem | None:
    """Report a key without a space after its colon, on this line or the one before; YAML reads it as text."""
    for line in (mark.line, mark.line - 1):
        found = _GLUED.match(place_at(line, 0, None).excerpt) if line >= 0 else None
        if found is not None:
            place = place_at(line, found.start(1), len(found[1]) + 1)
            return Problem("yaml", *unspaced(found[1], place.excerpt[found.end() :].strip()), place)
    return None


def unspaced(key: str, value: str) -> tuple[str, str]:
    """Return message and fix for `key:value`."""
    return f"a space is missing after {key}:", f"write {key}: {value}"


def _without_colon(mark: yaml.Mark, place_at: PlaceAt) -> str:
    """Return the fix for an unexpected ':'; often a ':' is missing on the line before."""
    before = place_at(mark.line - 1, 0, None).excerpt if mark.line > 0 else ""
    if before.strip() and ":" not in before:
        return f"end line {mark.line} with a ':', or quote the text"
    here = place_at(mark.line, 0, None).excerpt
    second = re.search(r": +[^\s:].*\s(\w+)$", here[: mark.column])
    if second is not None:
        return f"put {second[1]}: on a line of its own, or quote the text"
    if _indent(before) < _indent(here):
        return f"indent it like line {mark.line}, whose value is on that line, or quote the text"
    return "quote the text, or put a nested mapping on lines of its own, indented"


def _alignment(mark: yaml.Mark, place_at: PlaceAt) -> str:
    """Return the fix for a line that begins between the columns of the lines before it, or beyond them all."""
    deeper: tuple[int, int] | None = None  # the indentation of a line, and its number
    for line in range(mark.line - 1, -1, -1):
        excerpt = place_at(line, 0, None).excerpt
        if not excerpt.strip() or excerpt.lstrip().startswith("#"):
            continue
        indent = _indent(excerpt)
        if indent <= mark.column:
            ways = [each for each in (deeper, (indent, line + 1)) if each is not None and each[0] != mark.column]
            return "indent it " + "; or ".join(map(_as_line, ways))
        if deeper is None or indent < deeper[0]:
            deeper = indent, line + 1
    return f"indent it {_as_line(deeper)}" if deeper is not None else "indent it like its neighbours"


def _as_line(found: tuple[int, int]) -> str:
    indent, line = found
    return f"with {counted(indent, 'space')} as line {line}" if indent else f"not at all, as line {line}"


def _late_quote(text: str, mark: yaml.Mark, place_at: PlaceAt) -> Problem | None:
    """Report a quote that was closed only by the opening of the next one, some lines below."""
    scan = cast("Callable[..., Iterator[Any]]", yaml.scan)  # pyright: ignore[reportUnknownMemberType]  # no types
    last: Any = None
    try:
        for token in scan(text[: mark.index], Loader=yaml.SafeLoader):
            last = token if isinstance(token, yaml.ScalarToken) else last
    except yaml.YAMLError:
        pass  # it is cut off in the middle
    if last is None or not last.style or last.start_mark.line == last.end_mark.line:
        return None
    start, end = last.start_mark, last.end_mark
    if text[end.index : mark.index].strip():
        return None
    message = f"this quote is closed only on line {end.line + 1}"
    fix = f"write {text[start.index]} at the end of the text on this line"
    return Problem("yaml", message, fix, place_at(start.line, start.column, 1))


def _in_flow(text: str, mark: yaml.Mark, place_at: PlaceAt, start: yaml.Mark) -> Problem:
    """Report something unexpected inside `{…}` or `[…]`."""
    opened = place_at(start.line, start.column, 1)
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
    last = _last_line_within(start, mark, place_at)
    if last is not None or not text[mark.index :].strip():
        where = f"at the end of line {last + 1}" if last is not None else "where it ends"
        return Problem("yaml", f"this bracket is never closed with {closing!r}", f"write {closing} {where}", opened)
    return Problem(
        "yaml",
        f"',' or {closing!r} is missing before this; the bracket was opened at {opened}",
        "quote a text that holds any of [ ] { } ,",
        here,
    )


def _last_line_within(start: yaml.Mark, mark: yaml.Mark, place_at: PlaceAt) -> int | None:
    """Return the last line that can belong to a bracket: the one before a key that is not indented deeper."""
    within, last = _indent(place_at(start.line, 0, None).excerpt), start.line
    for line in range(start.line + 1, mark.line + 1):
        excerpt = place_at(line, 0, None).excerpt
        if _KEY.match(excerpt) and _indent(excerpt) <= within:
            return last
        last = line if excerpt.strip() else last
    return None


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip(" "))
