"""Barrier: delays the start of a process's nodes until messages pass between it and all other processes.

Each process declares a token `@busflow/1/<process>/shown/<session>/<count>`. It states how many tokens the nodes of the
process have, because tokens may arrive in any order. A process that has handled all of these declares a token
`@busflow/1/<process>/linked/<that session>/<own session>`: it has opened its inlets, and Zenoh keeps the order of
declarations. So once all others have declared such a token for a process, they receive all that it publishes from then
on. No process leads, and a process that comes later does the same.
"""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import zenoh

from busflow.wire.zenoh.keys import QUERY_PREFIX

if TYPE_CHECKING:
    from busflow.wire.mirror.mirror import Mirror

_SHOWN, _LINKED = "shown", "linked"


class Barrier:
    """Tokens by which a process and the others confirm that they see each other's nodes, from its start to its end."""

    def __init__(
        self,
        mirror: Mirror,
        session: zenoh.Session,
        process: str,
        *,
        on_change: Callable[[str, bool], None] | None = None,
    ) -> None:
        """Create a barrier; it declares nothing before `begin`.

        Args:
            mirror: the mirror that shows the process's nodes.
            session: the Zenoh session in which the tokens are declared.
            process: the name of this process in the run.
            on_change: called with a name and True when a process has come, and False when it is gone or hangs; also
                for another process with this name.
        """
        self._mirror, self._session, self._process = mirror, session, process
        self._zid = str(session.info.zid())
        self._on_change = on_change
        self._others: dict[str, tuple[str, int]] = {}
        self._linked_to_us: set[tuple[str, str]] = set()
        self._gone: set[str] = set()
        self._links: dict[str, zenoh.LivelinessToken] = {}
        self._shown: tuple[int, zenoh.LivelinessToken] | None = None
        self._changed = asyncio.Event()
        self._subscribers: list[Any] = []
        self._update_due = False

    def begin(self) -> None:
        """Declare this process's tokens and follow the others'; called on the event loop when all endpoints exist."""
        loop = asyncio.get_running_loop()
        self._loop = loop

        def on_sample(sample: zenoh.Sample) -> None:
            alive = sample.kind == zenoh.SampleKind.PUT
            with suppress(RuntimeError):  # the loop has ended: nothing is left to notify
                loop.call_soon_threadsafe(self._on_token, str(sample.key_expr), alive)

        self._mirror.presence.on_change.append(self._update_soon)
        callback: Any = zenoh.handlers.Callback(on_sample, indirect=False)
        for word in (f"{_SHOWN}/**", f"{_LINKED}/{self._zid}/*"):
            key = f"{QUERY_PREFIX}/*/{word}"
            self._subscribers.append(self._session.liveliness().declare_subscriber(key, callback, history=True))
        self._update()

    def lacking(self, others: Collection[str]) -> list[str]:
        """Return what still prevents the nodes' start, as texts for people; empty once nothing does.

        The barrier does not wait for a process that was there and has gone.
        """
        found: list[str] = []
        for process in set(others) - self._gone:
            if process not in self._others:
                found.append(f"{process} has not joined the run")
            elif process not in self._links:
                found.append(f"{self._process} does not see all nodes of {process}")
            elif (process, self._others[process][0]) not in self._linked_to_us:
                found.append(f"{process} does not see all nodes of {self._process}")
        sessions = {self._others[process][0] for process in others if process in self._others}
        return found or [f"not all processes receive {topic} from here" for topic in self._mirror.unconnected(sessions)]

    async def passed(self, others: Collection[str], *, unless: asyncio.Event) -> None:
        """Wait until these processes and this one are linked, or until `unless` is set."""

        async def wake() -> None:
            await unless.wait()
            self._changed.set()

        waker = self._loop.create_task(wake(), name="busflow.barrier")
        try:
            while not unless.is_set() and self.lacking(others):
                self._changed.clear()
                await self._changed.wait()
        finally:
            waker.cancel()

    def _on_token(self, text: str, alive: bool) -> None:
        process, word, *rest = text.removeprefix(f"{QUERY_PREFIX}/").split("/")
        if process == self._process:
            if word == _SHOWN and rest[0] != self._zid:
                self._notify(process, alive)
            return
        if word == _LINKED:
            (self._linked_to_us.add if alive else self._linked_to_us.discard)((process, rest[1]))
        else:
            self._on_shown(process, rest[0], int(rest[1]), alive=alive)
        self._update()

    def _on_shown(self, process: str, session: str, count: int, *, alive: bool) -> None:
        known = self._others.get(process)
        if alive:
            self._others[process] = session, count
            self._gone.discard(process)
            if known is None or known[0] != session:
                self._unlink(process)
                self._notify(process, True)
        elif known == (session, count):  # else a newer token has replaced it
            del self._others[process]
            self._gone.add(process)
            self._unlink(process)
            self._notify(process, False)

    def _notify(self, process: str, there: bool) -> None:
        if self._on_change is not None:
            self._on_change(process, there)

    def _unlink(self, process: str) -> None:
        link = self._links.pop(process, None)
        if link is not None:
            link.undeclare()

    def _update_soon(self) -> None:
        if not self._update_due:
            self._update_due = True
            self._loop.call_soon(self._update)

    def _update(self) -> None:
        """Bring this process's tokens up to date, and wake the waiting tasks."""
        self._update_due = False
        if self._session.is_closed():
            return
        liveliness = self._session.liveliness()
        count = self._mirror.shown
        if self._shown is None or self._shown[0] != count:
            key = f"{QUERY_PREFIX}/{self._process}/{_SHOWN}/{self._zid}/{count}"
            former, self._shown = self._shown, (count, liveliness.declare_token(key))
            if former is not None:
                former[1].undeclare()
        for process, (session, expected) in self._others.items():
            if process not in self._links and self._mirror.presence.count(session) >= expected:
                self._links[process] = liveliness.declare_token(
                    f"{QUERY_PREFIX}/{self._process}/{_LINKED}/{session}/{self._zid}"
                )
        self._changed.set()
