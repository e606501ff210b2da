"""`Capture`: what happens in a graph while it runs: messages of topics, calls, parameters, ticks, lines of the log.

This module decides what is captured, and by which of several processes. A recorder decides what is done with each
message.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from busflow.actions.names import action_of
from busflow.bus.bus import BusObserver
from busflow.bus.endpoint import PARAMETER_EVENTS, ROSOUT, Endpoint
from busflow.bus.patterns import Selection
from busflow.bus.qos import QoS
from busflow.bus.topic_origins import Origins
from busflow.msgs.rcl_interfaces import ParameterEvent
from busflow.msgs.std_msgs import String
from busflow.node import parameter_messages
from busflow.node.parameter_store import ParameterChange, ParameterStore, SetResult
from busflow.recording.recorder.channels import Track, Tracks
from busflow.recording.recorder.ticks import TICKS, tick_message
from busflow.runner.rosout import log_message
from busflow.runner.service_events import SUFFIX, event_class, event_message, is_elsewhere
from busflow.text import did_you_mean, printable

if TYPE_CHECKING:
    from busflow.bus.publisher import Publisher
    from busflow.bus.services.call import Call
    from busflow.bus.services.service import Service
    from busflow.bus.timer import Timer
    from busflow.bus.topic import Topic
    from busflow.clock import Clock
    from busflow.interfaces.message import Message
    from busflow.launchfile.model.description import RecordSpec
    from busflow.log import LogRecord
    from busflow.node.parameters import Parameters
    from busflow.recording.recorder.share import Share
    from busflow.runner.graph import Graph

_SERVICE_QOS = _TICKS_QOS = QoS()
_LOG_QOS = _PARAMETERS_QOS = QoS(depth=1000)


class Capture(BusObserver):
    """The taps on a graph, or on a process's share of a run."""

    def __init__(
        self,
        graph: Graph,
        spec: RecordSpec,
        share: Share | None,
        *,
        write: Callable[[Track, Message, Endpoint | None], None],
        miss: Callable[[str], None],
    ) -> None:
        """Create a capture of what `spec` says, from `begin` to `end`.

        Args:
            graph: what runs.
            spec: says which topics and services.
            share: the part of the run that this process records; None for all of it.
            write: takes a message, in any thread, with its publisher if that is transient_local.
            miss: takes the reason why a message that should be recorded is not.

        Raises:
            InvalidName: one of the patterns is not valid.
        """
        self.tracks: Tracks = Tracks()
        self._graph, self._share, self._clock = graph, share, graph.clock
        self._take, self._miss = write, miss
        self._selection = Selection(spec.topics, spec.exclude)
        self._parameters = ParameterTrack(graph.clock)
        self._events: set[str] = set()
        """Topics of the events of recorded services."""
        self._taps: list[tuple[Topic[Any], Callable[[Any], None]]] = []

    def begin(self) -> None:
        """Listen from now on; called before the first endpoint comes."""
        self._graph.bus.observe(self)
        if self._selection.includes(ROSOUT):
            from busflow.msgs.rcl_interfaces import Log as LogMessage

            track = self.tracks.own(ROSOUT, LogMessage, _LOG_QOS)
            self._graph.log.sinks.append(partial(self._on_log, track))

    def end(self) -> None:
        """Remove the taps."""
        bus = self._graph.bus
        bus.observers.remove(self)
        for topic, tap in self._taps:
            if tap in topic.taps:
                bus.untap(topic, tap)
        if self._share is None:  # else the main process reports: a pattern unmatched here may match elsewhere
            self._report_unmatched()

    def publisher_added(self, publisher: Publisher[Any]) -> None:
        """Note the QoS that a recorded topic's publisher offers."""
        track = self.tracks.by_topic.get(publisher.topic)
        if track is not None and self._is_own(publisher):
            track.offer(publisher.endpoint)

    def _is_own(self, publisher: Publisher[Any]) -> bool:
        """Return whether messages of a publisher may be recorded here."""
        end = publisher.endpoint
        return self._share is None or not end.remote or end.node not in self._share.nodes

    def _selects(self, *names: str) -> bool:
        """Return whether one of these names is to be recorded; an action's are hidden, and recorded with the action."""
        action = action_of(names[0])
        return self._selection.includes(*names) or (action is not None and self._selection.includes(action))

    def topic_added(self, topic: Topic[Any]) -> None:
        """Record a topic, if it is selected."""
        # The recorder itself records parameters, log and calls, also without another subscription.
        if topic.name in {PARAMETER_EVENTS, ROSOUT, *self._events} or not self._selects(topic.name):
            return
        track = self.tracks.add(topic.name, topic.type)
        latches = Latches(topic)
        tap = partial(self._write_topic, track, latches)
        if self._share is not None:
            tap = self._own(tap, topic, self._share)
        self._taps.append((topic, tap))
        self._graph.bus.tap(topic, tap)

    def _write_topic(self, track: Track, latches: Latches, message: Message) -> None:
        self._take(track, message, latches.of_this())

    def _write(self, track: Track, message: Message) -> None:
        self._take(track, message, None)

    def _own(self, write: Callable[[Any], None], topic: Topic[Any], share: Share) -> Callable[[Any], None]:
        """Make the tap that records a topic here; messages of nodes of other processes are recorded there."""
        origins = Origins(topic)
        recorder = share.outside.get(topic.name)

        def record(message: Message) -> None:
            node = origins.of_this()
            if node is None or (node not in share.nodes and recorder == share.process):
                write(message)
            elif node not in share.nodes and recorder is None:
                self._miss(f"no process records what {node} publishes on {topic.name} from outside the run")

        return record

    def service_added(self, service: Service[Any, Any]) -> None:
        """Record a service's calls, if it is selected."""
        topic = service.name + SUFFIX
        if not self._selects(service.name, topic):
            return
        cls = event_class(service.type)
        track = self.tracks.add(topic, cls)
        self._events.add(topic)  # it has a publisher while another process listens, of the same events
        track.offered.append(_SERVICE_QOS)
        elsewhere: set[int] = set()  # calls of a server in another process, which records them

        def record(call: Call[Any, Any]) -> None:
            if self._share is not None and is_elsewhere(call, service, elsewhere):
                return
            message = event_message(cls, call, self._clock.now())
            if message is not None:
                self._write(track, message)

        service.taps.append(record)

    def parameters_added(self, store: ParameterStore) -> None:
        """Record a node's parameters."""
        track = self.tracks.own(PARAMETER_EVENTS, ParameterEvent, _PARAMETERS_QOS)
        self._parameters.follow(store, partial(self._write, track))

    def timer_added(self, timer: Timer) -> None:
        """Record a timer's ticks."""
        track = self.tracks.own(TICKS, String, _TICKS_QOS)
        timer.observe(lambda: self._write(track, tick_message(timer, self._clock)))

    def _on_log(self, track: Track, record: LogRecord) -> None:
        if record.process:
            return  # which has recorded it
        self._write(track, log_message(record))

    def _report_unmatched(self) -> None:
        for pattern in self._selection.unmatched:
            self._graph.log.bind("busflow").warning(
                f"there was no topic {printable(pattern)}, so nothing of it was recorded; "
                f"{did_you_mean(pattern, self._graph.bus.topics, none='the graph had no topics')}"
            )


