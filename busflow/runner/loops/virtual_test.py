"""Virtual test: an async function that runs on a virtual loop of its own, and what makes one of a test."""

from __future__ import annotations

import asyncio
import functools
import signal
from collections.abc import Callable, Coroutine
from contextlib import suppress
from inspect import iscoroutinefunction, isfunction
from typing import Any, ParamSpec, TypeVar, overload

from busflow import timeouts
from busflow.errors import ExitCode, InvalidDeclaration, NotRunning
from busflow.runner.loops.schedule import Schedule
from busflow.runner.loops.virtual import HORIZON_S, THREAD_S, VirtualLoop
from busflow.runner.signals import SignalGuard

P = ParamSpec("P")
T = TypeVar("T")


def run_virtual(main: Coroutine[Any, Any, T], *, name: str, loop: VirtualLoop) -> T:
    """Run a coroutine on a virtual loop, in a task of that name, and close the loop.

    Ctrl-C cancels the task; where that does not end it, `KeyboardInterrupt` is raised in the line that runs.
    """
    __tracebackhide__ = True  # pytest shows the line that was interrupted
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        pass
    else:
        main.close()
        loop.close()
        raise NotRunning(f"{name} has an event loop of its own: call it in a plain def, and in no notebook")

    async def named() -> T:
        if task := asyncio.current_task():
            task.set_name(name)
            tasks.append(task)
        guard.precede_loop()
        return await main

    def cancel(_code: ExitCode) -> None:
        loop.leave_threads()
        with suppress(RuntimeError):  # the loop is closed
            loop.call_soon_threadsafe(lambda: [task.cancel() for task in tasks])

    tasks: list[asyncio.Task[Any]] = []
    guard = SignalGuard(cancel, grace_s=timeouts.current.grace, interrupts=True)
    try:
        with guard, asyncio.Runner(loop_factory=lambda: loop) as runner:
            loop.watchers += 1
            result = runner.run(named())
    finally:
        if guard.interrupt is not None and guard.interrupt.__traceback__ is not None:
            raise guard.interrupt
        if guard.received:
            signal.raise_signal(guard.received[0])  # whose handlers are those of before again
    for orphan in loop.orphans.end():
        raise orphan
    return result


@overload
def virtual_time(test: Callable[P, Coroutine[Any, Any, T]], /) -> Callable[P, T]: ...
@overload
def virtual_time(
    *, seed: int | None = None, horizon_s: float = HORIZON_S, follows: bool = False, thread_s: float = THREAD_S
) -> Callable[[Callable[P, Coroutine[Any, Any, T]]], Callable[P, T]]: ...
def virtual_time(
    test: Callable[P, Coroutine[Any, Any, T]] | None = None,
    /,
    *,
    seed: int | None = None,
    horizon_s: float = HORIZON_S,
    follows: bool = False,
    thread_s: float = THREAD_S,
) -> Callable[P, T] | Callable[[Callable[P, Coroutine[Any, Any, T]]], Callable[P, T]]:
    """Run an async test on a loop of its own, on virtual time. A plain decorator: no plugin is needed.

    >>> @virtual_time
    ... async def test_an_hour() -> float:
    ...     await asyncio.sleep(3600)
    ...     return asyncio.get_running_loop().time()
    >>> test_an_hour()
    3600.0

    Args:
        test: The test, an `async def`; it keeps its name and its parameters, which pytest reads as fixtures.
        seed: One order of events, the same every time; None is first in, first out.
        horizon_s: Where virtual time ends, with an error that names the tasks that still wait.
        follows: Time stands still but for what is published on `/clock`.
        thread_s: Real seconds that one call in a worker thread may take; time stands still for it.
    """

    def decorate(test: Callable[P, Coroutine[Any, Any, T]]) -> Callable[P, T]:
        refuse_plain(test, "@virtual_time")

        @functools.wraps(test)
        def run(*args: P.args, **kwargs: P.kwargs) -> T:
            schedule = None if seed is None else Schedule(seed)
            loop = VirtualLoop(schedule=schedule, horizon_s=horizon_s, follows=follows, thread_s=thread_s)
            return run_virtual(test(*args, **kwargs), name=test.__name__, loop=loop)

        return run

    return decorate if test is None else decorate(test)


def refuse_plain(test: Callable[..., object], decorator: str) -> None:
    """Refuse a test that is a plain function, unless something around the test itself made it one.

    Raises:
        InvalidDeclaration: it is, so it could await nothing.
    """
    if isfunction(test) and not iscoroutinefunction(test) and not hasattr(test, "__wrapped__"):
        raise InvalidDeclaration(f"{decorator} runs an async test: write async def {test.__name__}(…) below it")
