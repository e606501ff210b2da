"""The keeper: the order of its signals, and the process that it is, with real programs and what they start."""

import errno
import json
import os
import select
import signal
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import repeat
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from busflow.programs import keeper

PATIENCE_S = 60.0
"""How long to wait for what must come, on however slow a machine; no measure of busflow."""


class Kept:
    """A keeper that was started, and what comes of it."""

    def __init__(self, command: Sequence[str], folder: Path, *, grace_s: float, ignoring: bool) -> None:
        before = signal.signal(signal.SIGINT, signal.SIG_IGN) if ignoring else None
        reading, writing = os.pipe()
        self._report = os.fdopen(reading, "rb")
        self.process = subprocess.Popen(
            [sys.executable, "-I", "-S", keeper.__file__, str(writing)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            pass_fds=(writing,),
            process_group=0,
        )
        if before is not None:
            signal.signal(signal.SIGINT, before)
        os.close(writing)
        order = {"command": list(command), "cwd": str(folder), "grace_s": grace_s}
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(order).encode() + b"\n")
        self.process.stdin.flush()

    def said(self) -> dict[str, Any]:
        """Its next message."""
        return json.loads(self._report.readline())

    def printed(self) -> str:
        """The next line of its program."""
        assert self.process.stdout is not None
        return self.process.stdout.readline().decode().strip()

    def stop(self) -> None:
        """End its input, as the death of the run does."""
        assert self.process.stdin is not None
        self.process.stdin.close()

    def close(self) -> None:
        self.process.kill()
        self.process.wait(PATIENCE_S)
        for each in (self._report, self.process.stdin, self.process.stdout):
            with suppress(OSError):
                each.close()


@pytest.fixture
def keep(tmp_path: Path) -> Iterator[Any]:
    started: list[Kept] = []

    def keep(*command: str, grace_s: float = 600.0, ignoring: bool = False) -> Kept:
        started.append(Kept(command, tmp_path, grace_s=grace_s, ignoring=ignoring))
        return started[-1]

    yield keep
    for each in started:
        each.close()


@contextmanager
def watched(pid: int) -> Iterator[int]:
    """A descriptor that is readable once the process has ended."""
    descriptor = os.pidfd_open(pid)
    try:
        yield descriptor
    finally:
        with suppress(ProcessLookupError):
            signal.pidfd_send_signal(descriptor, signal.SIGKILL)
        os.close(descriptor)


def ends(descriptor: int) -> bool:
    return bool(select.select([descriptor], [], [], PATIENCE_S)[0])


def signals_of(*steps: Any) -> list[signal.Signals]:
    """The signals that a program gets: a step is an order to stop, or signals that the keeper itself gets."""
    stopping, sent = keeper.Stopping(), []
    for step in steps:
        stopping.order() if step == "order" else stopping.on_signals(bytes(step))
        if stopping.is_due:
            sent.append(stopping.next())
    return sent


def test_each_grace_brings_next_signal():
    grace = (signal.SIGALRM,)
    assert signals_of("order", grace, grace) == [signal.SIGINT, signal.SIGTERM, signal.SIGKILL]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signal_is_an_order_to_stop(number):
    assert signals_of((signal.SIGCHLD, number)) == [signal.SIGINT]


def test_more_orders_hasten_nothing():
    assert signals_of("order", (signal.SIGINT, signal.SIGTERM), "order", (signal.SIGCHLD,)) == [signal.SIGINT]


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has /proc")
def test_descendants_are_found_whatever_their_names(tmp_path):
    shell = tmp_path / "a) S 1 ("
    shell.symlink_to("/bin/sh")
    with subprocess.Popen([shell, "-c", "sh -c 'echo $$; read line'; true"], stdin=-1, stdout=-1) as parent:
        child = int(parent.stdout.readline())
        assert keeper.descendants(parent.pid) == [child]
        assert {parent.pid, child} <= set(keeper.descendants(os.getpid()))
        parent.stdin.close()


