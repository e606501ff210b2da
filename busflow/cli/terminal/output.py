"""What commands print: problems and errors, and JSON that every reader accepts."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping
from typing import Any

import click

from busflow.errors import Problem
from busflow.interfaces.encoding.json_form import finite
from busflow.text import printable

_LABEL = re.compile(r"(^|: |  )(error|warning|info|fix):", re.MULTILINE)
_COLOURS = {"error": "red", "warning": "yellow", "info": "cyan", "fix": "green"}

JSON_VERSION = 1
"""What `version` says in all that is printed with `--json`: it grows when something there is taken away or changes."""


def colour() -> bool | None:
    """Whether to colour: NO_COLOR and FORCE_COLOR decide, else (None) whether it is a terminal."""
    if os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb":
        return False
    return True if os.environ.get("FORCE_COLOR") else None


def print_message(text: str, *, error_stream: bool = True) -> None:
    """Write a message, control characters escaped and its labels coloured; to standard error unless it is data."""
    safe = "\n".join(printable(line) for line in text.rstrip("\n").split("\n"))
    marked = _LABEL.sub(lambda found: found[1] + click.style(found[2], fg=_COLOURS[found[2]], bold=True) + ":", safe)
    click.echo(marked, err=error_stream, color=colour())


def print_problems(problems: Iterable[Problem], *, error_stream: bool = False) -> None:
    """Write each problem with its line, caret and fix."""
    for problem in problems:
        print_message(problem.render(), error_stream=error_stream)


def print_json(data: object) -> None:
    """Print data as JSON."""
    click.echo(json_text(data))


def json_text(data: object) -> str:
    """Data as JSON that every reader accepts; ASCII only, so that nothing in it can steer a terminal."""
    return json.dumps(finite(data), indent=2, default=str, allow_nan=False)


def print_answer(answer: Mapping[str, Any]) -> None:
    """Print what a command found out, as one JSON object."""
    print_json({"version": JSON_VERSION, **answer})


def print_found(answer: Mapping[str, Any], names: Iterable[str], *, as_json: bool) -> None:
    """Print what a command found out: as JSON, or for people the names alone, one a line."""
    if as_json:
        print_answer(answer)
    else:
        click.echo("\n".join(map(printable, names)))


def print_line(data: Mapping[str, Any]) -> None:
    """Print one of many objects on a line of its own, at once: whoever reads the stream is not to wait."""
    click.echo(line_of(data))


def line_of(data: Mapping[str, Any]) -> str:
    """An object as one line of JSON, with the version."""
    versioned = {"version": JSON_VERSION, **data}
    try:
        return json.dumps(versioned, default=str, allow_nan=False)
    except ValueError:  # infinity or NaN; a picture's million numbers are not looked at one by one to find none
        return json.dumps(finite(versioned), default=str, allow_nan=False)


def short_path(file: str) -> str:
    """A path as short as it can be said from here.

    >>> short_path("/no/such/place"), short_path("configs/lab1.yaml")
    ('/no/such/place', 'configs/lab1.yaml')
    """
    relative = os.path.relpath(file)
    return file if relative.startswith(os.pardir) or not file.startswith("/") else relative
