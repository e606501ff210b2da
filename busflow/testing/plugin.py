"""The pytest plugin: a marker and a fixture by which async tests run on virtual time. Imports nothing heavy.

pytest loads this at its start in every project that has busflow installed. It works beside pytest-asyncio and anyio's
plugin by running marked tests itself, before they would.
"""

from __future__ import annotations

import atexit
import inspect
import os
import sys
import threading
from collections.abc import Callable, Generator
from pathlib import Path
from traceback import walk_tb
from types import FrameType
from typing import TYPE_CHECKING, Any

import pytest

from busflow.runner import own_process, standard_error

if TYPE_CHECKING:
    from busflow.testing.harnesses import Harness

_MARKERS = (
    "virtual_time(seed=None, horizon_s=86400): run this async test on virtual time, with busflow.testing.",
    "explore(schedules=100, horizon_s=86400): run this async test under many orders of events, with busflow.testing.",
)

_HOW = (
    "busflow runs an async test on virtual time: write @virtual_time above it (from busflow.testing), or let it take "
    "the fixture harness. For any other loop:"
)


@pytest.fixture(name="harness")
def harness_factory() -> Callable[..., Harness]:
    """Runs a graph on virtual time: `async with harness("configs/lab1.yaml", seed=1) as lab`."""
    from busflow.testing import harness

    return harness


def pytest_configure(config: pytest.Config) -> None:
    """Register the markers, and the hooks after all installed plugins, so that they are called first.

    What is captured of standard error is not shown while a test is stuck, so busflow gets the terminal itself.
    """
    standard_error.descriptor = os.dup(2)  # not captured here, between pytest's start and its first test
    for marker in _MARKERS:
        config.addinivalue_line("markers", marker)
    config.pluginmanager.register(_Caller(), "busflow-caller")
    config.pluginmanager.register(_Explainer(), "busflow-explainer")


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    """Let pytest end although a call in a thread of a test hangs: Python would wait for it at its exit, for ever."""
    if own_process.hanging:
        threading._register_atexit(_leave, session)  # type: ignore[attr-defined]  # noqa: SLF001  # nothing public comes before the wait


def _leave(session: pytest.Session) -> None:
    if any(thread.is_alive() for thread in own_process.hanging):
        atexit._run_exitfuncs()  # noqa: SLF001  # os._exit runs none of them
        sys.stdout.flush()
        os._exit(int(session.exitstatus))


def pytest_unconfigure() -> None:
    """Give back the terminal."""
    if standard_error.descriptor != 2:
        os.close(standard_error.descriptor)
        standard_error.descriptor = 2


def pytest_report_header() -> str | None:
    """Name the seed in pytest's header when one is replayed."""
    seed = os.environ.get("BUSFLOW_SEED")
    return f"busflow: BUSFLOW_SEED={seed}" if seed else None


class _Caller:
    """Runs the tests that are meant for a virtual loop."""

    @pytest.hookimpl(tryfirst=True)
    def pytest_pyfunc_call(self, pyfuncitem: pytest.Function) -> bool | None:
        """Run the test if it is async and asks for virtual time; otherwise leave it to others."""
        decorate = _decorator(pyfuncitem)
        if decorate is None:
            return None
        test: Any = pyfuncitem.obj
        if (hypothesis := getattr(test, "hypothesis", None)) is not None:
            if (inner := _async_test(hypothesis.inner_test)) is not None:
                hypothesis.inner_test = decorate(inner)
            return None  # hypothesis calls it, with each of its examples
        if (inner := _async_test(test)) is None:
            return None
        names = inspect.signature(inner).parameters
        decorate(inner)(**{name: pyfuncitem.funcargs[name] for name in names if name in pyfuncitem.funcargs})
        return True


class _Explainer:
    """Adds a hint to pytest's failure of an async test that no plugin runs; leaves busflow's frames out of others."""

    @pytest.hookimpl(hookwrapper=True, tryfirst=True)
    def pytest_pyfunc_call(self, pyfuncitem: pytest.Function) -> Generator[None, Any]:
        """Add to the failure how busflow runs an async test; a test of busflow itself shows all frames."""
        outcome = yield
        error = outcome.excinfo[1] if outcome.excinfo else None
        own = pyfuncitem.config.rootpath / "busflow" / "testing" / Path(__file__).name
        if error is not None and not own.exists():
            _hide_frames(error)
        if isinstance(error, pytest.fail.Exception) and str(error.msg).startswith("async def functions are not"):
            error.msg = f"{_HOW}\n{error.msg}"


def _hide_frames(error: BaseException | None) -> None:
    """Let pytest leave out the frames of busflow and pydantic; `--full-trace` shows them.

    They stay where one of busflow's own lines raised what is no error of busflow's.
    """
    from busflow.errors import BusflowError

    while error is not None:
        frames = [(frame, _package(frame)) for frame, _ in walk_tb(error.__traceback__)]
        if isinstance(error, BusflowError) or (frames and frames[-1][1] != "busflow"):
            for frame, package in frames:
                if package in {"busflow", "pydantic"}:
                    frame.f_locals["__tracebackhide__"] = True
        error = error.__cause__ or error.__context__


def _package(frame: FrameType) -> str:
    return str(frame.f_globals.get("__name__", "")).partition(".")[0]


def _async_test(test: Any) -> Any:
    """Return the async test itself, also where pytest-asyncio's auto mode has wrapped it."""
    return next(
        (each for each in (test, getattr(test, "__wrapped__", None)) if inspect.iscoroutinefunction(each)), None
    )


def _decorator(item: pytest.Function) -> Callable[[Any], Callable[..., object]] | None:
    """Return the decorator for virtual time: that of the test's marker, or the plain one for a test with a harness."""
    from busflow.testing import explore, virtual_time

    if (marker := item.get_closest_marker("explore")) is not None:
        return explore(**marker.kwargs)
    if (marker := item.get_closest_marker("virtual_time")) is not None:
        return virtual_time(**marker.kwargs)
    if "harness" in item.fixturenames and not _has_a_loop(item):
        return virtual_time
    return None


def _has_a_loop(item: pytest.Function) -> bool:
    """Return whether the user chose another plugin for the test's loop, which may be a virtual one."""
    factories = getattr(item.config.hook, "pytest_asyncio_loop_factories", None)
    chosen = factories is not None and bool(factories.get_hookimpls())
    return "anyio_backend" in item.fixturenames or (chosen and item.get_closest_marker("asyncio") is not None)
