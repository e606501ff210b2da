"""RunSource: the run that pages look at, and after its end the next one of its name."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING

from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode

from busflow.clock import SystemClock
from busflow.commands import joined
from busflow.errors import BusflowError
from busflow_ui.foxglove.bridge import Bridge, Terms
from busflow_ui.page_server.access import Access
from busflow_ui.questions import frames
from busflow_ui.questions.run_questions import RunQuestions

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection

    from busflow_ui.questions.cited_pages import Chapters

_LOOK_S = 0.25
"""The interval at which the next run is looked for."""


class RunSource:
    """Run of one name, or the first that there is, as long as `keep` is awaited."""

    def __init__(
        self, name: str | None, *, print_message: Callable[[str], None], chapters: Chapters | None = None
    ) -> None:
        """Look at a run.

        Args:
            name: its name; without one, that of the first run that is alone on this machine.
            print_message: prints a line for the person that started this.
            chapters: the book beside which it is shown.
        """
        self._name, self._print, self._chapters = name, print_message, chapters
        self._clock = SystemClock()
        self._bridge: Bridge | None = None
        self._questions: RunQuestions | None = None
        self._present = asyncio.Event()
        self._connections: set[ServerConnection] = set()
        self._ended: dict[str, object] | None = None
        self._missing = ""

    async def keep(self) -> None:
        """Join each run of the name, one after another, until cancelled."""
        while True:
            with ExitStack() as joining:
                try:
                    bridge = await asyncio.to_thread(self._join, joining)
                except BusflowError as error:
                    self._say_what_is_missing(str(error))
                    await self._clock.sleep(_LOOK_S)
                    continue
                await self._serve_run(bridge)

    def _say_what_is_missing(self, reason: str) -> None:
        """Print why no run is shown yet, once: there is none, or there are several to choose from."""
        if self._name is None and reason != self._missing:
            self._missing = reason
            self._print(f"waiting for a run: {reason}")

    def _join(self, joining: ExitStack) -> Bridge:
        peer = joining.enter_context(joined(self._name))
        self._name = peer.run.name
        return Bridge(peer, print_message=self._print)

    async def serve(self, connection: ServerConnection, access: Access) -> None:
        """Serve a page; while there is no run it waits for the next one."""
        while self._bridge is None or self._questions is None:
            with suppress(ConnectionClosed):
                await connection.send(frames.update("run", self._ended or {"name": self._name or "", "ended": {}}))
            if not await self._next_run(connection):
                return
        questions = self._questions
        asks = access is Access.ASK
        terms = Terms(
            read_only=access is not Access.CONTROL,
            only_asks=asks,
            capabilities=("busflow",),
            metadata={"run": self._bridge.peer.run.name, "source": "run", "access": access},
            conversation=questions.asking_session if asks else questions.session,
        )
        self._connections.add(connection)
        try:
            await self._bridge.serve(connection, terms)
        finally:
            self._connections.discard(connection)

    async def _next_run(self, connection: ServerConnection) -> bool:
        """Wait for a run; return False if the page has gone before."""
        waits = [asyncio.create_task(each) for each in (self._present.wait(), connection.wait_closed())]
        try:
            done, _ = await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in waits:
                task.cancel()
        return waits[0] in done

    async def _serve_run(self, bridge: Bridge) -> None:
        questions = RunQuestions(bridge, print_message=self._print, chapters=self._chapters)
        self._bridge, self._questions, self._ended = bridge, questions, None
        self._present.set()
        try:
            await _until_ended(bridge, questions)
            self._ended = questions.ended_run()
            questions.send_all("run", self._ended)
            await bridge.announce_end()
            self._print(f"the run {self._name} has ended; waiting for the next one")
        finally:
            self._bridge = self._questions = None
            self._present.clear()
            for connection in list(self._connections):
                await connection.close(CloseCode.GOING_AWAY, f"the run {self._name} has ended"[:100])
            await asyncio.to_thread(questions.close)
            bridge.close()


async def _until_ended(bridge: Bridge, questions: RunQuestions) -> None:
    """Keep the pages up to date until the run has ended."""
    tasks = [asyncio.create_task(each()) for each in (bridge.ended, questions.keep)]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()  # an error ends all: pages that stand still in silence would be worse
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
