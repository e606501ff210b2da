"""slow_import_named: names the line at which the import of a plugin stands, and ends an import that is endless."""

from __future__ import annotations

import math
import os
import sys
import threading
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from traceback import FrameSummary, extract_stack

from busflow import timeouts
from busflow.errors import ExitCode, InvalidInput, Problem
from busflow.text import printable
from busflow.validation.durations import parse_duration
from busflow.validation.tracebacks import shown

LIMIT = "BUSFLOW_IMPORT_LIMIT"
"""The environment variable that states how long an import may take until it ends the process; without it, for ever."""
_SKIPPED = (str(Path(__file__).parents[1]) + os.sep, "<frozen importlib", str(Path(os.__file__).parent / "importlib"))


@contextmanager
def slow_import_named(name: str, folder: Path | None) -> Generator[None]:
    """Watch the import of a plugin in this thread, whose own lines are below `folder`.

    Raises:
        InvalidInput: The limit that the environment states is no duration.
    """
    ended = threading.Event()
    arguments = (name, folder, threading.get_ident(), ended, _limit_s())
    threading.Thread(target=_watch, args=arguments, name="busflow.import", daemon=True).start()
    try:
        yield
    finally:
        ended.set()


def _watch(name: str, folder: Path | None, thread: int, ended: threading.Event, limit_s: float) -> None:
    warn_s = timeouts.current.import_warning
    if ended.wait(min(warn_s, limit_s)):
        return
    if limit_s > warn_s:
        text = f"after {warn_s:g} s plugin {name!r} is still being imported"
        _write(f"warning: {text}: {_place(folder, thread)}; {LIMIT}=1min would end it after a minute")
        if ended.wait(None if limit_s == math.inf else limit_s - warn_s):
            return
    text = f"plugin {name!r} was not imported within {limit_s:g} s"
    fix = f"do in start() what takes long, or give {LIMIT} more"
    _write(f"error: {text}: {_place(folder, thread)}\n  fix: {fix}")
    os._exit(ExitCode.USAGE)  # an import that waits in a C call ends by nothing else


def _limit_s() -> float:
    stated = os.environ.get(LIMIT, math.inf)
    try:
        return parse_duration(stated)
    except ValueError:
        text = f"{LIMIT} must be a duration with its unit, got {printable(repr(stated), limit=60)}"
        raise InvalidInput(Problem("import-limit", text, f"write {LIMIT}=1min, or unset it")) from None


def _write(text: str) -> None:
    sys.stderr.write(f"{text}\n")
    sys.stderr.flush()


def _place(folder: Path | None, thread: int) -> str:
    """Return the line of the plugin's own at which the import stands: the innermost one, for people."""
    frame = sys._current_frames().get(thread)  # noqa: SLF001  # documented in spite of its name
    lines = [each for each in extract_stack(frame) if not each.filename.startswith(_SKIPPED)]
    own = [each for each in lines if folder in Path(each.filename).resolve().parents]
    found: FrameSummary = (own or lines)[-1]
    return f"{printable(shown(found.filename))}:{found.lineno}: {printable(found.line or '')}"
