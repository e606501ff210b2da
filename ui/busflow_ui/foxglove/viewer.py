"""Viewer: one connected client, with its requests and the messages that wait to be sent.

Each topic that it receives has a bounded queue of its own, so that a camera never pushes a small topic aside. Its
connection is written to as fast as it reads, and what is too old by then is dropped; the client gets the count. What
has to be asked of the run is asked in another thread; nothing here waits for the run or for another viewer.
"""

from __future__ import annotations

import asyncio
from collections import deque
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

from websockets.exceptions import ConnectionClosed
from websockets.protocol import State

from busflow.clock import SystemClock
from busflow.errors import BusflowError, InspectionUnavailable, MalformedMessage, NoSuchTarget, ServiceUnavailable
from busflow.text import counted, printable
from busflow_ui import timeouts
from busflow_ui.foxglove import protocol
from busflow_ui.foxglove.assets import AssetSender
from busflow_ui.foxglove.connections import Connections
from busflow_ui.foxglove.kept_log import ROSOUT, kept_log
from busflow_ui.foxglove.protocol import Level
from busflow_ui.foxglove.publications import Publications

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence
    from pathlib import Path

    from websockets.asyncio.server import ServerConnection

    from busflow.commands import GraphView, Listener, Peer
    from busflow_ui.foxglove.catalogue import Catalogue, Change, OfferedTopic
    from busflow_ui.foxglove.parameters import RunParameters

_DEPTH = 1000
_MOST_BYTES = 16 * 1024 * 1024
"""Most waiting bytes of one topic: some frames of a camera, or a second of small, fast messages."""
_SMALL = 4096
"""Size up to which messages of several topics are sent with one write."""
_MOST_ANSWERS = 4096
_MOST_ANSWER_BYTES = 64 * 1024 * 1024
"""Most other waiting bytes: a viewer that requests more without reading is disconnected."""
_MOST_CALLS = 16
_GATHER_S = 0.016
"""Longest that a message waits for others, to be sent with them: waking up and writing cost more than all else.

It is one picture of a screen, before whose next one no browser shows anything."""
_REPORT_EVERY_NS = 1_000_000_000
"""Interval at which a viewer is informed that it reads too slowly."""


class ViewedRun(Protocol):
    """Interface that a viewer needs of its bridge."""

    peer: Peer
    catalogue: Catalogue
    graph: GraphView
    connections: Connections
    parameters: RunParameters
    packages: Mapping[str, Path]

    async def ask(self, question: Callable[..., Any], *arguments: Any) -> Any:
        """Ask the run a question, one after another."""

    async def call(self, question: Callable[..., Any]) -> Any:
        """Call a service, in parallel with other questions."""

    async def send_parameters(self) -> None:
        """Send all viewers the changed parameters now rather than at the next look."""


@dataclass(frozen=True, slots=True)
class _Subscription:
    id: int
    channel: OfferedTopic
    listener: Listener
    ending: ExitStack
    kept: Collection[bytes]
    """Messages that were sent before the listener's own, which may have them too."""


