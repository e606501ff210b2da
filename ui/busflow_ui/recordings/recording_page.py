"""RecordingPage: one page that looks at a recording: its subscriptions, its moment, and the messages it is sent."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Collection, Generator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from websockets.exceptions import ConnectionClosed

from busflow.clock import SystemClock
from busflow.errors import BusflowError, InspectionUnavailable, MalformedMessage
from busflow.text import printable
from busflow_ui.foxglove import protocol
from busflow_ui.foxglove.protocol import Level
from busflow_ui.questions import arguments as checked
from busflow_ui.questions.followed import Changed
from busflow_ui.questions.session import Question, Session
from busflow_ui.recordings.contents import graph_of, log_of
from busflow_ui.recordings.overview import MOST_BINS, Stretch, overview, path_of
from busflow_ui.recordings.playback import Playback

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection

    from busflow.commands import Entry
    from busflow_ui.recordings.recording import Recording

_TICK_S = 0.02
_REPORT_NS = 100_000_000
"""The interval at which a page that plays is informed of the moment."""
_LOOK_S = 0.5
"""The interval at which what it follows is looked at again, if the moment has changed."""
_MOST_AT_ONCE = 500
"""Most messages of a tick. What plays faster than it can be sent goes on later, and nothing is left out."""
_MOST_BYTES_AT_ONCE = 16 * 1024 * 1024
_MOST_OUTGOING = 1000
_MOST_RATE = 100.0
_MOST_LINES = 1000

_Reading = Generator[tuple[int, "Entry"]]


class RecordingPage:
    """Conversation with one page, from its admission to its end."""

    def __init__(
        self, connection: ServerConnection, recording: Recording, *, print_message: Callable[[str], None]
    ) -> None:
        self._connection, self._recording = connection, recording
        self._clock = SystemClock()
        self.playback: Playback = Playback(recording.start_ns, recording.end_ns, recording.start_ns)
        self._subscriptions: dict[int, int] = {}
        """The topic of each subscription, both by number."""
        self._outgoing: deque[str] = deque()
        self._wake = asyncio.Event()
        self._fresh: set[int] = set()
        """Subscriptions that are to be sent what their topic shows at the moment."""
        self._reading: _Reading | None = None
        self._next: tuple[int, Entry] | None = None
        self._sent_ns = recording.start_ns - 1
        """The moment up to which messages were sent."""
        self._reported_ns = 0
        self._thread = ThreadPoolExecutor(1, "busflow-ui-recording")
        self._counting = ThreadPoolExecutor(1, "busflow-ui-counting")  # which takes seconds: playing goes on meanwhile
        self._session = Session(
            {
                "time": Question(self._time, remaining=Changed),
                "run": Question(self._run, remaining=Changed),
                "graph": Question(self._graph, remaining=Changed),
                "log": Question(self._log, remaining=Changed),
                "seek": Question(self._seek),
                "overview": Question(self._overview),
            },
            self._send_text,
            read_only=True,
            print_message=print_message,
        )

    async def serve(self, greeting: str) -> None:
        """Send and receive until either side ends the connection."""
        self._send_text(greeting)
        topics = [each.announcement() for each in self._recording.topics.values()]
        self._send_text(protocol.text("advertise", channels=topics))
        try:
            async with asyncio.TaskGroup() as tasks:
                sending = [tasks.create_task(each()) for each in (self._send, self._keep_looking)]
                with suppress(ConnectionClosed):
                    async for message in self._connection:
                        await self._on_message(message)
                for task in sending:
                    task.cancel()
        finally:
            self._session.close()
            self._restart()
            self._thread.shutdown(wait=False)
            self._counting.shutdown(wait=False, cancel_futures=True)

    # What is received.

    async def _on_message(self, message: str | bytes) -> None:
        try:
            if not self._session.take(message):
                self._do(protocol.read(message))
        except BusflowError as error:
            self._send_text(protocol.status(Level.ERROR, printable(error)))

    def _do(self, request: protocol.Request) -> None:
        match request:
            case protocol.Subscribe(pairs):
                known = {id_: topic for id_, topic in pairs if topic in self._recording.topics}
                self._subscriptions |= known
                self._fresh |= known.keys()
            case protocol.Unsubscribe(ids):
                for id_ in ids:
                    self._subscriptions.pop(id_, None)
                self._restart()
            case protocol.FollowGraph() | protocol.FollowParameters() | protocol.GetParameters():
                return
            case _:
                raise InspectionUnavailable("a recording can only be looked at")
        self._wake.set()

    # What is sent.

    def _send_text(self, message: str) -> None:
        self._outgoing.append(message)
        if len(self._outgoing) > _MOST_OUTGOING:
            self._connection.transport.abort()  # it asks and does not read
        self._wake.set()

    async def _send(self) -> None:
        with suppress(ConnectionClosed):
            while True:
                self._wake.clear()
                while self._outgoing:
                    await self._connection.send(self._outgoing.popleft())
                if self._fresh:
                    await self._send_last()
                if self.playback.playing:
                    await self._send_due()
                with suppress(TimeoutError):
                    async with asyncio.timeout(_TICK_S if self.playback.playing else None):
                        await self._wake.wait()

    async def _send_last(self) -> None:
        """Send what topics show that are new, or all where the page went to another moment."""
        fresh, self._fresh = self._fresh & self._subscriptions.keys(), set()
        topics = {self._subscriptions[id_] for id_ in fresh}
        found: list[tuple[int, Entry]] = await self._read(self._recording.shown_at, self._sent_ns, topics)
        for topic, entry in found:
            await self._send_entry(topic, entry, fresh)
        await self._connection.send(protocol.time(self._sent_ns))
        self._restart()

    async def _send_due(self) -> None:
        """Send the messages that the playback has reached."""
        now_ns = self._clock.monotonic_ns()
        until_ns = self.playback.at(now_ns)
        found: list[tuple[int, Entry]] = await self._read(self._take, until_ns)
        for topic, entry in found:
            await self._send_entry(topic, entry, self._subscriptions.keys())
        if self._fresh:
            return  # the page went elsewhere meanwhile
        is_behind = self._next is not None and self._next[1].log_time_ns <= until_ns
        self._sent_ns = found[-1][1].log_time_ns if is_behind else until_ns
        if is_behind:
            self.playback = self.playback.changed(now_ns, stamp_ns=self._sent_ns)
        elif until_ns == self._recording.end_ns:
            self.playback = self.playback.changed(now_ns, playing=False)
        if now_ns - self._reported_ns >= _REPORT_NS or not self.playback.playing:
            self._reported_ns = now_ns
            self._session.send_update("time", self.playback.as_json(now_ns))
            await self._connection.send(protocol.time(self._sent_ns))

    async def _send_entry(self, topic: int, entry: Entry, ids: Collection[int]) -> None:
        for id_ in ids:
            if self._subscriptions.get(id_) == topic:
                await self._connection.send(protocol.message_data(id_, entry.log_time_ns, entry.payload))

    async def _keep_looking(self) -> None:
        """Send the graph and the log again where the page has gone to another moment."""
        looked_ns = self._sent_ns
        while True:
            await self._clock.sleep(_LOOK_S)
            if looked_ns != self._sent_ns:
                looked_ns = self._sent_ns
                for name, answer in (("graph", self._graph), ("log", self._log)):
                    if name in self._session.following:
                        self._session.send_update(name, await answer({}))

    async def _read(self, function: Callable[..., Any], *arguments: Any) -> Any:
        return await asyncio.get_running_loop().run_in_executor(self._thread, function, *arguments)

    async def _count(self, function: Callable[..., Any], *arguments: Any) -> Any:
        return await asyncio.get_running_loop().run_in_executor(self._counting, function, *arguments)

    def _take(self, until_ns: int) -> list[tuple[int, Entry]]:
        """Read on to a moment; in the thread that reads."""
        if self._reading is None:
            topics = set(self._subscriptions.values())
            self._reading, self._next = self._recording.from_(self._sent_ns + 1, topics), None
        found: list[tuple[int, Entry]] = []
        size = 0
        while len(found) < _MOST_AT_ONCE and size < _MOST_BYTES_AT_ONCE:
            self._next = self._next or next(self._reading, None)
            if self._next is None or self._next[1].log_time_ns > until_ns:
                break
            found.append(self._next)
            size += len(self._next[1].payload)
            self._next = None
        return found

    def _restart(self) -> None:
        """Read from where messages were sent up to, before the next one is sent."""
        reading, self._reading, self._next = self._reading, None, None
        if reading is not None:
            self._thread.submit(reading.close)

    # Questions.

    async def _time(self, _arguments: Mapping[str, Any]) -> object:
        return self.playback.as_json(self._clock.monotonic_ns())

    async def _seek(self, arguments: Mapping[str, Any]) -> object:
        """Go to a moment, play, pause, or change the rate; what is not stated stays."""
        now_ns = self._clock.monotonic_ns()
        stamp_ns = None if arguments.get("stamp_ns") is None else checked.digits(arguments, "stamp_ns")
        playing = None if arguments.get("play") is None else checked.flag(arguments, "play")
        rate = checked.number(arguments, "rate", above=0, most=_MOST_RATE, default=self.playback.rate)
        if playing and stamp_ns is None and self.playback.at(now_ns) == self._recording.end_ns:
            stamp_ns = self._recording.start_ns  # at its end it begins anew
        self.playback = self.playback.changed(now_ns, stamp_ns=stamp_ns, playing=playing, rate=rate)
        if stamp_ns is not None:
            self._sent_ns = self.playback.stamp_ns
            self._fresh = set(self._subscriptions)
            self._restart()
        found = self.playback.as_json(now_ns)
        self._session.send_update("time", found)
        self._wake.set()
        return found

    async def _overview(self, arguments: Mapping[str, Any]) -> object:
        """Return one number over a stretch of the recording, thinned; an end that is not stated is the recording's."""
        topic, path = checked.text(arguments, "topic"), path_of(arguments.get("path"))
        whole = {"from_ns": self._recording.start_ns, "to_ns": self._recording.end_ns}
        ends = {word: checked.digits(arguments, word) if word in arguments else end for word, end in whole.items()}
        if ends["to_ns"] <= ends["from_ns"]:
            raise MalformedMessage("to_ns is after from_ns")
        bins = checked.whole_number(arguments, "bins", least=1, most=MOST_BINS, default=MOST_BINS)
        stretch = Stretch(ends["from_ns"], ends["to_ns"], bins)
        return await self._count(overview, self._recording, topic, path, stretch)

    async def _run(self, _arguments: Mapping[str, Any]) -> object:
        return {"name": self._recording.name, "file": str(self._recording.path)}

    async def _graph(self, _arguments: Mapping[str, Any]) -> object:
        return await self._count(graph_of, self._recording, self._sent_ns)

    async def _log(self, arguments: Mapping[str, Any]) -> object:
        count = checked.whole_number(arguments, "count", least=1, most=_MOST_LINES, default=_MOST_LINES)
        return {"lines": await self._count(log_of, self._recording, self._sent_ns, count)}
