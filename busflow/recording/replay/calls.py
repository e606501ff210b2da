"""Calls: makes the recorded requests to replayed nodes again, and gives the nodes' own calls the recorded answers.

The answers and the requests of the nodes are compared with the recorded ones, as the messages that they publish are.
"""

from __future__ import annotations

import asyncio
from collections import defaultdict
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from busflow.actions.names import GET_RESULT, SEND_GOAL, action_of
from busflow.errors import BusflowError
from busflow.interfaces.encoding.foreign import ForeignType
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.service_msgs import ServiceEventInfo
from busflow.recording.replay.comparison import Check, Published
from busflow.recording.replay.goals import SentGoals
from busflow.runner.extension import Extension
from busflow.runner.service_events import SUFFIX, client_gid, event_class

if TYPE_CHECKING:
    from busflow.bus.services.call import Activity, Call
    from busflow.clock import Clock
    from busflow.interfaces.message import Message, ServiceType
    from busflow.recording.bag.channel import Channel, Entry
    from busflow.recording.replay.history import Past
    from busflow.runner.graph import Graph

_REPLAYER = "/_replay"
"""The caller's name in requests that the replay makes again."""


class Calls(Extension):
    """The services that a graph's nodes answer, and those that they call."""

    def __init__(self, graph: Graph, check: Check, past: Past) -> None:
        """Prepare the calls of a graph; the caller attaches them to it.

        Args:
            graph: The nodes.
            check: Compares the recorded requests and answers with those of the replay.
            past: The facts of the recording: the services that were answered, and the goals that were sent.
        """
        self._graph, self._check = graph, check
        nodes = graph.plan().nodes
        self._gids = {client_gid(each.runtime.full_name).tobytes(): each.runtime.full_name for each in nodes}
        sent = {(service, self._gids[gid]): ids for (service, gid), ids in past.goals.items() if gid in self._gids}
        self.goals: SentGoals = SentGoals(sent)
        """The goals that the nodes send."""
        served = {end.service: end.type for each in nodes for end in each.servers}
        called = {end.service: end.type for each in nodes for end in each.clients}
        actions = {action_of(name) for name in past.answered} - {None}
        self._stand_ins: dict[str, StandIn] = {
            name: StandIn(name, service_type, check, graph.clock, self.goals)
            for name, service_type in called.items()
            if name not in served and (name in past.answered or action_of(name) in actions)
        }
        self._servers = {name: _Server(self, name, service_type) for name, service_type in served.items()}
        self._tasks: set[asyncio.Task[None]] = set()
        for name, service_type in served.items():
            check.watch(name, plain_of(service_type.Response))

    def handler(self, channel: Channel) -> Callable[[Entry], None] | None:
        """Return the handler of a service's recorded events; None for other channels, or if no node needs them."""
        name = channel.topic.removesuffix(SUFFIX)
        if name == channel.topic:
            return None
        if name in self._servers:
            return self._servers[name].on_event
        return self._stand_ins[name].listener(self._gids) if name in self._stand_ins else None

    def is_by_node(self, gid: bytes) -> bool:
        """Return whether a replayed node made the call: the node makes it again by itself."""
        return gid in self._gids

    def call(self, name: str, request: Message) -> None:
        """Make a recorded request again, and compare the answer when it comes."""
        task = asyncio.get_running_loop().create_task(self._call(name, request))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def answered(self, name: str, time_ns: int, response: Message) -> None:
        """Note the recorded answer of a node, for the comparison."""
        self._check.recorded(name, Published(time_ns, TypeSupport(type(response)).encode(response)))

    async def close(self) -> None:
        """Cancel the requests that have no answer yet.

        Raises:
            Exception: A request failed with an error that is not busflow's.
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
        with suppress(BusflowError):  # if an answer was recorded, its absence is a difference anyway
            response: Message = await service.call(request, caller=_REPLAYER)
            now_ns = self._graph.clock.now().nanoseconds
            self._check.replayed(name, Published(now_ns, TypeSupport(type(response)).encode(response)))

    def begin(self) -> None:
        """Answer the nodes' calls to nodes that do not run in the replay."""
        for name, stand_in in self._stand_ins.items():
            self._graph.bus.service(name, stand_in.type, "the recording").join(stand_in)