class Viewer:
    """Connection of one client, from its handshake to its end."""

    def __init__(
        self, connection: ServerConnection, run: ViewedRun, *, read_only: bool, only_asks: bool = False
    ) -> None:
        self.read_only, self._only_asks = read_only, only_asks
        self.follows_graph = False
        self._parameters: set[str] = set()
        self._all_parameters = False
        self._connection, self._run = connection, run
        self._subscriptions: dict[int, _Subscription] = {}
        self._publications = Publications(run.peer)
        self._assets = AssetSender(connection, run)
        self._answers: deque[str | bytes] = deque()
        self._answer_bytes = 0
        self._calls: set[asyncio.Task[None]] = set()
        self._wake = asyncio.Event()
        self._is_woken = False
        """Whether a message has woken it that it has not looked for yet."""
        self._now_ns: int | None = None
        self._dropped_before = self._reported_dropped = self._reported_ns = 0
        self._clock = SystemClock()
        self._loop = asyncio.get_running_loop()

    async def serve(self, is_taken: Callable[[str | bytes], bool] = lambda _message: False) -> None:
        """Send and receive until either side ends the connection.

        Args:
            is_taken: takes a message that the protocol does not know; False where it is none of those.

        Raises:
            ExceptionGroup: Sending, receiving or a call has failed by a bug in busflow; the others then end too.
        """
        try:
            async with asyncio.TaskGroup() as self._tasks:
                sending = self._tasks.create_task(self._send())
                with suppress(ConnectionClosed):
                    async for message in self._connection:
                        await self._on_message(message, is_taken)
                for task in (sending, *self._calls):
                    task.cancel()
                self._assets.end()
        finally:
            for each in list(self._subscriptions.values()):
                self._end(each)
            self._publications.close()

    @property
    def dropped(self) -> int:
        """Number of messages that the client did not get, because it reads too slowly or they came too fast."""
        listeners = [each.listener for each in self._subscriptions.values()]
        return self._dropped_before + sum(each.dropped + each.lost for each in listeners)

    # What is sent.

    def send(self, message: str | bytes) -> None:
        """Queue a message that must not be lost."""
        self._answers.append(message)
        self._answer_bytes += len(message)
        if len(self._answers) > _MOST_ANSWERS or self._answer_bytes > _MOST_ANSWER_BYTES:
            self._connection.transport.abort()  # a status would have to wait behind all that
        self._wake.set()

    def send_status(self, level: Level, sentence: str, *, id_: str | None = None) -> None:
        """Show a sentence to the viewer's user."""
        self.send(protocol.status(level, printable(sentence), id_=id_))

    def send_time(self, now_ns: int) -> None:
        """Send the nodes' time; of unread times only the last is sent."""
        self._now_ns = now_ns
        self._wake.set()

    @property
    def follows_parameters(self) -> bool:
        """Whether the client follows parameters."""
        return self._all_parameters or bool(self._parameters)

    def send_parameters(self, rows: Sequence[dict[str, Any]]) -> None:
        """Send those of these parameters that the client follows."""
        followed = [row for row in rows if self._all_parameters or row["name"] in self._parameters]
        if followed:
            self.send(protocol.text("parameterValues", parameters=followed))

    def offer(self, change: Change) -> None:
        """Announce new channels and services, and the end of others."""
        if self._only_asks:
            return
        for each in [each for each in self._subscriptions.values() if each.channel.id in change.gone_channels]:
            self._end(each)
        if change.gone_channels:
            self.send(protocol.text("unadvertise", channelIds=change.gone_channels))
        if change.gone_services:
            self.send(protocol.text("unadvertiseServices", serviceIds=change.gone_services))
        if change.channels:
            self.send(protocol.text("advertise", channels=[each.announcement() for each in change.channels]))
        if change.services:
            self.send(protocol.text("advertiseServices", services=[each.announcement() for each in change.services]))

    def send_misfits(self) -> None:
        """Name the subscriptions that do not receive what this viewer publishes."""
        for sentence in self._publications.new_misfits(self._run.graph):
            self.send_status(Level.WARNING, sentence)

    async def _send(self) -> None:
        with suppress(ConnectionClosed):
            while True:
                await self._wake.wait()
                self._wake.clear()
                if not self._answers:
                    await self._clock.sleep(_GATHER_S)
                self._is_woken = False
                await self._send_answers()
                more = True
                while more:
                    more = await self._send_messages()
                    await asyncio.sleep(0)  # a client that reads at once holds up no other

    async def _send_answers(self) -> None:
        while self._answers:
            message = self._answers.popleft()
            self._answer_bytes -= len(message)
            await self._connection.send(message)
        if self._now_ns is not None:
            now_ns, self._now_ns = self._now_ns, None
            await self._connection.send(protocol.time(now_ns))

    async def _send_messages(self) -> bool:
        """Send the oldest message of each topic; return whether there was any."""
        found = False
        small: list[bytes] = []
        for each in list(self._subscriptions.values()):
            received = each.listener.get(0)
            if received is None or each.id not in self._subscriptions:
                continue
            found = True
            if received.payload in each.kept:
                continue
            frame = protocol.message_data(each.id, max(0, received.stamp_ns), received.payload)
            if len(frame) <= _SMALL:
                small.append(frame)
            else:
                await self._connection.send(frame)
                await self._send_answers()
        await self._send_together(small)
        await self._send_answers()
        self.report_dropped()
        return found

    async def _send_together(self, frames: Sequence[bytes]) -> None:
        """Send small messages with one write, which costs more than all else that is done for them."""
        socket = self._connection
        if len(frames) > 1 and socket.protocol.state is State.OPEN:
            for frame in frames:
                socket.protocol.send_binary(frame)
            socket.transport.write(b"".join(socket.protocol.data_to_send()))
            await socket.drain()  # waits until the client has read enough
        else:
            for frame in frames:
                await socket.send(frame)

    def report_dropped(self) -> None:
        """Send the number of dropped messages if it has grown."""
        dropped, now_ns = self.dropped, self._clock.monotonic_ns()
        if dropped > self._reported_dropped and now_ns - self._reported_ns >= _REPORT_EVERY_NS:
            self._reported_dropped, self._reported_ns = dropped, now_ns
            missed = counted(dropped, "message was", "messages were")
            self.send_status(Level.WARNING, f"{missed} dropped: they came faster than they were read", id_="drops")

    # What the client sends.

    async def _on_message(self, message: str | bytes, is_taken: Callable[[str | bytes], bool]) -> None:
        try:
            if not is_taken(message):
                await self._do(protocol.read(message))
        except BusflowError as error:
            self.send_status(Level.ERROR, str(error))

    async def _do(self, request: protocol.Request) -> None:
        match request:
            case protocol.Subscribe(pairs):
                for id_, channel in pairs:
                    await self._subscribe(id_, channel)
            case protocol.Unsubscribe(ids):
                for id_ in ids:
                    self._unsubscribe(id_)
            case protocol.Publish() | protocol.Advertise() | protocol.Unadvertise():
                await self._do_with_publications(request)
            case protocol.FollowGraph(on):
                self._follow_graph(on=on)
            case protocol.CallService():
                self._begin_call(request)
            case protocol.FetchAsset():
                self._assets.begin(request, self._tasks)
            case _:
                await self._do_with_parameters(request)

    async def _do_with_publications(
        self, request: protocol.Publish | protocol.Advertise | protocol.Unadvertise
    ) -> None:
        match request:
            case protocol.Publish(id_, payload):
                self._require_writable("publish")
                self._publications.publish(id_, payload)
            case protocol.Advertise(channels):
                self._require_writable("publish")
                for each in channels:
                    await self._begin(each)
                self.send_misfits()
                await self._run.ask(self._run.peer.settle)  # what it publishes next is read after that
            case protocol.Unadvertise(ids):
                for id_ in ids:
                    self._publications.end(id_)

    async def _do_with_parameters(
        self, request: protocol.GetParameters | protocol.SetParameters | protocol.FollowParameters
    ) -> None:
        parameters = self._run.parameters
        match request:
            case protocol.GetParameters(names, id_):
                rows = await self._run.ask(parameters.get, names)
                self.send(protocol.text("parameterValues", parameters=rows, id=id_))
            case protocol.SetParameters(values, id_):
                self._require_writable("set parameters")
                reasons = await self._run.ask(parameters.set, values)
                for reason in reasons:
                    self.send_status(Level.ERROR, reason)
                if reasons or id_ is not None:  # after a refusal it shows what was typed, until it is sent what is set
                    rows = await self._run.ask(parameters.get, tuple(values)) if values else ()
                    self.send(protocol.text("parameterValues", parameters=rows, id=id_))
                await self._run.send_parameters()
            case protocol.FollowParameters(names, on):
                self._follow_parameters(names, on=on)
                await self._run.send_parameters()

    def _require_writable(self, what: str) -> None:
        if self.read_only:
            raise InspectionUnavailable(f"this viewer may not {what}: it may only look (--read-only)")

    def _follow_graph(self, *, on: bool) -> None:
        if on and not self.follows_graph:
            self.send(protocol.text("connectionGraphUpdate", **self._run.connections.since(Connections())))
        self.follows_graph = on

    def _follow_parameters(self, names: Sequence[str], *, on: bool) -> None:
        if on:
            self._parameters |= set(names)
            self._all_parameters |= not names
        elif names:
            self._parameters -= set(names)
        else:
            self._parameters.clear()
            self._all_parameters = False

    async def _begin(self, channel: protocol.ClientChannel) -> None:
        try:
            await self._run.ask(self._publications.begin, channel, self._run.graph)
        except BusflowError as error:
            self.send_status(Level.ERROR, f"cannot publish: {error}")

    def _begin_call(self, request: protocol.CallService) -> None:
        task = self._tasks.create_task(self._call(request))
        self._calls.add(task)
        task.add_done_callback(self._calls.discard)

    async def _call(self, request: protocol.CallService) -> None:
        offer = self._run.catalogue.services.get(request.service)
        try:
            self._require_writable("call services")
            if offer is None:
                raise NoSuchTarget("the service has gone")
            if request.encoding != offer.encoding:
                raise MalformedMessage(f"its requests are {offer.encoding}, not {printable(request.encoding)!r}")
            if len(self._calls) > _MOST_CALLS:
                raise ServiceUnavailable(f"{_MOST_CALLS} calls are under way")
            payload = offer.kind.request.without_surplus(request.payload)
            question = partial(self._run.peer.call_bytes, offer.kind, payload, timeout_s=timeouts.current.call)
            payload = await self._run.call(question)
        except BusflowError as error:
            ids = {"serviceId": request.service, "callId": request.call}
            self.send(protocol.text("serviceCallFailure", **ids, message=str(error)))
            # Lichtblick shows no failed call, and its panel waits for ever.
            self.send_status(Level.ERROR, f"{offer.kind.name}: {error}" if offer else str(error))
        else:
            self.send(protocol.call_answered(request.service, request.call, offer.encoding, payload))

    async def _subscribe(self, id_: int, channel_id: int) -> None:
        channel = self._run.catalogue.channels.get(channel_id)
        if channel is None:
            self.send_status(Level.WARNING, f"there is no channel {channel_id} any more")
            return
        if id_ in self._subscriptions or any(each.channel.id == channel_id for each in self._subscriptions.values()):
            self.send_status(Level.WARNING, f"{channel.topic.name} is subscribed to already")
            return
        with ExitStack() as ending:
            listening = self._run.peer.listen(
                channel.topic, channel.type, depth=_DEPTH, most_bytes=_MOST_BYTES, on_arrival=self._call_to_send
            )
            listener = ending.enter_context(listening)
            kept = await self._send_kept(id_, channel)
            self._subscriptions[id_] = _Subscription(id_, channel, listener, ending.pop_all(), kept)
        self._wake.set()

    async def _send_kept(self, id_: int, channel: OfferedTopic) -> Collection[bytes]:
        """Send what the run keeps of its log, and return it: `/rosout` itself begins with the next line."""
        if channel.topic.name != ROSOUT:
            return ()
        lines: dict[bytes, int] = await self._run.ask(kept_log, self._run.peer, channel.type)
        for payload, stamp_ns in lines.items():
            self.send(protocol.message_data(id_, stamp_ns, payload))
        return lines.keys()

    def _unsubscribe(self, id_: int) -> None:
        found = self._subscriptions.get(id_)
        if found is None:
            self.send_status(Level.WARNING, f"nothing is subscribed to under the number {id_}")
        else:
            self._end(found)

    def _end(self, subscription: _Subscription) -> None:
        del self._subscriptions[subscription.id]
        self._dropped_before += subscription.listener.dropped + subscription.listener.lost
        subscription.ending.close()

    def _call_to_send(self) -> None:
        """Wake the viewer when a message arrives; called in Zenoh's thread. One wake is enough until it has looked."""
        if self._is_woken:
            return
        self._is_woken = True
        with suppress(RuntimeError):  # the loop has ended, and all viewers with it
            self._loop.call_soon_threadsafe(self._wake.set)