class System:
    """A system without subreapers for a keeper in this process: its program has the number 7, and no time passes."""

    def __init__(self, reaped: Iterable[tuple[int, int]], last: int | None = None) -> None:
        self.sent: list[int] = []
        self._reaped, self._last = iter(reaped), last

    def waitpid(self, *_: int) -> tuple[int, int]:
        if (found := next(self._reaped, None)) is None:
            raise ChildProcessError
        return found

    def killpg(self, _group: int, number: int) -> None:
        if self._last in self.sent:  # which has ended the group
            raise ProcessLookupError
        self.sent += [number] if number else []

    def keep(self) -> list[dict[str, Any]]:
        """Run a keeper whose run dies at once, and return what it reports."""
        (orders, order), (reports, report) = os.pipe(), os.pipe()
        os.write(order, json.dumps({"command": ["driver"], "cwd": "/", "grace_s": 1.0}).encode() + b"\n")
        os.close(order)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "platform", "darwin")
            patch.setattr(subprocess, "Popen", lambda *_args, **_words: SimpleNamespace(pid=7))
            patch.setattr(signal, "signal", lambda *_: None)
            patch.setattr(signal, "set_wakeup_fd", lambda *_args, **_words: None)
            patch.setattr(signal, "setitimer", lambda *_: os.write(kept._wake, bytes([signal.SIGALRM])))
            patch.setattr(os, "waitpid", self.waitpid)
            patch.setattr(os, "killpg", self.killpg)
            patch.setattr(keeper, "descendants", lambda _: [])
            kept = keeper.Keeper(orders, report)
            kept.run()
        for each in (orders, report, kept._woken, kept._wake):
            os.close(each)
        with os.fdopen(reports) as lines:
            return [json.loads(line) for line in lines]


def test_process_that_cannot_be_killed_is_left():
    system = System(repeat((0, 0)))
    assert system.keep() == [{"pid": 7}, {"code": None, "killed": True}]
    assert system.sent == [signal.SIGINT, signal.SIGTERM, signal.SIGKILL]


def test_group_is_stopped_where_no_subreapers_are():
    system = System([(7, 0)], last=signal.SIGTERM)
    assert system.keep() == [{"pid": 7}, {"code": 0, "killed": False}]
    assert system.sent == [signal.SIGINT, signal.SIGTERM]


def test_output_number_and_exit_code_are_reported(keep, tmp_path):
    kept = keep("sh", "-c", "echo $$; pwd; exit 3")
    assert kept.said() == {"pid": int(kept.printed())}
    assert kept.printed() == str(tmp_path)
    assert kept.said() == {"code": 3, "killed": False}
    assert kept.process.wait(PATIENCE_S) == 0


def test_program_reads_end_of_input(keep):
    kept = keep("cat")
    assert "pid" in kept.said()
    assert kept.said()["code"] == 0


def test_impossible_command_is_reported(keep, tmp_path):
    kept = keep(str(tmp_path / "no-such-command"))
    assert kept.said() == {"failed": os.strerror(errno.ENOENT)}
    assert kept.process.wait(PATIENCE_S) == 0


@pytest.mark.parametrize("ignoring", [False, True], ids=["handled", "ignored by the run"])
def test_end_of_run_interrupts_program(keep, ignoring):
    kept = keep("sleep", "600", ignoring=ignoring)
    kept.said()
    kept.stop()
    assert kept.said() == {"code": -signal.SIGINT, "killed": False}


def test_signal_to_keeper_stops_program(keep):
    kept = keep("sleep", "600")
    kept.said()
    kept.process.terminate()
    assert kept.said() == {"code": -signal.SIGINT, "killed": False}


@pytest.mark.parametrize(("ignored", "end"), [("INT", signal.SIGTERM), ("INT TERM", signal.SIGKILL)])
def test_program_that_ignores_signals_gets_the_next(keep, ignored, end):
    kept = keep("sh", "-c", f"trap '' {ignored}; echo on; exec sleep 600", grace_s=0.3)
    kept.said()
    assert kept.printed() == "on"
    kept.stop()
    assert kept.said() == {"code": -end, "killed": end == signal.SIGKILL}


@pytest.mark.parametrize(
    "command",
    [
        "sh -c 'echo $$; exec sleep 600'; true",
        pytest.param(
            "setsid sh -c 'echo $$; exec sleep 600' & exec sleep 600",
            marks=pytest.mark.skipif(sys.platform != "linux", reason="only Linux has subreapers"),
        ),
    ],
    ids=["in its group", "in a session of its own"],
)
def test_child_of_program_is_ended(keep, command):
    kept = keep("sh", "-c", command, grace_s=0.3)
    kept.said()
    with watched(int(kept.printed())) as child:
        kept.stop()
        assert ends(child)
    assert kept.said()["killed"] is False


def test_what_program_leaves_behind_is_stopped(keep):
    kept = keep("sh", "-c", "mkfifo on; sh -c 'echo $$; echo > on; exec sleep 600' & read line < on", grace_s=0.3)
    kept.said()
    with watched(int(kept.printed())) as child:
        assert ends(child)
    assert kept.said() == {"code": 0, "killed": False}


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux kills a child with its parent")
def test_killed_keeper_takes_program_along(keep):
    kept = keep("sleep", "600")
    with watched(kept.said()["pid"]) as program:
        kept.process.kill()
        assert ends(program)
