"""Output of commands: messages, problems, and JSON that every reader accepts."""

from __future__ import annotations

import json
import os
import re
import select
import sys
from collections.abc import Generator, Iterable, Mapping
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any, TextIO

import click

from busflow.errors import Problem
from busflow.interfaces.encoding.json_form import finite
from busflow.text import printable

_LABEL = re.compile(r"(^|: |  )(error|warning|info|fix):", re.MULTILINE)
_COLOURS = {"error": "red", "warning": "yellow", "info": "cyan", "fix": "green"}

JSON_VERSION = 1
"""The `version` in all output of `--json`; it grows when something there is removed or changed."""


def colour() -> bool | None:
    """Return whether to colour, as NO_COLOR and FORCE_COLOR say; None if the stream decides: terminals are coloured."""
    if os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb":
        return False
    return True if os.environ.get("FORCE_COLOR") else None


def log_stream() -> tuple[TextIO, bool]:
    """Return the stream for the log of a run, and whether to colour it: standard error, unless the shell closed it."""
    # Standard error is None after `2>&-`.
    stream = sys.stderr or Path(os.devnull).open("w")  # noqa: SIM115  # it lives as long as the process
    return stream, stream.isatty() if (wanted := colour()) is None else wanted


def print_message(text: str, *, error_stream: bool = True) -> None:
    """Print a message, its control characters escaped and its labels coloured; to standard error unless it is data.

    Standard error that cannot be written changes no exit code: the message is lost.
    """
    safe = "\n".join(printable(line) for line in text.rstrip("\n").split("\n"))
    marked = _LABEL.sub(lambda found: found[1] + click.style(found[2], fg=_COLOURS[found[2]], bold=True) + ":", safe)
    with messages_lost() if error_stream else nullcontext():
        click.echo(marked, err=error_stream, color=colour())


@contextmanager
def messages_lost() -> Generator[None]:
    """Write to standard error; discard it for good where its reader has gone or its disk is full."""
    try:
        yield
    except OSError:
        discard_output(2)


@contextmanager
def outcome_printed() -> Generator[None]:
    """Print the outcome of what has ended, whose exit code stays as it is where the reader of the output has gone."""
    try:
        yield
        if sys.stdout:
            sys.stdout.flush()
    except BrokenPipeError:
        discard_output()


def discard_output(descriptor: int = 1) -> None:
    """Discard what is still printed: the interpreter flushes once more when it exits, and must not fail again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), descriptor)


def require_reader() -> None:
    """Check that what is printed still has a reader, for a command that prints seldom: `busflow log -f | head -1`.

    Raises:
        BrokenPipeError: it has none.
    """
    if hasattr(select, "poll"):  # not on Windows
        output = select.poll()
        output.register(1, 0)
        if any(event & select.POLLERR for _, event in output.poll(0)):
            raise BrokenPipeError


def print_problems(problems: Iterable[Problem], *, error_stream: bool = False) -> None:
    """Print each problem with its line, caret and fix."""
    for problem in problems:
        print_message(problem.render(), error_stream=error_stream)


def json_text(data: object) -> str:
    """Return data as JSON that every reader accepts; it is ASCII, so that nothing in it can steer a terminal."""
    return json.dumps(finite(data), indent=2, default=str, allow_nan=False)


def print_answer(answer: Mapping[str, Any]) -> None:
    """Print the result of a command as one JSON object, with the version."""
    click.echo(json_text({"version": JSON_VERSION, **answer}))


def print_found(answer: Mapping[str, Any], names: Iterable[str], *, as_json: bool) -> None:
    """Print the result of a command: as JSON, or for people only the names, one on each line."""
    if as_json:
        print_answer(answer)
    else:
        click.echo("".join(f"{printable(each)}\n" for each in names), nl=False)


def print_line(data: Mapping[str, Any]) -> None:
    """Print one of many objects as a line of JSON, and flush it for the reader of the stream."""
    click.echo(line_of(data))


def line_of(data: Mapping[str, Any]) -> str:
    """Return an object as one line of JSON, with the version."""
    versioned = {"version": JSON_VERSION, **data}
    try:
        return json.dumps(versioned, default=str, allow_nan=False)
    except ValueError:  # infinity or NaN; checking a million numbers of an image beforehand would be slow
        return json.dumps(finite(versioned), default=str, allow_nan=False)


def local_time(ns: int) -> str:
    """Return a stamp as the clock on this machine's wall has it."""
    from datetime import UTC, datetime

    return f"{datetime.fromtimestamp(ns / 1e9, UTC).astimezone():%Y-%m-%d %H:%M:%S}"


def short_path(file: str) -> str:
    """Return a path relative to the working directory if it is below it, else unchanged.

    >>> short_path("/no/such/place"), short_path("configs/lab1.yaml")
    ('/no/such/place', 'configs/lab1.yaml')
    """
    relative = os.path.relpath(file)
    return file if relative.startswith(os.pardir) or not file.startswith("/") else relative
