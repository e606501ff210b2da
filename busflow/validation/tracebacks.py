"""Tracebacks: the user's lines of code behind an exception, without busflow's own frames."""

from __future__ import annotations

import linecache
import os
import traceback
from pathlib import Path

from busflow.errors import Place

_STANDARD = (Path(traceback.__file__).resolve().with_name(name) for name in ("asyncio", "importlib"))
_MACHINERY = tuple(str(folder) + os.sep for folder in (Path(__file__).resolve().parents[1], *_STANDARD))


def user_line(error: BaseException) -> Place | None:
    """Return the user's line that failed, or that called the failing library."""
    return next(reversed(places(error)), None)


def places(error: BaseException, *, within: Path | None = None) -> list[Place]:
    """Return the places in the user's code: the imports on the way, outermost first, then the line that failed.

    Args:
        error: An exception that was raised.
        within: The real path of the folder whose lines are returned; by default that of the outermost frame,
            which is the code that busflow called.
    """
    frames = [
        (frame, Path(frame.filename).resolve())
        for frame in traceback.extract_tb(error.__traceback__)
        if not frame.filename.startswith("<")
    ]
    frames = [(frame, file) for frame, file in frames if not str(file).startswith(_MACHINERY)]
    folder = within or (frames[0][1].parent if frames else None)
    own = [frame for frame, file in frames if folder in file.parents]
    own = own or [frame for frame, _ in frames]
    found = [_place_of(frame) for frame in own if frame.name == "<module>" or frame is own[-1]]
    if isinstance(error, SyntaxError) and error.filename and Path(error.filename).is_file():
        found.append(_place_of_syntax_error(error, error.filename))
    return found


def line(file: str, number: int) -> Place:
    """Return a whole line of code as a place."""
    text = linecache.getline(file, number).rstrip()
    start = len(text) - len(text.lstrip())
    return Place(shown(file), number, start + 1, max(1, len(text) - start), text)


def lines_of(error: BaseException) -> list[str]:
    """Return the lines of code that led to an exception, outermost first, without busflow's own."""
    return [
        f"{shown(frame.filename)}:{frame.lineno} in {frame.name}"
        for frame in traceback.extract_tb(error.__traceback__)
        if not str(Path(frame.filename).resolve()).startswith(_MACHINERY)
    ]


def reason(error: BaseException) -> str:
    """Return the exception's type and text on one line."""
    try:
        text = str(error.msg if isinstance(error, SyntaxError) else error)
    except Exception as fault:  # noqa: BLE001  # the user's __str__ may raise anything
        text = f"<its text raised {type(fault).__name__}>"
    return ": ".join(filter(None, [type(error).__name__, " ".join(text.split())]))


def shown(path: str | os.PathLike[str]) -> str:
    """Return a path for people: relative if it is below the current directory."""
    try:
        return str(Path(path).absolute().relative_to(Path.cwd()))
    except (OSError, ValueError):
        return str(path)


def _place_of(frame: traceback.FrameSummary) -> Place:
    text = linecache.getline(frame.filename, frame.lineno or 1).rstrip()
    start, end = len(text) - len(text.lstrip()), len(text)
    if frame.colno is not None and frame.end_colno is not None and frame.end_lineno == frame.lineno:
        # Python counts columns in bytes.
        start, end = (len(text.encode()[:at].decode(errors="replace")) for at in (frame.colno, frame.end_colno))
    return Place(shown(frame.filename), frame.lineno or 1, start + 1, max(1, end - start), text)


def _place_of_syntax_error(error: SyntaxError, file: str) -> Place:
    column = max(1, error.offset or 1)
    width = (error.end_offset or 0) - column if error.end_lineno == error.lineno else 1
    return Place(shown(file), max(1, error.lineno or 1), column, max(1, width), (error.text or "").rstrip())
