"""A progress bar for what takes long, where somebody looks at a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager

_STEPS = 2000
"""After so many messages it is shown for the first time, and moved: less would cost more than the work itself."""


@contextmanager
def progress(what: str, total: Callable[[], int] | None = None) -> Generator[Callable[[], None]]:
    """What is called for each message while the block lasts; `total` tells how many there are.

    Rich is imported when the bar is first shown, so that what is quick does not wait for it.
    """
    if not (sys.stderr and sys.stderr.isatty()):
        yield lambda: None
        return
    bar = _Bar(what, None if total is None else total())
    try:
        yield bar.step
    finally:
        bar.close()


class _Bar:
    """The bar, once there is something to show."""

    def __init__(self, what: str, total: int | None) -> None:
        self._what, self._total = what, total
        self._done = 0
        self._move: Callable[[int], None] | None = None
        self.close: Callable[[], None] = lambda: None

    def step(self) -> None:
        """One more message is done."""
        self._done += 1
        if self._done % _STEPS == 0:
            self._show()

    def _show(self) -> None:
        if self._move is None:
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

            columns = (TextColumn(self._what), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
            shown = Progress(*columns, console=Console(stderr=True), transient=True)
            task = shown.add_task(self._what, total=self._total)
            shown.start()
            self.close = shown.stop
            self._move = lambda done: shown.update(task, completed=done)
        self._move(self._done)
