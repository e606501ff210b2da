"""Running lines: where in a node's code a thread is, also inside of what that code has called of busflow."""

from __future__ import annotations

import os
import sysconfig
import traceback
from pathlib import Path
from types import FrameType

_BUSFLOW = str(Path(__file__).parents[1]) + os.sep
_LIBRARIES = tuple(sysconfig.get_path(name) + os.sep for name in ("stdlib", "purelib", "platlib"))


def running_lines(frame: FrameType | None) -> list[traceback.FrameSummary]:
    """Return the lines that busflow called, innermost first, with those of libraries that they called.

    There are none where the thread waits for the event loop. A thread in which nothing is of busflow has all its lines.

    Args:
        frame: The thread's innermost frame.
    """
    lines: list[traceback.FrameSummary] = []
    is_called = False
    for entry in reversed(traceback.extract_stack(frame) if frame else []):
        if not entry.filename.startswith(_BUSFLOW):
            lines.append(entry)
            continue
        is_called = True
        if any(map(is_own, lines)):
            return lines
        lines.clear()
    return [] if is_called else lines


def is_own(entry: traceback.FrameSummary) -> bool:
    """Return whether a line is of a node or a program, and of no library."""
    return not entry.filename.startswith((*_LIBRARIES, _BUSFLOW, "<"))