class _Server:
    """Handles the recorded events of a service that a replayed node answers."""

    def __init__(self, calls: Calls, name: str, service_type: type[ServiceType]) -> None:
        self._calls, self._name, self._event = calls, name, event_class(service_type)
        self._open: dict[tuple[bytes, int], Message] = {}
        """Requests for results of goals that are not answered yet: many a client withdraws its one."""

    def on_event(self, entry: Entry) -> None:
        """Make a recorded request again, or note a recorded answer; skip calls that a replayed node makes by itself."""
        event: Any = entry.channel.decode(entry.payload, self._event)
        if self._calls.is_by_node(event.info.client_gid.tobytes()):
            return
        key = event.info.client_gid.tobytes(), event.info.sequence_number
        if event.info.event_type == ServiceEventInfo.REQUEST_RECEIVED and event.request:
            if self._name.endswith(GET_RESULT):
                self._open[key] = event.request[0]
            else:
                self._calls.call(self._name, event.request[0])
        elif event.info.event_type == ServiceEventInfo.RESPONSE_SENT and event.response:
            if key in self._open:
                self._calls.call(self._name, self._open.pop(key))
            self._calls.answered(self._name, entry.log_time_ns, event.response[0])


class StandIn:
    """Answers for a node that does not run in the replay: a caller's nth call gets its nth recorded answer."""

    def __init__(
        self, name: str, service_type: type[ServiceType], check: Check, clock: Clock, goals: SentGoals
    ) -> None:
        self.node = "the recording"
        self.type = service_type
        self._name, self._goals = name, goals
        self._topic, self._check, self._clock = f"{name} (requests)", check, clock
        self._encode = TypeSupport(service_type.Request).encode
        self._event = event_class(service_type)
        self._made: defaultdict[str, int] = defaultdict(int)
        """By caller, the number of calls in the replay."""
        self._waiting: dict[tuple[str, int], Call[Any, Any]] = {}
        """By caller and index, the calls whose recorded answers are still to come."""
        self._recorded_numbers: defaultdict[str, list[int]] = defaultdict(list)
        """By caller, the sequence numbers of the recorded requests: the nth belongs to the caller's nth call."""
        self._answers: dict[tuple[str, int], Message] = {}
        """By caller and index, the recorded answers whose calls are still to come."""
        check.watch(self._topic, plain_of(service_type.Request))

    def holder(self, call: Call[Any, Any]) -> Activity | None:  # noqa: ARG002  # whichever it is
        """Return None: no activity delays a recorded answer."""
        return None

    def accept(self, call: Call[Any, Any]) -> None:
        """Take a call, and answer it once the replay has reached the recorded answer."""
        key = call.caller, self._made[call.caller]
        self._made[call.caller] += 1
        if self._name.endswith(SEND_GOAL):
            self._goals.send(self._name, *key, call.request.goal_id.uuid.tobytes())
        self._check.replayed(self._topic, Published(self._clock.now().nanoseconds, self._recorded(call.request)))
        if key in self._answers:
            call.succeed(self._answers.pop(key))
        else:
            self._waiting[key] = call

    def _recorded(self, request: Message) -> bytes:
        """Return a request as the recording would have it."""
        payload = self._encode(request)
        return payload if action_of(self._name) is None else self._goals.as_recorded(payload)

    def withdraw(self, call: Call[Any, Any]) -> None:
        """Do nothing: an answer to a caller that no longer waits has no effect."""

    def statistics(self) -> None:
        """Return None: there is no server here that counts."""

    def listener(self, gids: Mapping[bytes, str]) -> Callable[[Entry], None]:
        """Return a handler of the service's recorded events; it uses those of calls by replayed nodes, named by gid."""

        def on_event(entry: Entry) -> None:
            event: Any = entry.channel.decode(entry.payload, self._event)
            caller = gids.get(event.info.client_gid.tobytes())
            if caller is None:
                return
            if event.info.event_type == ServiceEventInfo.REQUEST_RECEIVED and event.request:
                self._recorded_numbers[caller].append(event.info.sequence_number)
                self._check.recorded(self._topic, Published(entry.log_time_ns, self._encode(event.request[0])))
            elif event.info.event_type == ServiceEventInfo.RESPONSE_SENT and event.response:
                self._answer(caller, event.info.sequence_number, event.response[0])

        return on_event

    def _answer(self, caller: str, number: int, response: Message) -> None:
        if number not in self._recorded_numbers[caller]:
            return
        key = caller, self._recorded_numbers[caller].index(number)
        call = self._waiting.pop(key, None)
        if call is None:
            self._answers[key] = response
        else:
            call.succeed(response)


def plain_of(cls: type[Message]) -> Callable[[bytes], Any]:
    """Return a function that decodes messages of a class to plain data."""
    support = TypeSupport(cls)
    return ForeignType(support.name, support.type_hash, support.description).decode
