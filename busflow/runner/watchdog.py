"""Watchdog: names the handler that blocks the event loop, while it does.

Theory of operation. A thread wakes up twice per bound and looks where the loop's thread is. Mostly that is in `select`,
and then nothing is blocked. Where it is not, the loop is asked to set a flag, which it does in its next turn. No turn
within the bound is a block: the thread's stack then shows the handler. The loop itself only pays for setting the flag.
"""

from __future__ import annotations

import asyncio
import os
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

from busflow.bus.services.server import Server
from busflow.bus.subscription import Subscription
from busflow.bus.timer import Timer
from busflow.clock import perf_counter
from busflow.node.callbacks import EventHandler
from busflow.node.lifetime import NodeLifetime
from busflow.runner.loops import system as event_loop
from busflow.runner.report import Blocks
from busflow.runner.running_lines import running_lines
from busflow.runner.supervisor import Supervisor
from busflow.text import printable
from busflow.validation.tracebacks import shown

if TYPE_CHECKING:
    from busflow.log import Log

BOUND_S = 0.1
"""Default time that the loop may be blocked before the log warns."""

_JUST_NOW_S = 1.0
_BUSFLOW = str(Path(__file__).parents[1]) + os.sep
_STEPS = 6
"""Stack lines in a warning, from the running line outwards."""
_IDLE = {kind.select.__code__ for kind in event_loop.SELECTORS}
"""Code objects in which an idle loop waits."""


class Watchdog:
    """Watches one event loop, from `begin` to `close`."""

    def __init__(self, bound_s: float, log: Log) -> None:
        self.bound_s = bound_s
        self._log = log
        self._found: dict[tuple[str, str], Blocks] = {}
        self._last_s: dict[str, float] = {}
        self._ended = threading.Event()

    def statistics(self) -> tuple[Blocks, ...]:
        """Return the handlers that blocked the loop, in the order in which they first did."""
        return tuple(self._found.values())

    @property
    def blocking(self) -> set[str]:
        """Nodes that block the loop now, or did just now."""
        since_s = perf_counter() - _JUST_NOW_S
        return {node for node, last_s in tuple(self._last_s.items()) if last_s > since_s}

    def begin(self) -> None:
        """Watch the running loop, which is that of this thread."""
        loop, thread = asyncio.get_running_loop(), threading.get_ident()
        threading.Thread(target=self._watch, args=(loop, thread), name="busflow.watchdog", daemon=True).start()

    def close(self) -> None:
        """Stop watching."""
        self._ended.set()

    def _watch(self, loop: asyncio.AbstractEventLoop, thread: int) -> None:
        while not self._ended.wait(self.bound_s / 2):
            if _is_idle(thread):
                continue
            turned, begun_s = threading.Event(), perf_counter()
            try:
                loop.call_soon_threadsafe(turned.set)
            except RuntimeError:  # the loop is closed: the run ends
                return
            if turned.wait(self.bound_s) or self._ended.is_set():
                continue
            found = self._report(thread)
            while not turned.wait(self.bound_s) and not self._ended.is_set():
                self._last_s[found.node] = perf_counter()
            self._last_s[found.node] = perf_counter()
            found.longest_s = max(found.longest_s, perf_counter() - begun_s)

    def _report(self, thread: int) -> Blocks:
        frame = sys._current_frames().get(thread)  # noqa: SLF001  # there is no other way to see it
        node, handler = next(owners(frame), ("busflow", "the program around the graph"))
        found = self._found.setdefault((node, handler), Blocks(node, handler))
        found.count += 1
        self._last_s[node] = perf_counter()
        bound = f"{self.bound_s * 1000:g} ms"
        text = "blocks the event loop: nothing else runs meanwhile"
        fix = "wait with `await self.clock.sleep(…)`, compute with `await self.run_sync(…)`"
        self._log.bind(node).warning(text, longer_than=bound, handler=handler, stack=stack_of(frame), fix=fix)
        return found


def _is_idle(thread: int) -> bool:
    frame = sys._current_frames().get(thread)  # noqa: SLF001  # there is no other way to see it
    return frame is None or frame.f_code in _IDLE


def owners(frame: FrameType | None) -> Iterator[tuple[str, str]]:
    """Yield node and handler of the running code, innermost first: a timer may call a handler."""
    while frame is not None:
        if frame.f_code.co_filename.startswith(_BUSFLOW):
            local = frame.f_locals
            owner: Any = local.get("self")
            if isinstance(owner, Subscription | Server):
                yield owner.endpoint.node, owner.endpoint.origin
            elif isinstance(owner, Timer):
                yield owner.node, f"timer {owner.name}"
            elif isinstance(owner, EventHandler):
                yield owner.node, owner.origin
            elif isinstance(owner, Supervisor) and "name" in local:
                yield owner.name, f"{type(owner.node).__name__}.{local['name']}"
            elif isinstance(owner, NodeLifetime) and "name" in local:
                yield owner.name, f"task {local['name']}"
        frame = frame.f_back


def stack_of(frame: FrameType | None) -> str:
    """Return the running lines, innermost first, up to the call from busflow."""
    lines = running_lines(frame)[:_STEPS]
    return " < ".join(f"{printable(shown(each.filename))}:{each.lineno} in {printable(each.name)}" for each in lines)
