"""Strays: what nodes give to the event loop themselves, and who is told when it fails and nobody has asked.

Theory of operation. asyncio tells of a task's exception that nobody has retrieved when the task is collected: late, or
never while somebody holds it. So each loop that is busflow's makes tasks through `Strays`, which remembers on whose
behalf: the node whose method the coroutine is, or whose code makes it, or that made the task which makes it. A task
that fails has until its node's end to be awaited; the log says so before. What asyncio does tell, of a callback too,
fails the node at once. A message costs nothing of this: busflow's own tasks are passed on as they are.
"""

from __future__ import annotations

import asyncio
import os
import sys
import warnings
import weakref
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from traceback import walk_tb
from types import FrameType, TracebackType
from typing import Any, TextIO

import anyio

from busflow.bus.failure import Failure
from busflow.errors import Stray
from busflow.log import Log
from busflow.node.lifetime import Life
from busflow.node.node import Node
from busflow.text import printable
from busflow.validation.tracebacks import blame, reason, shown

PATIENCE_S = 0.1
"""How long a task that failed may wait to be awaited until the log says that nobody has."""

_BUSFLOW = str(Path(__file__).parents[1]) + os.sep
_LIBRARIES = tuple(str(Path(str(module.__file__)).parent) + os.sep for module in (asyncio, anyio))
_NOT_THE_USERS = (_BUSFLOW, *_LIBRARIES)
_LIFE: ContextVar[Life | None] = ContextVar("busflow_life", default=None)
"""Whose task runs, where a node made it itself."""

OnLost = Callable[[Stray], None]


@dataclass(frozen=True, slots=True)
class _Unheard:
    """A task that failed, of which it is not known yet whether anybody will ask."""

    life: Life | None
    name: str
    error: BaseException
    task: weakref.ref[asyncio.Task[Any]]

    @property
    def is_unheard(self) -> bool:
        """Whether the task is still there, and nobody has retrieved its exception."""
        return getattr(self.task(), "_log_traceback", False)  # what asyncio itself decides by; there is no public way

    @property
    def origin(self) -> str:
        """What failed, for people."""
        return f"task {self.name} that nobody awaited: use self.spawn(…)"


class Strays:
    """Makes the tasks of one event loop, and hears of what failed there."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        """Have all tasks of this loop made here from now on."""
        self.on_lost: list[OnLost] = []
        """Who is told of what belongs to no node: the graphs that run on this loop."""
        self.lost: list[Stray] = []
        """What failed when no graph was there any more."""
        self._loop = loop
        self._make: Any = loop.get_task_factory() or _plain_task
        self._failed: dict[int, _Unheard] = {}
        loop.set_task_factory(self)
        loop.set_exception_handler(self._hear)

    def __call__(self, loop: asyncio.AbstractEventLoop, coroutine: Any, **options: Any) -> asyncio.Task[Any]:
        """Make a task, as asyncio asks for it."""
        first: FrameType | None = getattr(coroutine, "cr_frame", None)
        frames = [*_users([first]), *_users(_outwards(sys._getframe(1)))]  # noqa: SLF001  # documented in spite of its name
        if not frames:
            return self._make(loop, coroutine, **options)
        life = _life_in(frames)
        if life is None and asyncio.current_task(loop) is not None:  # a callback may be there on anybody's behalf
            life = _LIFE.get()
        token = _LIFE.set(life)
        try:
            task: asyncio.Task[Any] = self._make(loop, coroutine, **options)
        finally:
            _LIFE.reset(token)
        task.add_done_callback(partial(self._done, life, getattr(coroutine, "__name__", "")))
        return task

    def close(self, life: Life | None = None) -> None:
        """A node has ended, or the loop: tasks that failed and were never awaited count as failures now."""
        for stray in [each for each in self._failed.values() if life is None or each.life is life]:
            del self._failed[id(stray.error)]
            if stray.is_unheard:
                self._fail(stray.life, stray.origin, stray.error)
            if (task := stray.task()) is not None:
                task.exception()  # asyncio need not tell it as well

    def _done(self, life: Life | None, name: str, task: asyncio.Task[Any]) -> None:
        error: BaseException | None = getattr(task, "_exception", None)  # to ask for it would be to retrieve it
        if error is None:
            return
        stray = _Unheard(life, name or task.get_name(), error, weakref.ref(task))
        self._failed[id(error)] = stray
        if life is not None:
            life.on_end = partial(self.close, life)
        self._loop.call_later(PATIENCE_S, self._look, stray)

    def _look(self, stray: _Unheard) -> None:
        if not stray.is_unheard:
            self._failed.pop(id(stray.error), None)
        elif stray.life is not None:
            place = blame(stray.error)
            stray.life.log.warning(
                "a task that the node made has failed, and nobody has awaited it: use self.spawn(…)",
                task=stray.name,
                error=reason(stray.error),
                **({"at": str(place)} if place else {}),
            )

    def _hear(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """What asyncio tells: a task that is gone with its exception, a callback that raised."""
        error = context.get("exception")
        if not isinstance(error, BaseException):
            loop.default_exception_handler(context)
            return
        stray = self._failed.pop(id(error), None)
        if stray is not None:
            life, origin = stray.life, stray.origin
        else:
            frames = [frame for frame, _ in walk_tb(error.__traceback__)]
            life = _life_in(frames[::-1])
            error = error.with_traceback(_without_libraries(error.__traceback__))
            origin = "a callback of the event loop" if "handle" in context else printable(context["message"], limit=200)
        if loop.is_closed() or not self.on_lost:
            loop.default_exception_handler(context)
        if not loop.is_closed():  # from any thread, where the collector works
            loop.call_soon_threadsafe(self._fail, life, origin, error)

    def _fail(self, life: Life | None, origin: str, error: BaseException) -> None:
        if life is not None and life.on_failure is not None and self.on_lost:
            life.fail(f"{life.kind} ({origin})", error)
            return
        whose = "no node is known for what" if life is None else f"node {life.name}"
        lost = Stray(f"{whose} {Failure('', origin, error).summary}")
        lost.__cause__ = error
        for tell in self.on_lost or [self.lost.append]:
            tell(lost)


def catch_strays(loop: asyncio.AbstractEventLoop) -> None:
    """Have a loop, which has to be one of busflow's own, tell of what fails there."""
    if not isinstance(loop.get_task_factory(), Strays):
        Strays(loop)


