"""Keeper: a small process between a run and a program that it started; it leaves no process of the program behind.

The run starts it as a script, so it imports the standard library alone. It reads one line of JSON on standard input:
the command, its folder, its grace, and whether the command gets the number of the keeper's pipe. The program gets the
keeper's standard output and error; the keeper reports on the pipe, in lines of JSON: the program's number, its end, or
why it cannot be started.

More input, or its end because the run has died, stops the program: SIGINT to its process group, after the grace
SIGTERM, after the grace again SIGKILL. What a program leaves behind when it ends by itself is stopped the same way. On
Linux the keeper becomes the parent of every process whose own parent has ended, and so knows also those that have left
the group. If the keeper itself is killed, Linux kills the program.
"""

import contextlib
import ctypes
import json
import os
import select
import signal
import subprocess
import sys
from pathlib import Path

_SET_PARENT_DEATH_SIGNAL = 1
_SET_CHILD_SUBREAPER = 36
"""Numbers of Linux's `prctl`."""
_ORDERS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Signals to the keeper that stop its program."""
_LINE_BYTES = 1 << 20
_KILLED_S = 1.0
"""How long killed processes may take to end; one in the midst of a system call of a broken device may never."""


class Stopping:
    """Signals that stop a program: the first when it is ordered, each other one when the grace of the last is over."""

    def __init__(self) -> None:
        self.signals: list[signal.Signals] = [signal.SIGINT, signal.SIGTERM, signal.SIGKILL]
        """Signals that the program has not got yet."""
        self.is_due: bool = False
        """Whether the time for the next signal has come."""

    def order(self) -> None:
        """Let the first signal be due, unless it is sent: another order hastens nothing."""
        self.is_due |= signal.SIGINT in self.signals

    def on_signals(self, numbers: bytes) -> None:
        """Handle signals to the keeper: an order to stop, the end of the grace, or one that only wakes it."""
        if any(number in numbers for number in _ORDERS):
            self.order()
        self.is_due |= signal.SIGALRM in numbers

    def next(self) -> signal.Signals:
        """Take the signal that is due."""
        self.is_due = False
        return self.signals.pop(0)


class Keeper:
    """The program of this keeper, from its start until no process of it is left."""

    def __init__(self, orders: int, report: int) -> None:
        os.set_inheritable(report, False)
        self._orders, self._report = orders, report
        self._woken, self._wake = os.pipe()
        os.set_blocking(self._wake, False)
        self._linux: ctypes.CDLL | None = ctypes.CDLL(None) if sys.platform == "linux" else None
        self._stopping = Stopping()
        self._code: int | None = None

    def run(self) -> None:
        """Start the program, and return when neither it nor what it started is left."""
        order = json.loads(os.fdopen(self._orders, "rb", buffering=0, closefd=False).readline(_LINE_BYTES))
        self._grace_s = float(order["grace_s"])
        self._handle_signals()
        if self._linux is not None:
            self._linux.prctl(_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
        pipes = [self._report] if order.get("pipe") else []
        try:
            program = subprocess.Popen(  # noqa: S603  # the command of a launch file, which no shell reads
                [*order["command"], *map(str, pipes)],
                cwd=order["cwd"],
                stdin=subprocess.DEVNULL,
                start_new_session=True,  # else a password prompt on the run's terminal would stop it for ever
                pass_fds=pipes,
                preexec_fn=self._die_with_keeper,  # noqa: PLW1509  # this process has one thread
            )
        except (OSError, ValueError) as error:
            self._say(failed=getattr(error, "strerror", None) or str(error))
            return
        self._say(pid=program.pid)
        self._wait(program)
        self._say(code=self._code, killed=not self._stopping.signals)

    def _handle_signals(self) -> None:
        """Let signals wake the keeper. A program whose keeper handles SIGINT cannot ignore it from its start."""
        for number in (*_ORDERS, signal.SIGALRM, signal.SIGCHLD):
            signal.signal(number, lambda _number, _frame: None)
        # Python writes the number of each signal that has a handler.
        signal.set_wakeup_fd(self._wake, warn_on_full_buffer=False)

    def _die_with_keeper(self) -> None:
        if self._linux is not None:
            self._linux.prctl(_SET_PARENT_DEATH_SIGNAL, signal.SIGKILL, 0, 0, 0)

    def _wait(self, program: subprocess.Popen[bytes]) -> None:
        """Reap what ends, and send the signals that are due, until nothing is left or what is left cannot be killed."""
        readers, stopping = [self._orders, self._woken], self._stopping
        while self._is_anything_left(program):
            if stopping.is_due:
                if not stopping.signals:
                    return
                self._send(program, stopping.next())
            ready, _, _ = select.select(readers, [], [])
            if self._woken in ready:
                stopping.on_signals(os.read(self._woken, 4096))
            if self._orders in ready:
                stopping.order()
                if not os.read(self._orders, 4096):  # the run is gone
                    readers.remove(self._orders)

    def _is_anything_left(self, program: subprocess.Popen[bytes]) -> bool:
        """Reap all that have ended; return whether a process of the program is left."""
        while True:
            try:
                pid, status = os.waitpid(-1, os.WNOHANG)
            except ChildProcessError:
                return self._linux is None and _is_group(program.pid)
            if pid == 0:
                return True
            if pid == program.pid:
                self._code = program.returncode = os.waitstatus_to_exitcode(status)
                self._stopping.order()  # what it has left behind is stopped

    def _send(self, program: subprocess.Popen[bytes], number: signal.Signals) -> None:
        """Send a signal, and set the time of the next one."""
        with contextlib.suppress(OSError):  # nothing is left in the group, or it runs as another user
            os.killpg(program.pid, number)
        for pid in descendants(os.getpid()) if number is not signal.SIGINT else ():
            with contextlib.suppress(OSError):  # it has just ended
                os.kill(pid, number)
        signal.setitimer(signal.ITIMER_REAL, self._grace_s if self._stopping.signals else _KILLED_S)

    def _say(self, **values: object) -> None:
        with contextlib.suppress(OSError):  # the run is gone
            os.write(self._report, json.dumps(values).encode() + b"\n")


def _is_group(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except OSError:
        return False
    return True


def descendants(ancestor: int) -> list[int]:
    """Return all processes below one, also those that have left its group; none where the system has no /proc."""
    parents: dict[int, int] = {}
    for status in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError, ValueError, IndexError):  # it has just ended
            # The name of the program comes before, in parentheses, and may hold anything.
            parents[int(status.parent.name)] = int(status.read_text().rpartition(")")[2].split()[1])
    found = [ancestor]
    for above in found:  # which grows meanwhile
        found += [pid for pid, parent in parents.items() if parent == above]
    return found[1:]


if __name__ == "__main__":
    Keeper(sys.stdin.fileno(), int(sys.argv[1])).run()
