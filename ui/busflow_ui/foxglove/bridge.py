"""Bridge: serves a run to viewers: admission, offered topics and services, and the end."""

from __future__ import annotations

import asyncio
import errno
import logging
import os
from collections.abc import Awaitable, Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from http import HTTPStatus
from typing import TYPE_CHECKING, Any

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import MultipleValuesError
from websockets.frames import CloseCode
from websockets.typing import Subprotocol

import busflow
from busflow.cli.commands import Selection
from busflow.clock import NS_PER_S, SystemClock
from busflow.errors import BusflowError, InvalidInput, MalformedMessage, Problem
from busflow.text import counted, printable
from busflow_ui.foxglove import protocol
from busflow_ui.foxglove.catalogue import Catalogue, Change
from busflow_ui.foxglove.connections import Connections
from busflow_ui.foxglove.parameters import RunParameters
from busflow_ui.foxglove.protocol import SUBPROTOCOLS, Level
from busflow_ui.foxglove.publications import ENCODINGS
from busflow_ui.foxglove.viewer import Viewer

if TYPE_CHECKING:
    from websockets.http11 import Request, Response

    from busflow.cli.commands import GraphView, Peer
    from busflow_ui.foxglove.admission import Admission
    from busflow_ui.foxglove.catalogue import OfferedService

_LOOK_S = 1.0
"""The interval at which the graph is read, while a viewer is connected."""
_LIFE_S = 0.2
"""Interval at which the bridge checks that the run still lives."""
_FAREWELL_S = 0.3
"""Time that a viewer may take to close its connection."""
_MOST_VIEWERS = 32
_MOST_CALLS = 16
_MOST_FRAME = 16 * 1024 * 1024
"""Largest message that a viewer may send."""
_MOST_REFUSED = 20
"""Most different refusals that are printed; a page could try with ever new ones."""
_PARAMETERS_S = 0.2
_STATE = "run"
"""Id of the status message about the run's state."""

_LOG = logging.getLogger(__name__)
"""Log of websockets about failed handshakes; shown only where a program has asked for such lines."""
_LOG.addHandler(logging.NullHandler())
_LOG.propagate = False


