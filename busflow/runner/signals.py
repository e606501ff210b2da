"""SignalGuard: Ctrl-C, SIGTERM and SIGHUP reach a run even while a node blocks the event loop.

Python's own handlers run on the main thread, between two of its instructions, so a node stuck in a C call would
keep them out. The operating system's signal is therefore written to a socket, and a thread of its own reads it: it
asks the run to stop, and ends the process when the run has not stopped within its grace, or at a second signal. What
a run may take beyond its nodes' grace, for the end of a recording, is for one that gets so far.

When the run has ended, the guard ends the processes that its nodes have left behind.

A test is part of a longer run, so what ends it first is a `KeyboardInterrupt` in the line that runs.
"""

from __future__ import annotations

import _thread
import os
import signal
import socket
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from types import FrameType, TracebackType
from typing import Any, Self

from busflow import timeouts
from busflow.clock import monotonic
from busflow.errors import ExitCode
from busflow.runner import standard_error
from busflow.runner.own_process import call_in_children, children, end_children
from busflow.runner.running_lines import is_own, running_lines
from busflow.text import printable

_ENDED = 0
"""Number that is no signal's: the run itself says that it has ended."""
_LIMITED = 255
"""Number that is no signal's: the run's time limit begins, and after it the grace."""
CODES = {signal.SIGINT: ExitCode.INTERRUPTED, signal.SIGTERM: ExitCode.TERMINATED}
"""Exit codes of a run that a signal ends."""
if hasattr(signal, "SIGHUP"):  # Windows does not have it
    CODES[signal.SIGHUP] = ExitCode.HUNG_UP  # the terminal is gone: its window was closed, or its ssh broke


def ending_signals() -> tuple[signal.Signals, ...]:
    """Return the signals that end a command, without SIGHUP where it is ignored (`nohup`)."""
    return tuple(
        n for n, code in CODES.items() if code is not ExitCode.HUNG_UP or signal.getsignal(n) is not signal.SIG_IGN
    )


def signal_name(number: int) -> str:
    """Return the name of a signal.

    >>> signal_name(9), signal_name(99)
    ('SIGKILL', 'signal 99')
    """
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


