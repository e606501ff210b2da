"""Signals ask a run to stop, once; the second one, or the end of the grace, ends the process."""

import queue
import signal
import subprocess
import sys
from textwrap import dedent

import pytest

from busflow.errors import ExitCode
from busflow.runner.signals import CODES, SignalGuard, ending_signals
from tests.golden import Golden

NOT_IN_TIME = "busflow: the run did not end within {} s\n"

SIGNALS = sorted(CODES)


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_asks_once_with_its_code(number: signal.Signals):
    asked: queue.Queue[ExitCode] = queue.Queue()
    with SignalGuard(asked.put, grace_s=60):
        signal.raise_signal(number)
        assert asked.get(timeout=60) is CODES[number]
    assert asked.empty()


def test_handlers_return_after_the_block():
    before = [signal.getsignal(number) for number in SIGNALS], signal.set_wakeup_fd(-1)
    signal.set_wakeup_fd(before[1])
    with SignalGuard(print, grace_s=60):
        assert [signal.getsignal(number) for number in SIGNALS] != before[0]
    descriptor = signal.set_wakeup_fd(-1)
    signal.set_wakeup_fd(descriptor)
    assert ([signal.getsignal(number) for number in SIGNALS], descriptor) == before


def test_an_ignored_hangup_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert signal.SIGHUP not in ending_signals()
        with SignalGuard(print, grace_s=60):
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_another_signals_handler_runs_as_before():
    seen: list[int] = []
    before = signal.signal(signal.SIGUSR1, lambda number, _: seen.append(number))
    try:
        asked: queue.Queue[ExitCode] = queue.Queue()
        with SignalGuard(asked.put, grace_s=60):
            signal.raise_signal(signal.SIGUSR1)
        assert (seen, asked.empty()) == ([signal.SIGUSR1], True)
    finally:
        signal.signal(signal.SIGUSR1, before)


def ended(body: str) -> tuple[int, str]:
    """The exit code and standard error of a program whose main thread is in this body, within a guard."""
    program = f"""
        import os, signal, sys, threading
        from busflow import timeouts
        from busflow.runner.signals import SignalGuard

        def stuck():
            threading.Event().wait()

        {dedent(body).replace(chr(10), chr(10) + " " * 8)}
    """
    found = subprocess.run(
        [sys.executable, "-W", "ignore::DeprecationWarning", "-c", dedent(program)],  # of os.fork, since Python 3.12
        stderr=subprocess.PIPE,
        text=True,
        timeout=60,
        check=False,
    )
    return found.returncode, found.stderr


def test_the_grace_ends_the_process():
    assert ended("""
        with SignalGuard(lambda code: None, grace_s=0.01):
            os.kill(os.getpid(), signal.SIGTERM)
            stuck()
    """) == (ExitCode.TERMINATED, NOT_IN_TIME.format(0.01))


def test_a_second_signal_ends_the_process(golden: Golden):
    code, text = ended("""
        with SignalGuard(lambda code: os.kill(os.getpid(), signal.SIGINT), grace_s=60):
            os.kill(os.getpid(), signal.SIGTERM)
            stuck()
    """)
    assert code == ExitCode.TERMINATED
    golden(text)


def test_the_last_act_precedes_an_end_by_force():
    assert ended("""
        guard = SignalGuard(lambda code: None, grace_s=0.01)
        guard.last_act = lambda code: print(f"last: {code!r}", file=sys.stderr)
        with guard:
            os.kill(os.getpid(), signal.SIGTERM)
            stuck()
    """) == (ExitCode.TERMINATED, f"{NOT_IN_TIME.format(0.01)}last: {ExitCode.TERMINATED!r}\n")


def test_what_is_forked_at_a_forced_end_ends():
    """As a pool forks a process in place of each that is killed."""
    code, text = ended("""
        def last(code):
            child = os.fork()
            if not child:
                os._exit(9)
            print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), file=sys.stderr)

        guard = SignalGuard(lambda code: None, grace_s=0.01)
        guard.last_act = last
        with guard:
            os.kill(os.getpid(), signal.SIGTERM)
            stuck()
    """)
    assert (code, text.splitlines()[-1]) == (ExitCode.TERMINATED, str(int(ExitCode.TERMINATED)))


def test_a_last_act_that_hangs_keeps_nothing():
    code, _ = ended("""
        timeouts.current = timeouts.current.but(last_act=0.1)
        guard = SignalGuard(lambda code: None, grace_s=0.01)
        guard.last_act = lambda code: stuck()
        with guard:
            os.kill(os.getpid(), signal.SIGTERM)
            stuck()
    """)
    assert code == ExitCode.TERMINATED


def test_a_signal_sent_twice_at_once_is_one():
    """As `timeout` does, to the program and to its process group."""
    code, text = ended("""
        with SignalGuard(lambda code: None, grace_s=0.01):
            os.kill(os.getpid(), signal.SIGTERM)
            os.kill(os.getpid(), signal.SIGTERM)
            stuck()
    """)
    assert (code, text) == (ExitCode.TERMINATED, NOT_IN_TIME.format(0.01))


def test_a_time_limit_ends_with_the_grace():
    code, text = ended("""
        with SignalGuard(lambda code: None, grace_s=0.01) as guard:
            guard.end_after(0.01)
            stuck()
    """)
    assert (code, text) == (ExitCode.FAILED, NOT_IN_TIME.format(0.01))


def test_progress_gets_the_rest_of_the_time():
    code, text = ended("""
        guard = SignalGuard(lambda code: None, grace_s=0.01, around_s=0.02)
        guard.goes_on = lambda: True
        with guard:
            os.kill(os.getpid(), signal.SIGTERM)
            stuck()
    """)
    assert (code, text) == (ExitCode.TERMINATED, NOT_IN_TIME.format(0.03))


def test_a_forked_child_keeps_its_own_signals():
    code, text = ended("""
        with SignalGuard(lambda code: None, grace_s=60):
            child = os.fork()
            if not child:
                os.kill(os.getpid(), signal.SIGTERM)
                stuck()
            _, status = os.waitpid(child, 0)
            print(os.waitstatus_to_exitcode(status), file=sys.stderr)
    """)
    assert (code, text) == (0, f"{-signal.SIGTERM}\n")
