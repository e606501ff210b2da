"""Bridge: serves a run to viewers: offered topics and services, parameters, time, and the end."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable, Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from websockets.frames import CloseCode

import busflow
from busflow.clock import NS_PER_S, SystemClock
from busflow.commands import Selection
from busflow.errors import BusflowError, MalformedMessage
from busflow.text import counted
from busflow_ui import timeouts
from busflow_ui.foxglove import protocol
from busflow_ui.foxglove.catalogue import Catalogue, Change
from busflow_ui.foxglove.connections import Connections
from busflow_ui.foxglove.parameters import RunParameters
from busflow_ui.foxglove.protocol import Level
from busflow_ui.foxglove.publications import ENCODINGS
from busflow_ui.foxglove.viewer import Viewer
from busflow_ui.foxglove.websocket_server import name_of

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection

    from busflow.commands import GraphView, Peer

_LOOK_S = 1.0
"""The interval at which the graph is read, while a viewer is connected."""
_LIFE_S = 0.2
"""Interval at which the bridge checks that the run still lives."""
_MOST_VIEWERS = 32
_MOST_CALLS = 16
_PARAMETERS_S = 0.2
_STATE = "run"
"""Id of the status message about the run's state."""


class Conversation(Protocol):
    """Conversation with one viewer beyond the protocol."""

    def take(self, message: str | bytes, /) -> bool:
        """Answer a message of the viewer; return False where it is one of the protocol's."""
        ...

    def close(self) -> None:
        """End the conversation: the viewer has gone."""
        ...


class _NoConversation:
    """Conversation of a viewer that speaks the protocol alone."""

    def __init__(self, _viewer: Viewer) -> None:
        pass

    def take(self, _message: str | bytes, /) -> bool:
        """Return False: every message is the protocol's."""
        return False

    def close(self) -> None:
        """Do nothing."""


@dataclass(frozen=True, slots=True)
class Terms:
    """Rights of one viewer, and what it is offered beyond the protocol."""

    read_only: bool
    only_asks: bool = False
    """Whether nothing of the protocol is offered, and the conversation is all there is."""
    capabilities: tuple[str, ...] = ()
    """Names of what the conversation offers."""
    metadata: Mapping[str, str] = field(default_factory=dict[str, str])
    conversation: Callable[[Viewer], Conversation] = _NoConversation


