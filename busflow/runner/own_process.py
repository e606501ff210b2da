"""This process: its forks, its children, and its end. Imported by every command, so it is light.

A run ends the processes that its nodes have left behind, e.g. a pool's. The system lists them on Linux; elsewhere those
of `multiprocessing` alone are known.
"""

from __future__ import annotations

import gc
import os
import sys
import threading
import weakref
from collections.abc import Callable, Collection, Iterable, Iterator
from collections.abc import Set as AbstractSet
from contextlib import suppress
from pathlib import Path

from busflow.text import printable

_POLL_S = 0.005
_STOPPING = 20
"""Looks at a process that was stopped, until it stands still."""
_named: set[int] = set()
"""Children for which a line was reported: a run ends its children, and the command then its own."""


hanging: list[threading.Thread] = []
"""Threads that worked for an event loop at its end, and may never come back."""


def call_in_children(method: Callable[[], None]) -> None:
    """Call a bound method in each process that is forked while its object is there, which this does not keep alive."""
    reference = weakref.WeakMethod(method)
    if hasattr(os, "register_at_fork"):  # Windows forks nothing
        os.register_at_fork(after_in_child=lambda: (found := reference()) and found())


def children() -> set[int]:
    """Return the numbers of this process's children, also of those that `multiprocessing` lets its server fork."""
    module = sys.modules.get("multiprocessing.process")
    forked = (process.pid for process in module.active_children()) if module else ()
    return {*children_of(os.getpid()), *forked}


def children_of(parent: int) -> Iterator[int]:
    """Yield the numbers of a process's children, if the system has a /proc to say it."""
    with suppress(OSError):  # it has just ended
        for task in os.listdir(f"/proc/{parent}/task"):  # noqa: PTH208  # read at each start
            with suppress(OSError), open(f"/proc/{parent}/task/{task}/children") as file:  # noqa: PTH123  # as above
                yield from map(int, file.read().split())


def end_children(before: AbstractSet[int], report: Callable[[str], object], *, patience_s: float | None = None) -> None:
    """End the children that were not there before, e.g. the workers of a node's pool.

    Args:
        before: numbers of the children that go on.
        report: gets a line for each of the others that goes on too, in a session of its own.
        patience_s: how long they may take before they are killed; by default as `timeouts` says.
    """
    if began := children() - before:
        _end(began, report, patience_s)


def _end(began: AbstractSet[int], report: Callable[[str], object], patience_s: float | None = None) -> None:
    """End children of this process and all below them; `report` gets a line for each that goes on, as it has left.

    Args:
        began: the children; the helpers of `multiprocessing` among them are left, since they end by themselves.
        report: called before the others end.
        patience_s: time after SIGTERM until they are killed.
    """
    import signal

    from busflow import timeouts
    from busflow.clock import monotonic

    left: list[int] = []
    for pid in sorted(began - _helpers()):
        if not _has_left(pid):
            left.append(pid)
        elif pid not in _named:
            _named.add(pid)
            report(f"the process {pid} goes on after the run, in a session of its own: {_command(pid)}".rstrip(": "))
    left = _send_below(left, signal.SIGTERM)
    end_s = monotonic() + (timeouts.current.child_exit if patience_s is None else patience_s)
    while (left := [pid for pid in left if _is_running(pid)]) and monotonic() < end_s:
        threading.Event().wait(_POLL_S)
    _send_below(left, getattr(signal, "SIGKILL", signal.SIGTERM))


def _send_below(pids: Iterable[int], number: int) -> list[int]:
    """Send a signal to processes and all below them, and return these. One that stands still has no new child."""
    import signal

    found = list(pids)
    if sys.platform == "win32":
        _send(found, number)
        return found
    for pid in found:  # which grows meanwhile
        _send([pid], signal.SIGSTOP)
        for _ in range(_STOPPING):
            if not _is_running(pid, but="T"):
                break
            threading.Event().wait(_POLL_S / 10)
        found += [child for child in children_of(pid) if child not in found and not _has_left(child)]
    _send(found, number)
    _send(found, signal.SIGCONT)
    return found


def _helpers() -> set[int]:
    """Return the processes that `multiprocessing` itself started: they end with it, and free others' memory."""
    tracker = getattr(sys.modules.get("multiprocessing.resource_tracker"), "_resource_tracker", None)
    server = getattr(sys.modules.get("multiprocessing.forkserver"), "_forkserver", None)
    return {getattr(tracker, "_pid", None) or 0, getattr(server, "_forkserver_pid", None) or 0}


def _has_left(pid: int) -> bool:
    """Return whether a process is in another session than this one."""
    with suppress(OSError, AttributeError):  # it has just ended; Windows has no sessions
        return os.getsid(pid) != os.getsid(0)
    return False


def _is_running(pid: int, *, but: str = "") -> bool:
    """Return whether a process runs: one that has ended is there until its parent asks for its exit code.

    Args:
        pid: its number.
        but: another state in which it does not run, e.g. `T` where it was stopped.
    """
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2][:1] not in {"Z", "X", but}
    except OSError:
        return pid in children()


def _command(pid: int) -> str:
    with suppress(OSError):
        return printable(Path(f"/proc/{pid}/cmdline").read_text(errors="replace").replace("\0", " ").strip(), limit=100)
    return ""


def _send(pids: Collection[int], number: int) -> None:
    for pid in pids:
        with suppress(OSError):  # it has just ended
            os.kill(pid, number)


def leave(code: int, before: AbstractSet[int]) -> None:
    """End this process and the children that were not there before, at once if a thread hangs, e.g. in a driver."""
    from busflow.runner import standard_error

    end_children(before, standard_error.write)
    if any(not thread.daemon for thread in threading.enumerate() if thread is not threading.main_thread()):
        os._exit(code)
    # The interpreter's three collections at exit took a tenth of a second.
    gc.collect()  # closes what a node has left open
    gc.freeze()
