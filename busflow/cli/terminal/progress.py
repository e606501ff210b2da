"""A progress bar for what takes long, where standard error is a terminal."""

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
"""After so many messages it is shown for the first time, and moved: less would cost more than the work itself."""
_ERASE_LINE_ABOVE = "\x1b[A\x1b[2K"


@contextmanager
def progress(what: str, total: Callable[[], int] | None = None) -> Generator[Callable[[], None]]:
    """Yield a function to call for each message while the block lasts; `total` counts those to come, if that is known.

    The bar shows the count and the time left. It is gone when the block ends, however it ends.
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
        """Take the bar away and give the cursor back."""
        if self._shown is not None:
            self._shown.render_finish()
            click.echo(_ERASE_LINE_ABOVE, file=sys.stderr, nl=False)

    def _show(self) -> None:
        if self._shown is None:
            self._shown = click.progressbar(
                repeat(None), length=self._total, label=self._what, file=sys.stderr, show_pos=True, width=0
            )
        self._shown.update(_STEPS)
