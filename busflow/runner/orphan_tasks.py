"""Orphan tasks: a task that a node itself gives to the event loop fails that node, also if nothing awaits it.

Theory of operation. asyncio reports an exception that nothing retrieved when the task is collected, and never while
something holds the task. So `OrphanTasks` makes the tasks of a loop that runs a graph. It notes the node of a task that
code of users makes: the node whose plain method makes it, or the node of the task that runs. Where neither is known,
the traceback may have a node's method. A task that failed may be awaited until its node ends; the log warns before.
What asyncio does report, of callbacks too, fails the node at once. On the loop of a program it is a guest: what is no
node's stays as the program has it, and so does the loop when the last graph has left.
"""

from __future__ import annotations

import asyncio
import inspect
import os
import sys
import warnings
import weakref
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from traceback import walk_stack, walk_tb
from types import FrameType
from typing import Any

import anyio

from busflow import timeouts
from busflow.bus.failure import Failure
from busflow.errors import Stray
from busflow.log import Log
from busflow.node.lifetime import TASK_NODE, NodeLifetime
from busflow.node.node import Node
from busflow.text import printable
from busflow.validation.tracebacks import reason, shown, user_line

BUSFLOW = str(Path(__file__).parents[1]) + os.sep
"""Beginning of the file names of busflow's own code."""
_LIBRARIES = tuple(str(Path(str(module.__file__)).parent) + os.sep for module in (asyncio, anyio))