class Bridge:
    """Serves one run, from `open` until `ended` returns."""

    def __init__(
        self, peer: Peer, topics: Sequence[str] = (), *, read_only: bool, print_message: Callable[[str], None]
    ) -> None:
        """Build a bridge to a run.

        Args:
            peer: a member of the run.
            topics: patterns of those that are served; all where there is none.
            read_only: whether viewers may only look.
            print_message: prints a line for the person that started this.

        Raises:
            InvalidName: A pattern is none.
            NoSuchTarget: A pattern matches no topic of the run.
        """
        self.peer, self.read_only = peer, read_only
        self.catalogue = Catalogue(peer, Selection(topics), print_message)
        self.parameters = RunParameters(peer)
        seen = self.catalogue.look()
        self.catalogue.require_matches(seen.graph)
        self.catalogue.update(seen)
        self.graph: GraphView = seen.graph
        self.connections = Connections.of(seen.graph)
        self.viewers: set[Viewer] = set()
        self._print = print_message
        self._clock = SystemClock()
        self._seats = asyncio.Semaphore(_MOST_VIEWERS)
        self._session = f"{peer.run.card.since_ns}-{os.getpid()}"
        self._is_silent = self._has_clock = False
        self._clock_listening = ExitStack()
        self._asking = ThreadPoolExecutor(1, "busflow-foxglove-ask")
        self._calling = ThreadPoolExecutor(_MOST_CALLS, "busflow-foxglove-call")
        self._server: Server | None = None
        self._refused: set[str] = set()

    async def open(self, host: str, port: int, admission: Admission) -> int:
        """Accept viewers; return the port, a free one where 0 was asked for.

        Raises:
            InvalidInput: It cannot be had.
        """
        try:
            self._server = await serve(
                self._serve,
                host,
                port,
                subprotocols=[Subprotocol(each) for each in SUBPROTOCOLS],
                process_request=lambda connection, request: self._admit(admission, connection, request),
                server_header=None,
                compression=None,  # on one machine it only costs time
                close_timeout=_FAREWELL_S,
                max_size=_MOST_FRAME,
                logger=_LOG,
            )
        except OSError as error:
            why = os.strerror(error.errno) if error.errno and error.errno > 0 else error.strerror or str(error)
            message = f"{host}:{port} cannot be listened at: {why}"
            fix = "say another one with --port, or 0 for a free one"
            if error.errno not in {errno.EADDRINUSE, errno.EACCES}:
                fix = "say an address of this machine with --host: 127.0.0.1, or 0.0.0.0 for all that it has"
            raise InvalidInput(Problem("address", message, fix)) from None
        return self._server.sockets[0].getsockname()[1]

    async def ended(self) -> None:
        """Update the offered topics and services until the run has ended; then notify all viewers."""
        keeping = [asyncio.create_task(each()) for each in (self._keep_catalogue, self._keep_parameters)]
        try:
            while self.peer.alive:
                done, _ = await asyncio.wait(keeping, timeout=_LIFE_S, return_when=asyncio.FIRST_COMPLETED)
                for task in done:
                    task.result()
            await self._say_farewell()
        finally:
            for task in keeping:
                task.cancel()
            await asyncio.gather(*keeping, return_exceptions=True)

    async def close(self) -> None:
        """Close all connections, without waiting for slow viewers."""
        if self._server is not None:
            self._server.close()
            with suppress(TimeoutError):
                async with asyncio.timeout(_FAREWELL_S):
                    await self._server.wait_closed()
        self._clock_listening.close()
        for pool in (self._asking, self._calling):
            pool.shutdown(wait=False, cancel_futures=True)

    # What viewers need.

    async def ask(self, question: Callable[..., Any], *arguments: Any) -> Any:
        """Ask the run in a thread; questions are asked one after another."""
        return await asyncio.get_running_loop().run_in_executor(self._asking, question, *arguments)

    async def call(self, question: Callable[..., Any]) -> Any:
        """Call a service in a thread, in parallel with other questions."""
        return await asyncio.get_running_loop().run_in_executor(self._calling, question)

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
            with suppress(MalformedMessage):  # whoever publishes it is told of by the run
                clock = self._decode_clock(received.payload)["clock"]
                for viewer in self.viewers:
                    viewer.send_time(clock["sec"] * NS_PER_S + clock["nanosec"])

    # Viewers.

    def _admit(self, admission: Admission, connection: ServerConnection, request: Request) -> Response | None:
        try:
            host, origin = request.headers.get("Host"), request.headers.get("Origin")
        except MultipleValuesError:
            refusal = "a handshake has one Host and one Origin"
        else:
            refusal = admission.refusal(host, origin)
        if refusal is None:
            return None
        if refusal not in self._refused and len(self._refused) < _MOST_REFUSED:
            self._refused.add(refusal)
            self._print(f"warning: refused a connection: {refusal}")
        return connection.respond(HTTPStatus.FORBIDDEN, f"{printable(refusal)}\n")

    async def _serve(self, connection: ServerConnection) -> None:
        if self._seats.locked():
            await connection.close(CloseCode.TRY_AGAIN_LATER, f"{_MOST_VIEWERS} viewers are connected")
            return
        async with self._seats:  # also while the run is asked what there is: many may come at once
            await self._serve_viewer(connection)

    async def _serve_viewer(self, connection: ServerConnection) -> None:
        await self._unless_silent(self._look)
        viewer = Viewer(connection, self)
        viewer.send(self._server_info())
        viewer.offer(Change(channels=tuple(self.catalogue.channels.values()), services=self._offered_services()))
        self.viewers.add(viewer)
        name = _name_of(connection)
        self._print(f"{name} has come")
        try:
            await viewer.serve()
        except Exception as error:
            self._print(f"error: {name} was let go; this is a bug in busflow, please report it: {error!r}")
            raise
        finally:
            self.viewers.discard(viewer)
            missed = f"; it missed {counted(viewer.dropped, 'message')}, read too slowly" if viewer.dropped else ""
            self._print(f"{name} has gone{missed}")

    def _offered_services(self) -> tuple[OfferedService, ...]:
        return () if self.read_only else tuple(self.catalogue.services.values())

    def _server_info(self) -> str:
        capabilities = ["parameters", "parametersSubscribe", "connectionGraph"]
        capabilities += [] if self.read_only else ["clientPublish", "services"]
        capabilities += ["time"] if self._has_clock else []
        card = self.peer.run.card
        return protocol.text(
            "serverInfo",
            name=f"busflow: {card.name}",
            capabilities=capabilities,
            supportedEncodings=ENCODINGS,
            metadata={"busflow": busflow.__version__},
            sessionId=self._session,
        )

    async def _say_farewell(self) -> None:
        self._send_status(Level.ERROR, f"the run {self.peer.run.name} has ended")
        await self._clock.sleep(_FAREWELL_S / 3)  # for what is on its way

    def _send_status(self, level: Level, sentence: str) -> None:
        self._send_all(protocol.status(level, sentence, id_=_STATE))

    def _send_all(self, message: str) -> None:
        for viewer in self.viewers:
            viewer.send(message)


def _call(loop: asyncio.AbstractEventLoop, function: Callable[[], None]) -> None:
    """Call a function on the event loop from Zenoh's thread; does nothing if the loop has ended."""
    with suppress(RuntimeError):
        loop.call_soon_threadsafe(function)


def _name_of(connection: ServerConnection) -> str:
    """Return a viewer's name for messages: its address, and its page if it is one."""
    host, port, *_ = connection.remote_address
    request = connection.request
    origin = request.headers.get("Origin") if request is not None else None
    return f"viewer {host}:{port}" + (f" ({origin})" if origin else "")
