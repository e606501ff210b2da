"""Signal handlers for commands that write a file, so that it is closed or removed before the command ends."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from types import FrameType

from busflow.runner.signals import CODES, ending_signals


@contextmanager
def handled(numbers: Iterable[signal.Signals], handler: Callable[[int, FrameType | None], None]) -> Generator[None]:
    """Install a handler for signals while the block lasts."""
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, previous in before.items():
            signal.signal(number, previous)


@contextmanager
def unwound_by_signals() -> Generator[None]:
    """Let SIGTERM and SIGHUP unwind the block as Ctrl-C does, with the exit code of the signal."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread can handle signals
        return
    numbers = [number for number in ending_signals() if number is not signal.SIGINT]

    def end(number: int, _frame: object) -> None:
        for each in numbers:
            signal.signal(each, signal.SIG_IGN)  # once is enough
        raise SystemExit(int(CODES[signal.Signals(number)]))

    with handled(numbers, end):
        yield
