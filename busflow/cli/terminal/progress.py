"""A progress bar for long work, shown if standard error is a terminal."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from itertools import repeat
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from click._termui_impl import ProgressBar

_STEPS = 2000
"""The number of messages between two updates of the bar; more updates would cost more than the work itself."""
_ERASE_LINE_ABOVE = "\x1b[A\x1b[2K"


@contextmanager
def progress(what: str, total: Callable[[], int] | None = None) -> Generator[Callable[[], None]]:
    """Yield a function to call for each message; `total` counts the expected messages, if their number is known.

    The bar shows the count and the time left. It is erased when the block ends, also by an error.
    """
    if not (sys.stderr and sys.stderr.isatty()) or os.environ.get("TERM") == "dumb":
        yield lambda: None
        return
    bar = _Bar(what, None if total is None else total())
    try:
        yield bar.step
    finally:
        bar.close()


class _Bar:
    """The bar, shown once the work has taken a while."""

    def __init__(self, what: str, total: int | None) -> None:
        self._what, self._total = what, total
        self._done = 0
        self._shown: ProgressBar[None] | None = None

    def step(self) -> None:
        """Count one more message."""
        self._done += 1
        if self._done % _STEPS == 0:
            self._show()

    def close(self) -> None:
        """Erase the bar and show the cursor again."""
        if self._shown is not None:
            self._shown.render_finish()
            click.echo(_ERASE_LINE_ABOVE, file=sys.stderr, nl=False)

    def _show(self) -> None:
        if self._shown is None:
            self._shown = click.progressbar(
                repeat(None), length=self._total, label=self._what, file=sys.stderr, show_pos=True, width=0
            )
        self._shown.update(_STEPS)