class SignalGuard:
    """While entered, the first signal calls `ask_to_stop` (on the guard's thread) and starts the countdown."""

    def __init__(
        self,
        ask_to_stop: Callable[[ExitCode], None],
        *,
        grace_s: float,
        around_s: float = 0.0,
        interrupts: bool = False,
    ) -> None:
        """Prepare the guard of one run.

        Args:
            ask_to_stop: what the first signal does.
            grace_s: what the run has for its nodes to stop.
            around_s: what it has beyond that for what is around them, if it `goes_on`.
            interrupts: a second signal, or the end of the grace, raises `KeyboardInterrupt` where the main thread is;
                only what goes on then ends the process.
        """
        self.goes_on: Callable[[], bool] = bool
        """Returns whether the run still makes progress; called on the guard's thread."""
        self.last_act: Callable[[ExitCode], object] = lambda _code: None
        """Called with the exit code, on another thread, before the process is ended by force."""
        self.report: Callable[[str], object] = standard_error.write
        """Gets a line for each process of a node that goes on."""
        self._ask_to_stop = ask_to_stop
        self._grace_s, self._around_s = grace_s, around_s
        self._before: dict[signal.Signals, Any] = {}
        self._before_fd = self._loop_fd = -1
        self._code = ExitCode.FAILED
        self._is_ending = False
        """Whether the process is ended by force now."""
        self._limit_s = 0.0
        self._first: tuple[int, float] | None = None
        self.received: list[int] = []
        """Signals that the run was sent so far."""
        self.interrupt: KeyboardInterrupt | None = KeyboardInterrupt() if interrupts else None
        """What is raised in the line that runs; its traceback says which one it was."""

    def __enter__(self) -> Self:
        self._children = children()
        if threading.current_thread() is not threading.main_thread():
            return self  # signals belong to the main thread: a caller in another thread handles them itself
        self._reader, self._writer = socket.socketpair()
        self._writer.setblocking(False)
        for number in ending_signals():
            self._before[number] = signal.signal(number, self._pass_on)
        self._before_fd = signal.set_wakeup_fd(self._writer.fileno(), warn_on_full_buffer=False)
        threading.Thread(target=self._watch, name="busflow.signals", daemon=True).start()
        call_in_children(self._leave_child)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        end_children(self._children, self.report)
        if self._before:
            self._give_back()

    def _leave_child(self) -> None:
        """Give a forked process its own signals, which do not reach the run's guard.

        Ctrl-C, which a terminal sends to all, stays with the run, which ends its nodes and they what they forked.
        """
        if self._is_ending:
            os._exit(self._code)  # a pool forks a process in place of each that was killed
        if self._before:
            self._before[signal.SIGINT] = _ignore
            self._give_back()

    def _give_back(self) -> None:
        signal.set_wakeup_fd(self._before_fd)
        for number, before in self._before.items():
            signal.signal(number, before)
        self._before.clear()
        self._writer.close()  # the guard's thread reads the end and returns

    def precede_loop(self) -> None:
        """Receive signals before the running event loop, and forward them to it if it had a wake-up descriptor.

        The system writes to one descriptor alone, which must be read while a node keeps the loop from reading.
        """
        if self._before:
            loop_fd = signal.set_wakeup_fd(self._writer.fileno(), warn_on_full_buffer=False)
            if loop_fd not in {-1, self._writer.fileno()}:
                self._loop_fd = os.dup(loop_fd)  # the loop's number may name another file once the loop has ended

    def end_after(self, seconds: float) -> None:
        """Start the countdown by itself after a time that the run is given, whatever blocks it then."""
        if self._before:
            self._limit_s = seconds
            self._writer.send(bytes([_LIMITED]))

    def count_down(self, code: ExitCode) -> None:
        """Give the rest of the program the grace to end too, after the run has ended."""
        if self._before:
            self._code = code
            self._writer.send(bytes([_ENDED]))

    def _pass_on(self, number: int, _frame: FrameType | None) -> None:
        """Handle a signal in Python: raises no KeyboardInterrupt at first, and the guard's thread gets the signal.

        An event loop that was given a signal handler of its own has the wake-up descriptor now, and not the guard.
        """
        __tracebackhide__ = True  # pytest shows the line that was interrupted
        current = signal.set_wakeup_fd(self._writer.fileno(), warn_on_full_buffer=False)
        if current != self._writer.fileno():
            signal.set_wakeup_fd(current, warn_on_full_buffer=False)
            self._writer.send(bytes([number]))
        self.received.append(number)
        if self.interrupt is not None and len(self.received) > 1:
            raise self.interrupt

    def _watch(self) -> None:
        asked, limited = 0, False
        more_s = 0.0  # what the run has beyond the time that passes now
        with self._reader:
            while True:
                try:
                    received = self._reader.recv(1)
                except TimeoutError:
                    if limited:
                        limited, more_s = False, self._around_s
                        self._reader.settimeout(self._grace_s)
                    elif more_s and self.goes_on():
                        self._reader.settimeout(more_s)
                        more_s = 0.0
                    elif self.interrupt is not None and asked == 1:
                        standard_error.write(f"the run did not end within {self._grace_s:g} s{_place()}")
                        _interrupt_main_thread()
                    else:
                        given_s = self._grace_s + self._around_s - more_s  # less what it would have made nothing of
                        self._end_process(f"the run did not end within {given_s:g} s")
                    continue
                self._forward_to_loop(received)
                if not received:
                    return
                if received[0] == _LIMITED:
                    limited = True
                    self._reader.settimeout(self._limit_s)
                elif received[0] == _ENDED:
                    limited, more_s = False, 0.0
                    self._reader.settimeout(self._grace_s + self._around_s)
                elif received[0] in CODES and self._is_new(received[0]):  # signals of other handlers wake this one too
                    limited, more_s = False, self._around_s
                    self._reader.settimeout(self._grace_s)
                    asked += 1
                    if asked > (1 if self.interrupt is None else 2):
                        self._end_process(f"ended at once, at a {'second' if asked == 2 else 'third'} signal")
                    if asked == 1:
                        self._code = CODES[signal.Signals(received[0])]
                        self._ask_to_stop(self._code)

    def _is_new(self, number: int) -> bool:
        """Return whether a signal is more than the first one once again."""
        if self._first is None:
            self._first = number, monotonic()
            return True
        first, received_s = self._first
        return number != first or monotonic() - received_s >= timeouts.current.repeated_signal

    def _forward_to_loop(self, received: bytes) -> None:
        """Forward received bytes to the event loop; no bytes close its descriptor."""
        if self._loop_fd >= 0:
            with suppress(OSError):  # it has ended, or has more to read than it takes
                os.write(self._loop_fd, received) if received else os.close(self._loop_fd)

    def _end_process(self, why: str) -> None:
        """End the process now, and print what the main thread was doing."""
        where = _place()
        self._is_ending = True
        try:
            if hasattr(os, "set_blocking"):  # not on Windows before Python 3.12
                os.set_blocking(standard_error.descriptor, False)  # the reader of standard error may be gone or blocked
            standard_error.write(f"{why}{where}")
            last = threading.Thread(target=self.last_act, args=[self._code], daemon=True)
            last.start()
            last.join(timeouts.current.last_act)
            end_children(self._children, standard_error.write, patience_s=0.0)
        finally:
            os._exit(self._code)


def _ignore(_number: int, _frame: FrameType | None) -> None:
    """Ignore a signal by a handler: programs that the process executes would inherit SIG_IGN."""


def _interrupt_main_thread() -> None:
    """Interrupt the main thread, in a blocking call too where the platform can."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:  # Windows
        _thread.interrupt_main()


def _place() -> str:
    """Return the line of a node's code in which the main thread is, as the end of a sentence; empty where it waits."""
    frame = sys._current_frames().get(threading.main_thread().ident or 0)  # noqa: SLF001  # there is no other way to see it
    own = filter(is_own, running_lines(frame))
    return next((f"; it was in {printable(each.filename)}:{each.lineno}, {printable(each.name)}" for each in own), "")
