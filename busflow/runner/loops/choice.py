"""Loop choice: which event loop a run has, busflow's own or uvloop's, which no other file imports."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Literal, TypeAlias, get_args

from busflow.clock import monotonic
from busflow.errors import LaunchError, Problem, how_to_install
from busflow.runner.loops.system import LoopFactory, new_event_loop
from busflow.text import did_you_mean, printable

LoopName: TypeAlias = Literal["busflow", "uvloop"]
"""Names of event loops that a run may ask for."""


def chosen_loop(name: str, *, simulated: bool = False) -> LoopFactory:
    """Return the factory of the event loop of this name, for a run on real time or on simulated.

    Raises:
        LaunchError: there is none, it is not installed, or simulated time cannot have it.
    """
    if name == "busflow":
        return new_event_loop
    if name not in get_args(LoopName):
        fix = did_you_mean(name, get_args(LoopName))
        raise LaunchError([Problem("unknown-event-loop", f"there is no event loop {printable(name)}", fix)])
    if simulated:
        text = f"simulated time has an event loop of its own, and cannot have {name}"
        raise LaunchError([Problem("event-loop", text, "leave it out, or run on real time")])
    try:
        return _uvloop()
    except ImportError as error:
        text = f"the event loop {name} needs one more package ({error})"
        raise LaunchError([Problem("event-loop", text, how_to_install(f"busflow[{name}]"))]) from None


def _uvloop() -> Callable[[], Any]:
    """Return the loop of uvloop, with the time of a run's clock; as busflow's it ends without waiting for threads."""
    import uvloop

    class Loop(uvloop.Loop):
        def __init__(self) -> None:
            super().__init__()
            self.set_default_executor(ThreadPoolExecutor(thread_name_prefix="uvloop"))

        def set_default_executor(self, executor: Any) -> None:
            super().set_default_executor(executor)
            self._pool = executor

        async def shutdown_default_executor(self, timeout: float | None = None) -> None:  # noqa: ARG002, ASYNC109  # as it is called
            self._pool.shutdown(wait=False, cancel_futures=True)

        def time(self) -> float:
            """Return the monotonic clock's time.

            uvloop's own is that of the beginning of this turn, in whole milliseconds: a timer that is set later in a
            long turn would be late by as much. On macOS it is another clock besides, which goes on while the machine
            sleeps.
            """
            return monotonic()

    return Loop