class Bridge:
    """Serves one run, until `ended` returns."""

    def __init__(self, peer: Peer, topics: Sequence[str] = (), *, print_message: Callable[[str], None]) -> None:
        """Build a bridge to a run.

        Args:
            peer: a member of the run.
            topics: patterns of those that are served; all where there is none.
            print_message: prints a line for the person that started this.

        Raises:
            InvalidName: A pattern is none.
            NoSuchTarget: A pattern matches no topic of the run.
        """
        self.peer = peer
        self.catalogue = Catalogue(peer, Selection(topics), print_message)
        self.parameters = RunParameters(peer)
        self.packages: Mapping[str, Path] = {name: Path(folder) for name, folder in peer.run.card.packages.items()}
        """The folders out of which viewers get files."""
        seen = self.catalogue.look()
        self.catalogue.require_matches(seen.graph)
        self.catalogue.update(seen)
        self.graph: GraphView = seen.graph
        self.connections = Connections.of(seen.graph)
        self.viewers: set[Viewer] = set()
        self._print = print_message
        self._clock = SystemClock()
        self.looked_s: float = self._clock.seconds()
        """The time at which the graph was read, on a clock that does not jump."""
        self._places = asyncio.Semaphore(_MOST_VIEWERS)
        self._lock = peer.run.lock()
        self.was_killed = False
        """Whether the run has ended without an end of its own."""
        self._session = f"{peer.run.card.since_ns}-{os.getpid()}"
        self._is_silent = self._has_clock = False
        self._looked: asyncio.Future[None] | None = None
        self._clock_listening = ExitStack()
        self._asking = ThreadPoolExecutor(1, "busflow-foxglove-ask")
        self._calling = ThreadPoolExecutor(_MOST_CALLS, "busflow-foxglove-call")

    async def ended(self) -> None:
        """Update the offered topics and services until the run has ended."""
        keeping = [asyncio.create_task(each()) for each in (self._keep_catalogue, self._keep_parameters)]
        try:
            while self._lives():
                done, _ = await asyncio.wait(keeping, timeout=_LIFE_S, return_when=asyncio.FIRST_COMPLETED)
                for task in done:
                    task.result()
        finally:
            for task in keeping:
                task.cancel()
            await asyncio.gather(*keeping, return_exceptions=True)

    def _lives(self) -> bool:
        if self._lock.is_held:
            return True
        self.was_killed = self._lock.is_abandoned
        return not self.was_killed and self.peer.alive

    def close(self) -> None:
        """Ask the run nothing more; the viewers' connections are closed by then."""
        self._lock.close()
        self._clock_listening.close()
        for pool in (self._asking, self._calling):
            pool.shutdown(wait=False, cancel_futures=True)

    # What viewers need.

    async def ask(self, question: Callable[..., Any], *arguments: Any) -> Any:
        """Ask the run in a thread; questions are asked one after another."""
        return await asyncio.get_running_loop().run_in_executor(self._asking, question, *arguments)

    async def call(self, question: Callable[..., Any], *arguments: Any) -> Any:
        """Call a service in a thread, in parallel with other questions."""
        return await asyncio.get_running_loop().run_in_executor(self._calling, question, *arguments)

    async def send_parameters(self) -> None:
        """Send all viewers the parameters changed since the last time."""
        if not any(viewer.follows_parameters for viewer in self.viewers):
            await self.ask(self.parameters.forget)
            return
        rows = await self.ask(self.parameters.changes)
        for viewer in self.viewers:
            viewer.send_parameters(rows)

    # Keeping up with the run.

    async def _keep_catalogue(self) -> None:
        while True:
            await self._clock.sleep(_LOOK_S)
            if self.viewers:
                await self._unless_silent(self._look)

    async def _keep_parameters(self) -> None:
        while True:
            await self._clock.sleep(_PARAMETERS_S)
            if any(viewer.follows_parameters for viewer in self.viewers):
                await self._unless_silent(self.send_parameters)

    async def _unless_silent(self, ask: Callable[[], Awaitable[None]]) -> None:
        """Ask the run; viewers are notified when it does not answer, and when it does again."""
        try:
            await ask()
        except BusflowError as error:
            if not self._is_silent:
                self._send_status(Level.WARNING, str(error))
            self._is_silent = True
        else:
            if self._is_silent:
                self._send_all(protocol.text("removeStatus", statusIds=[_STATE]))
            self._is_silent = False

    async def _look(self) -> None:
        seen = await self.ask(self.catalogue.look)
        self.looked_s = self._clock.seconds()
        change = self.catalogue.update(seen)
        connections = Connections.of(seen.graph)
        changes = connections.since(self.connections)
        self.graph, self.connections = seen.graph, connections
        for viewer in self.viewers:
            viewer.offer(change)
            viewer.send_misfits()
            viewer.report_dropped()
            if viewer.follows_graph and any(changes.values()):
                viewer.send(protocol.text("connectionGraphUpdate", **changes))
        self._follow_clock()
        if self._looked is not None:
            self._looked.set_result(None)
            self._looked = None

    async def next_look(self) -> None:
        """Wait until the graph has been read once more; for one caller at a time."""
        self._looked = self._looked or asyncio.get_running_loop().create_future()
        await asyncio.shield(self._looked)

    def _follow_clock(self) -> None:
        """Subscribe to the nodes' time once a node publishes it."""
        channel = self.catalogue.clock()
        if channel is None or self._has_clock:
            return
        self._has_clock = True
        loop = asyncio.get_running_loop()
        feed = self.peer.listen(channel.topic, channel.type, depth=1, on_arrival=lambda: _call(loop, self._send_time))
        self._clock_listener = self._clock_listening.enter_context(feed)
        self._decode_clock = channel.type.decode

    def _send_time(self) -> None:
        while (received := self._clock_listener.get(0)) is not None:
            with suppress(MalformedMessage):  # the run names its publisher
                clock = self._decode_clock(received.payload)["clock"]
                for viewer in self.viewers:
                    viewer.send_time(clock["sec"] * NS_PER_S + clock["nanosec"])

    # Viewers.

    async def serve(self, connection: ServerConnection, terms: Terms) -> None:
        """Serve a viewer until either side ends the connection."""
        if self._places.locked():
            await connection.close(CloseCode.TRY_AGAIN_LATER, f"{_MOST_VIEWERS} viewers are connected")
            return
        async with self._places:  # also while the run is asked what there is: many may come at once
            await self._serve_viewer(connection, terms)

    async def _serve_viewer(self, connection: ServerConnection, terms: Terms) -> None:
        await self._unless_silent(self._look)
        viewer = Viewer(connection, self, read_only=terms.read_only, only_asks=terms.only_asks)
        viewer.send(self._server_info(terms))
        services = () if terms.read_only else tuple(self.catalogue.services.values())
        viewer.offer(Change(channels=tuple(self.catalogue.channels.values()), services=services))
        self.viewers.add(viewer)
        name = name_of(connection)
        self._print(f"{name} has come")
        conversation = terms.conversation(viewer)
        try:
            await viewer.serve(conversation.take)
        except Exception as error:
            self._print(f"error: {name} was let go; this is a bug in busflow, please report it: {error!r}")
            raise
        finally:
            conversation.close()
            self.viewers.discard(viewer)
            missed = f"; it missed {counted(viewer.dropped, 'message')}, read too slowly" if viewer.dropped else ""
            self._print(f"{name} has gone{missed}")

    def _server_info(self, terms: Terms) -> str:
        capabilities = [] if terms.only_asks else ["parameters", "parametersSubscribe", "connectionGraph"]
        capabilities += [] if terms.read_only else ["clientPublish", "services"]
        capabilities += ["time"] if self._has_clock else []
        capabilities += ["assets"] if self.packages and not terms.only_asks else []
        capabilities += terms.capabilities
        card = self.peer.run.card
        return protocol.text(
            "serverInfo",
            name=f"busflow: {card.name}",
            capabilities=capabilities,
            supportedEncodings=ENCODINGS,
            metadata={"busflow": busflow.__version__, **terms.metadata},
            sessionId=self._session,
        )

    async def announce_end(self) -> None:
        """Notify all viewers that the run has ended."""
        self._send_status(Level.ERROR, f"the run {self.peer.run.name} has ended")
        await self._clock.sleep(timeouts.current.last_words)

    def _send_status(self, level: Level, sentence: str) -> None:
        self._send_all(protocol.status(level, sentence, id_=_STATE))

    def _send_all(self, message: str) -> None:
        for viewer in self.viewers:
            viewer.send(message)


def _call(loop: asyncio.AbstractEventLoop, function: Callable[[], None]) -> None:
    """Call a function on the event loop from Zenoh's thread; does nothing if the loop has ended."""
    with suppress(RuntimeError):
        loop.call_soon_threadsafe(function)
