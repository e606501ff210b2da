"""`busflow.run` of a launch file with several processes leaves the process that calls it as it was."""

import asyncio
import gc
import os
import signal
import sys
import threading
import warnings
from pathlib import Path

import pytest

import busflow
from busflow.recording.bag.bag import Bag
from busflow.runner.garbage import is_frozen
from tests.processes.conftest import NODES

PATIENCE_S = 30.0
"""How long a thread that is ending may take, on however slow a machine."""

FILE = f"""
plugins: [{NODES}]
env: {{ROBOT: left-handed}}
processes: {{far: {{restart: never}}}}
nodes:
  here: {{plugin: fails_once, restart: {{policy: on-failure, backoff: [1ms, 1ms]}}}}
  there: {{plugin: fails_once, process: far, restart: {{policy: on-failure, backoff: [1ms, 1ms]}}}}
"""


@pytest.fixture
def robot(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "marks").mkdir()
    file = tmp_path / "robot.yaml"
    file.write_text(FILE)
    return file


def wakeup_fd():
    number = signal.set_wakeup_fd(-1)
    signal.set_wakeup_fd(number)
    return number


def file_mode_mask():
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def descriptors():
    """The open files of this process by number; the one that lists them is closed again."""
    return {name for name in os.listdir("/dev/fd") if Path("/dev/fd", name).exists()}  # noqa: PTH208  # numbers


def state():
    """What a run could change of the process; what is imported stays imported."""
    return {
        "collector": (gc.isenabled(), gc.get_threshold(), is_frozen(), [*gc.callbacks]),
        "signal handlers": {number: signal.getsignal(number) for number in signal.valid_signals()},
        "blocked signals": signal.pthread_sigmask(signal.SIG_BLOCK, []),
        "wake-up descriptor": wakeup_fd(),
        "environment": {**os.environ},
        "sys.path": [*sys.path],
        "sys hooks": (sys.excepthook, sys.unraisablehook, sys.displayhook, sys.breakpointhook),
        "threading.excepthook": threading.excepthook,
        "tracing": (sys.gettrace(), sys.getprofile(), threading.gettrace(), threading.getprofile()),
        "coroutines": (sys.get_asyncgen_hooks(), sys.get_coroutine_origin_tracking_depth()),
        "interpreter": (sys.getrecursionlimit(), sys.getswitchinterval(), sys.dont_write_bytecode),
        "standard streams": (sys.stdin, sys.stdout, sys.stderr),
        "warnings": ([*warnings.filters], warnings.showwarning, warnings.formatwarning),
        "event loop": (event_loop_policy(), event_loop_policy()._local._loop),
        "folder and file mode mask": (Path.cwd(), file_mode_mask()),
        "priority": os.getpriority(os.PRIO_PROCESS, 0),
    }


def event_loop_policy():
    with warnings.catch_warnings(action="ignore", category=DeprecationWarning):  # since Python 3.14
        return asyncio.get_event_loop_policy()


def threads_left_by(before):
    """The threads that are there now and were not before, once those that are ending have ended."""
    for thread in {*threading.enumerate()} - before:
        thread.join(PATIENCE_S)
    return {*threading.enumerate()} - before


@pytest.mark.parametrize(
    "event_loop", ["busflow", pytest.param("uvloop", marks=[pytest.mark.long, pytest.mark.needs("uvloop")])]
)
def test_run_restores_the_process(robot, event_loop, tmp_path_factory, capfd):
    to = tmp_path_factory.mktemp("recordings")
    gc.freeze()  # a policy of the program's own, which the restart of a node leaves alone
    try:
        restarts = restarts_in_a_run_that_restores_the_process(capfd, robot, event_loop=event_loop, record=to / "first")
    finally:
        gc.unfreeze()
    assert restarts == 2
    files = descriptors()  # what the first run imports may open files of its own
    options = {"event_loop": event_loop, "record": to / "second"}
    assert restarts_in_a_run_that_restores_the_process(capfd, robot, **options) == 0
    assert descriptors() == files
    with Bag(options["record"]) as bag:
        assert (bag.complete, [each.facts.process for each in bag.series]) == (True, ["main", "far"])


def restarts_in_a_run_that_restores_the_process(capfd, robot, **options):
    before, threads = state(), {*threading.enumerate()}
    code = busflow.run(robot, **options)
    assert state() == before
    assert threads_left_by(threads) == set()
    log = capfd.readouterr().err
    assert code == 0, log
    return log.count("is restarted")