class Latches:
    """The transient_local publishers of a topic, for a tap that calls `of_this` for each message."""

    def __init__(self, topic: Topic[Any]) -> None:
        self._topic = topic
        self._counts = Counter[Endpoint]()

    def of_this(self) -> Endpoint | None:
        """Return the transient_local publisher of the current message; None if its publisher is not.

        A publisher counts a message before taps are called, so the count that changed names the publisher.
        """
        before, self._counts = self._counts, Counter[Endpoint]()
        for each in self._topic.publishers:
            if each.endpoint.qos.latched:
                self._counts[each.endpoint] += each.published  # by endpoint: a restarted node's goes on with its count
        return next((endpoint for endpoint, count in self._counts.items() if count != before[endpoint]), None)


class ParameterTrack:
    """The known parameters of each node, so that a restart records nothing twice."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._known: dict[str, dict[str, object]] = {}

    def follow(self, store: ParameterStore, write: Callable[[ParameterEvent], None]) -> None:
        """Record a node's parameters as far as they are not known, and all changes from now on."""
        known = self._known.setdefault(store.node, {})
        found = {row.name: row.value for row in store.describe()}
        changes = [ParameterChange(name, known.get(name), found.get(name)) for name in {**known, **found}]
        self._record_changes(store, write, [change for change in changes if change.old != change.new])
        store.on_change.append(partial(self._on_change, store, write))

    def _on_change(
        self, store: ParameterStore, write: Callable[[ParameterEvent], None], _old: Parameters, result: SetResult
    ) -> None:
        self._record_changes(store, write, result.changed)

    def _record_changes(
        self, store: ParameterStore, write: Callable[[ParameterEvent], None], changes: Sequence[ParameterChange]
    ) -> None:
        self._known[store.node].update({change.name: change.new for change in changes})
        if changes:
            write(parameter_messages.event_message(self._clock.now(), store.node, changes, store.infos))