def hear_of_strays(loop: asyncio.AbstractEventLoop, on_lost: OnLost) -> Callable[[], None]:
    """Be told of what fails on a loop and belongs to no node, if the loop is one of busflow's, until told otherwise."""
    factory = loop.get_task_factory()
    if not isinstance(factory, Strays):
        return lambda: None
    factory.on_lost.append(on_lost)
    return partial(factory.on_lost.remove, on_lost)


def lost_on(loop: asyncio.AbstractEventLoop) -> list[Stray]:
    """What failed on a loop that is closed, and nobody was told of."""
    factory = loop.get_task_factory()
    if not isinstance(factory, Strays):
        return []
    factory.close()
    return factory.lost


@contextmanager
def forgotten_awaits_told(log: Log) -> Generator[None]:
    """Let the log say where a coroutine was made and never awaited, instead of Python on standard error."""
    before = warnings.showwarning

    def show(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        if not (issubclass(category, RuntimeWarning) and str(message).endswith(" was never awaited")):
            before(message, category, filename, lineno, file, line)
            return
        life = _life_in(list(_users(_outwards(sys._getframe(1)))))  # noqa: SLF001  # as above
        told = log.bind("busflow") if life is None else life.log
        told.warning(
            f"{message}, so nothing of it has run: write await before the call", at=f"{shown(filename)}:{lineno}"
        )

    warnings.showwarning = show
    try:
        yield
    finally:
        warnings.showwarning = before


def _plain_task(loop: asyncio.AbstractEventLoop, coroutine: Any, **options: Any) -> asyncio.Task[Any]:
    return asyncio.Task(coroutine, loop=loop, **options)


def _without_libraries(trace: TracebackType | None) -> TracebackType | None:
    """A traceback from the user's first line on: the loop's own are no place to look at."""
    while trace is not None and trace.tb_next and trace.tb_frame.f_code.co_filename.startswith(_LIBRARIES):
        trace = trace.tb_next
    return trace


def _outwards(frame: FrameType | None) -> Iterator[FrameType | None]:
    """A frame and those around it, up to where busflow called."""
    while frame is not None and not frame.f_code.co_filename.startswith(_BUSFLOW):
        yield frame
        frame = frame.f_back


def _users(frames: Iterator[FrameType | None] | list[FrameType | None]) -> Iterator[FrameType]:
    for frame in frames:
        if frame is not None and not frame.f_code.co_filename.startswith(_NOT_THE_USERS):
            yield frame


def _life_in(frames: list[FrameType]) -> Life | None:
    """That of the first node whose method is among the frames."""
    for frame in frames:
        code = frame.f_code
        node = frame.f_locals.get(code.co_varnames[0]) if code.co_argcount else None
        if isinstance(node, Node):
            return node._runtime.life  # noqa: SLF001  # pyright: ignore[reportPrivateUsage]  # as runtime_of, of what may be half made
    return None
