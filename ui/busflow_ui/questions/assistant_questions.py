"""AssistantQuestions: what pages ask the assistant of a run: its state, and questions about the text.

The run's service answers; its parts come on a topic, of which a page is sent those of its own question alone.
"""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from busflow.clock import SystemClock
from busflow.errors import BusflowError, ServiceUnavailable
from busflow_ui import timeouts
from busflow_ui.questions import arguments as checked
from busflow_ui.questions.cited_pages import Chapters, CitedPages

if TYPE_CHECKING:
    from busflow.commands import Listener
    from busflow_ui.foxglove.bridge import Bridge
    from busflow_ui.foxglove.catalogue import OfferedTopic
    from busflow_ui.questions.allowance import Allowance

SERVICE_TYPE = "busflow_assistant/srv/AskText"
MOST_SELECTION = 20_000
"""Largest selection in bytes; the assistant cuts it there too."""
MOST_QUESTION = 2_000
_MOST_INDEX = 256 * 1024 * 1024
_MOST_PARTS = 10_000
_WORDS = ("id", "answer", "answered", "scope", "reason", "engine", "ms")

SendPart = Callable[[object], None]


@dataclass(slots=True)
class _Feed:
    """Topic of the assistant, while it is listened to."""

    offered: OfferedTopic
    listener: Listener


class AssistantQuestions:
    """Questions to the assistant of one run."""

    def __init__(self, bridge: Bridge, chapters: Chapters) -> None:
        """Ask about a book.

        Args:
            bridge: the run.
            chapters: the book that is shown beside it, in which citations get their places.
        """
        self._bridge, self._chapters = bridge, chapters
        self._clock = SystemClock()
        self._feeds: dict[str, _Feed] = {}
        self._listening = ExitStack()
        self._waiting: dict[str, SendPart] = {}
        self._state: Mapping[str, Any] | None = None
        self._sources: Mapping[str, str] = {}
        self._loop = asyncio.get_running_loop()

    async def state(self, _arguments: Mapping[str, Any]) -> object:
        """Return whether an assistant runs, and what answers where: `{running, engine, host, model, pages}`.

        One that has not said where questions go is `starting`: a page must not promise meanwhile that they stay here.
        """
        if self._service() is None:
            return {"running": False}
        await self._bridge.ask(self._listen)
        return {"running": False, "starting": True} if self._state is None else {"running": True, **self._state}

    async def ask(self, arguments: Mapping[str, Any], send_part: SendPart, allowance: Allowance | None) -> object:
        """Ask; parts of the answer come before it: `{id, answer, answered, scope, reason, citations, engine, ms}`."""
        question, selection = checked.text(arguments, "question"), checked.text(arguments, "selection")
        chapter = checked.text(arguments, "chapter")
        if allowance is not None:
            allowance.take(self._clock.seconds())
        service = self._service()
        if service is None:
            raise ServiceUnavailable("no assistant runs")
        await self._bridge.ask(self._listen)
        pages = CitedPages(self._chapters, self._sources)
        number = secrets.token_hex(8)
        values = {
            "id": number,
            "question": question[:MOST_QUESTION],
            "selection": selection.encode("utf-8", "replace")[:MOST_SELECTION].decode("utf-8", "ignore"),
            "page": pages.page_of(chapter) if chapter else "",
        }
        self._waiting[number] = send_part
        try:
            found = await self._bridge.call(
                lambda: self._bridge.peer.call(service, values, timeout_s=timeouts.current.assistant)
            )
        finally:
            del self._waiting[number]
        citations = [pages.placed(each) for each in found["citations"]]
        return {**{word: found[word] for word in _WORDS}, "citations": citations}

    def close(self) -> None:
        """Listen no more."""
        self._listening.close()

    def _service(self) -> Any:
        """Return the assistant's service; None where none runs."""
        offered = self._bridge.catalogue.services.values()
        return next((each.kind for each in offered if each.kind.type == SERVICE_TYPE), None)

    def _listen(self) -> None:
        """Listen to the topics beside the service, each from the moment at which it is offered, and read them."""
        service = self._service()
        if service is None:
            return
        prefix = service.name.rpartition("/")[0]
        channels = {each.topic.name: each for each in self._bridge.catalogue.channels.values()}
        for word, depth in (("state", 1), ("index", 1), ("tokens", _MOST_PARTS)):
            offered = channels.get(f"{prefix}/{word}")
            if offered is not None and word not in self._feeds:
                self._feeds[word] = self._begin(word, depth, offered)
        self._read_latched()

    def _begin(self, word: str, depth: int, offered: OfferedTopic) -> _Feed:
        on_arrival = self._wake if word == "tokens" else None
        listening = self._bridge.peer.listen(
            offered.topic, offered.type, depth=depth, most_bytes=_MOST_INDEX, on_arrival=on_arrival
        )
        listener = self._listening.enter_context(listening)
        feed = _Feed(offered, listener)
        if word != "tokens":
            self._take(word, feed, timeouts.current.kept_message)
        return feed

    def _read_latched(self) -> None:
        for word in ("state", "index"):
            if word in self._feeds:
                self._take(word, self._feeds[word], 0)

    def _take(self, word: str, feed: _Feed, wait_s: float) -> None:
        """Read the newest message of a topic whose last message is kept for latecomers."""
        received = feed.listener.get(wait_s)
        if received is None:
            return
        message = feed.offered.type.decode(received.payload)
        if word == "state":
            self._state = {name: message[name] for name in ("pages", "engine", "host", "model")}
        else:
            self._sources = {page["name"]: page["source"] for page in message["pages"]}

    def _wake(self) -> None:
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._send_parts)

    def _send_parts(self) -> None:
        feed = self._feeds.get("tokens")
        while feed is not None and (received := feed.listener.get(0)) is not None:
            with suppress(BusflowError):  # the run names the publisher of a malformed message
                part = feed.offered.type.decode(received.payload)
                send = self._waiting.get(part["id"])
                if send is not None:
                    send({"number": part["number"], "text": part["text"], "last": part["last"]})