class OrphanTasks:
    """Makes the tasks of one event loop, and finds what failed there and is awaited by nothing."""

    def __init__(self, loop: asyncio.AbstractEventLoop, *, guest: bool = False) -> None:
        """Make all tasks of this loop from now on; as a guest, until the last graph leaves."""
        self.on_orphan: list[Callable[[Stray], None]] = []
        """Called with each failure that is no node's: the graphs on this loop give up."""
        self._left: list[Stray] = []
        self._loop = loop
        self._guest = guest
        self._before = loop.get_task_factory(), loop.get_exception_handler()
        self._failed = weakref.WeakSet[asyncio.Task[Any]]()
        self._report = self._before[1] or type(loop).default_exception_handler
        loop.set_task_factory(self)
        loop.set_exception_handler(self._on_exception)

    @classmethod
    def of(cls, loop: asyncio.AbstractEventLoop) -> OrphanTasks | None:
        """Return the one of a loop, if the loop has one."""
        return found if isinstance(found := loop.get_task_factory(), cls) else None

    def leave(self, on_orphan: Callable[[Stray], None]) -> None:
        """Forget a graph that has ended; a guest then leaves the loop as it found it."""
        self.on_orphan.remove(on_orphan)
        if self._guest and not self.on_orphan and OrphanTasks.of(self._loop) is self:
            self._loop.set_task_factory(self._before[0])
            self._loop.set_exception_handler(self._before[1])

    def __call__(self, loop: asyncio.AbstractEventLoop, coroutine: Any, **options: Any) -> asyncio.Task[Any]:
        """Make a task, as asyncio asks for it."""
        make = self._before[0]
        task: Any = make(loop, coroutine, **options) if make else asyncio.Task(coroutine, loop=loop, **options)
        if makers := list(_user_frames(sys._getframe(1))):  # noqa: SLF001  # documented in spite of its name
            setattr(task, TASK_NODE, _maker(makers))
            task.add_done_callback(self._on_done)
        return task

    def end(self) -> list[Stray]:
        """Return the failures that came when there was no graph any more, now that the loop has ended."""
        self._count(None)
        return self._left

    def _count(self, life: NodeLifetime | None) -> None:
        """Count failed tasks that nothing has awaited as failures, now that their node, or the loop, has ended."""
        for task in tuple(self._failed):
            if (error := _unawaited(task)) is not None and life in {None, owner := _life(task, error)}:
                self._fail(owner, _origin(task), error)
                task.exception()  # asyncio need not report it as well

    def _on_done(self, task: asyncio.Task[Any]) -> None:
        if (error := _unawaited(task)) is None or ((life := _life(task, error)) is None and self._guest):
            return
        self._failed.add(task)
        if life is not None:
            life.on_end = partial(self._count, life)
            self._loop.call_later(timeouts.current.unawaited, self._warn, life, weakref.ref(task))

    def _warn(self, life: NodeLifetime, reference: weakref.ref[asyncio.Task[Any]]) -> None:
        if (task := reference()) is not None and (error := _unawaited(task)) is not None:
            at = {"at": str(place)} if (place := user_line(error)) else {}
            text = "a task that the node made has failed without being awaited: use self.spawn(…)"
            life.log.warning(text, task=_name(task), error=reason(error), **at)

    def _on_exception(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Handle asyncio's report of a task that is gone with its exception, or of a callback that raised."""
        error: Any = context.get("exception")
        task: Any = context.get("future")
        life = _life(task, error) if isinstance(error, BaseException) else None
        ours = isinstance(error, BaseException) and not loop.is_closed() and (life is not None or not self._guest)
        if not ours or not self.on_orphan:
            self._report(loop, context)
        if ours:
            where = "a callback of the event loop" if "handle" in context else printable(context["message"], limit=200)
            origin = _origin(task) if hasattr(task, TASK_NODE) else where
            loop.call_soon_threadsafe(self._fail, life, origin, error)  # in any thread, where the collector works

    def _fail(self, life: NodeLifetime | None, origin: str, error: BaseException) -> None:
        if life is not None and life.on_failure is not None and self.on_orphan:
            life.fail(f"{life.kind} ({origin})", error)
            return
        owner = "no node is known for what" if life is None else f"node {life.name}"
        orphan = Stray(f"{owner} {Failure('', origin, error).summary}")
        orphan.__cause__ = error
        for report in self.on_orphan or [self._left.append]:
            report(orphan)


def _life(task: Any, error: BaseException) -> NodeLifetime | None:
    """Return the lifetime of the node that made a task, or else of a method that the error has left."""
    return getattr(task, TASK_NODE, None) or life_in(reversed([frame for frame, _ in walk_tb(error.__traceback__)]))


def _unawaited(task: asyncio.Task[Any]) -> BaseException | None:
    """Return the exception of a task that nothing has retrieved; to ask the task for it would be to retrieve it."""
    return getattr(task, "_exception", None) if getattr(task, "_log_traceback", False) else None  # no public way


def _name(task: asyncio.Task[Any]) -> str:
    return getattr(task.get_coro(), "__name__", "") or task.get_name()


def _origin(task: asyncio.Task[Any]) -> str:
    return f"task {_name(task)} that was not awaited: use self.spawn(…)"


@contextmanager
def unawaited_logged(log: Log) -> Generator[None]:
    """Log where a coroutine was made and never awaited, instead of Python's warning on standard error."""
    before = warnings.showwarning

    def show(message: Warning | str, category: type[Warning], filename: str, lineno: int, *rest: Any) -> None:
        if not (issubclass(category, RuntimeWarning) and str(message).endswith(" was never awaited")):
            before(message, category, filename, lineno, *rest)
            return
        frame = sys._getframe(1)  # noqa: SLF001  # as above
        life, where = life_in(_user_frames(frame)), {"at": f"{shown(filename)}:{lineno}"}
        if filename.startswith(BUSFLOW):  # a variable kept it until the handler returned to the timer or endpoint
            callers = (each for each, _ in walk_stack(frame) if each.f_code.co_filename.startswith(BUSFLOW))
            where = {"called_by": repr(next(callers).f_locals.get("self"))}
        text = f"{message}, so nothing of it has run: write await before the call"
        (log.bind("busflow") if life is None else life.log).warning(text, **where)

    warnings.showwarning = show
    try:
        yield
    finally:
        warnings.showwarning = before


def _maker(frames: Iterable[FrameType]) -> NodeLifetime | None:
    """Return the lifetime of the node whose plain method is among the frames, else of the task that runs a coroutine.

    The variables of a coroutine are left alone: the frame would keep what was read, as long as the coroutine waits.
    """
    for each in frames:
        if each.f_code.co_flags & (inspect.CO_COROUTINE | inspect.CO_ASYNC_GENERATOR):
            return getattr(asyncio.current_task(), TASK_NODE, None)
        if (life := life_in([each])) is not None:
            return life
    return None


def _user_frames(frame: FrameType | None) -> Iterator[FrameType]:
    """Yield a frame and those around it up to where busflow called, without those of libraries."""
    while frame is not None and not (file := frame.f_code.co_filename).startswith(BUSFLOW):
        if not file.startswith(_LIBRARIES):
            yield frame
        frame = frame.f_back


def life_in(frames: Iterable[FrameType]) -> NodeLifetime | None:
    """Return the lifetime of the first node whose method is among the frames."""
    for frame in frames:
        code = frame.f_code
        node = frame.f_locals.get(code.co_varnames[0]) if code.co_argcount else None
        if isinstance(node, Node):
            return node._runtime.life  # noqa: SLF001  # pyright: ignore[reportPrivateUsage]  # as runtime_of, of what may be half made
    return None
