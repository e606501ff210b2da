"""The calls of a replay: requests to its nodes are made again, and their own calls get the recorded answers.

What a node answers, and what it asks others, is compared as what it publishes is.
"""

from __future__ import annotations

import asyncio
from collections import defaultdict
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from busflow.errors import BusflowError
from busflow.interfaces.encoding.foreign import ForeignType
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.service_msgs import ServiceEventInfo
from busflow.recording.replay.comparison import Check, Published
from busflow.runner.extension import Extension
from busflow.runner.service_events import SUFFIX, client_gid, event_class

if TYPE_CHECKING:
    from busflow.bus.services.call import Activity, Call
    from busflow.clock import Clock
    from busflow.interfaces.message import Message, ServiceType
    from busflow.recording.bag.channel import Channel, Entry
    from busflow.runner.graph import Graph

_REPLAYER = "/_replay"
"""The caller of requests that are made again."""


class Calls(Extension):
    """The services that a graph's nodes answer and ask."""

    def __init__(self, graph: Graph, check: Check, answered: Collection[str]) -> None:
        """Calls for a graph, to which they are yet to be attached.

        Args:
            graph: The nodes.
            check: Is given requests and answers, then and now.
            answered: The services that were answered when they were recorded.
        """
        self._graph, self._check = graph, check
        members = graph.plan().members
        self._gids = {client_gid(each.runtime.full_name).tobytes(): each.runtime.full_name for each in members}
        self._served: dict[str, type[ServiceType]] = {end.service: end.type for each in members for end in each.servers}
        asked = {end.service: end.type for each in members for end in each.clients}
        self._asked: dict[str, StandIn] = {
            name: StandIn(name, service_type, check, graph.clock)
            for name, service_type in asked.items()
            if name not in self._served and name in answered
        }
        self._tasks: set[asyncio.Task[None]] = set()
        for name, service_type in self._served.items():
            check.watch(name, plain_of(service_type.Response))

    def role(self, channel: Channel) -> Callable[[Entry], None] | None:
        """A handler for the events of a service; None if no node has a part in it."""
        name = channel.topic.removesuffix(SUFFIX)
        if name == channel.topic:
            return None
        if name in self._served:
            return _Server(self, name, self._served[name]).on_event
        return self._asked[name].hearer(self._gids) if name in self._asked else None

    def is_ours(self, gid: bytes) -> bool:
        """True if one of the replayed nodes made the call: it then makes it again by itself."""
        return gid in self._gids

    def call(self, name: str, request: Message) -> None:
        """Make a request anew, and compare the answer when it comes."""
        task = asyncio.get_running_loop().create_task(self._call(name, request))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def answered(self, name: str, time_ns: int, response: Message) -> None:
        """The recorded answer of a node."""
        self._check.recorded(name, Published(time_ns, TypeSupport(type(response)).encode(response)))

    async def close(self) -> None:
        """Wait for no answers any more.

        Raises:
            Exception: One of the requests failed in a way that is no service's.
        """
        tasks = tuple(self._tasks)
        for task in tasks:
            task.cancel()
        for outcome in await asyncio.gather(*tasks, return_exceptions=True):
            if isinstance(outcome, Exception):
                raise outcome

    async def _call(self, name: str, request: Message) -> None:
        service = self._graph.bus.services.get(name)
        if service is None:
            return
        with suppress(BusflowError):  # an answer that was recorded and does not come is a difference already
            response: Message = await service.call(request, caller=_REPLAYER)
            now_ns = self._graph.clock.now().nanoseconds
            self._check.replayed(name, Published(now_ns, TypeSupport(type(response)).encode(response)))

    def begin(self) -> None:
        """Answer what the nodes ask others."""
        for name, stand_in in self._asked.items():
            self._graph.bus.service(name, stand_in.type, "the recording").join(stand_in)


class _Server:
    """A service that one of the nodes answers."""

    def __init__(self, calls: Calls, name: str, service_type: type[ServiceType]) -> None:
        self._calls, self._name, self._event = calls, name, event_class(service_type)

    def on_event(self, entry: Entry) -> None:
        """Make the request anew, or know what the answer was; what the nodes ask each other they ask by themselves."""
        event: Any = entry.channel.decode(entry.payload, self._event)
        if self._calls.is_ours(event.info.client_gid.tobytes()):
            return
        if event.info.event_type == ServiceEventInfo.REQUEST_RECEIVED and event.request:
            self._calls.call(self._name, event.request[0])
        elif event.info.event_type == ServiceEventInfo.RESPONSE_SENT and event.response:
            self._calls.answered(self._name, entry.log_time_ns, event.response[0])


class StandIn:
    """Answers in the place of a node that is not run anew, as was recorded: the nth call of a node gets its answer."""

    def __init__(self, name: str, service_type: type[ServiceType], check: Check, clock: Clock) -> None:
        self.node = "the recording"
        self.type = service_type
        self._topic, self._check, self._clock = f"{name} (requests)", check, clock
        self._encode = TypeSupport(service_type.Request).encode
        self._event = event_class(service_type)
        self._made: defaultdict[str, int] = defaultdict(int)
        self._waiting: dict[tuple[str, int], Call[Any, Any]] = {}
        self._asked: defaultdict[str, list[int]] = defaultdict(list)
        self._answers: dict[tuple[str, int], Message] = {}
        check.watch(self._topic, plain_of(service_type.Request))

    def holder(self, call: Call[Any, Any]) -> Activity | None:  # noqa: ARG002  # whichever it is
        """Return None: nothing holds it up."""
        return None

    def accept(self, call: Call[Any, Any]) -> None:
        """Take a call, and answer it when its answer was recorded."""
        self._check.replayed(self._topic, Published(self._clock.now().nanoseconds, self._encode(call.request)))
        key = call.caller, self._made[call.caller]
        self._made[call.caller] += 1
        if key in self._answers:
            call.succeed(self._answers.pop(key))
        else:
            self._waiting[key] = call

    def withdraw(self, call: Call[Any, Any]) -> None:
        """The caller does not wait for the answer any more."""

    def statistics(self) -> None:
        """There is no server, and so no account."""

    def hearer(self, gids: Mapping[bytes, str]) -> Callable[[Entry], None]:
        """A listener for the service events of replayed nodes."""

        def on_event(entry: Entry) -> None:
            event: Any = entry.channel.decode(entry.payload, self._event)
            caller = gids.get(event.info.client_gid.tobytes())
            if caller is None:
                return
            if event.info.event_type == ServiceEventInfo.REQUEST_RECEIVED and event.request:
                self._asked[caller].append(event.info.sequence_number)
                self._check.recorded(self._topic, Published(entry.log_time_ns, self._encode(event.request[0])))
            elif event.info.event_type == ServiceEventInfo.RESPONSE_SENT and event.response:
                self._answer(caller, event.info.sequence_number, event.response[0])

        return on_event

    def _answer(self, caller: str, number: int, response: Message) -> None:
        if number not in self._asked[caller]:
            return
        key = caller, self._asked[caller].index(number)
        call = self._waiting.pop(key, None)
        if call is None:
            self._answers[key] = response
        else:
            call.succeed(response)


def plain_of(cls: type[Message]) -> Callable[[bytes], Any]:
    """A function that turns messages of a class into plain data."""
    support = TypeSupport(cls)
    return ForeignType(support.name, support.type_hash, support.description).decode
