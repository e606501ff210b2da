"""Standard error of the process, for what people must read while it is stuck: also where pytest captures its output."""

from __future__ import annotations

import os
from contextlib import suppress

descriptor: int = 2
"""File descriptor of the terminal; pytest's plugin sets it to one that is not captured."""


def write(line: str) -> None:
    """Write a line, from any thread; the reader may be gone."""
    with suppress(OSError):
        os.write(descriptor, f"busflow: {line}\n".encode())
