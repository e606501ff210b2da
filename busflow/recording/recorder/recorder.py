"""`Recorder`: writes a run into a file as it happens: messages, parameters, calls, log, and what all came to.

It receives each message before any queue, and no node waits for it: a recording that fails changes nothing else in the
run. It numbers every message first, so that a missing one shows as a gap.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from busflow.bus.endpoint import PARAMETER_EVENTS, ROSOUT
from busflow.bus.patterns import Selection
from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS
from busflow.bus.services.client import Client
from busflow.bus.services.server import Server
from busflow.bus.timer import Timer
from busflow.bus.topic_origins import Origins
from busflow.errors import IncompleteRecording
from busflow.launchfile.model.description import OnDrop
from busflow.msgs.rcl_interfaces import ParameterEvent
from busflow.msgs.std_msgs import String
from busflow.node import parameter_messages
from busflow.node.parameter_store import ParameterChange, ParameterStore, SetResult
from busflow.recording.mcap.writer import McapWriter
from busflow.recording.recorder.channels import Track, Tracks
from busflow.recording.recorder.destination import Destination, named, new_recording
from busflow.recording.recorder.options import spec_of
from busflow.recording.recorder.provenance import facts, launch_files, ledger, library
from busflow.recording.recorder.service_events import SUFFIX, event_class, event_message
from busflow.recording.recorder.spool import CLOSE_TIMEOUT_S, Spool
from busflow.recording.recorder.ticks import TICKS, tick_message
from busflow.runner.extension import Extension
from busflow.runner.report import RecordingReport
from busflow.runner.rosout import log_message
from busflow.text import did_you_mean, printable

if TYPE_CHECKING:
    from busflow.bus.services.call import Call
    from busflow.bus.services.service import Service
    from busflow.bus.topic import Topic
    from busflow.clock import Clock
    from busflow.interfaces.message import Message
    from busflow.launchfile.model.description import RecordSpec
    from busflow.log import LogRecord
    from busflow.node.endpoints import Attached
    from busflow.node.parameters import Parameters
    from busflow.recording.recorder.options import Wanted
    from busflow.recording.recorder.share import Share
    from busflow.runner.graph import Graph
    from busflow.runner.report import Report

_SERVICE_QOS = _TICKS_QOS = QoS()
_LOG_QOS = _PARAMETERS_QOS = QoS(depth=1000)


def record_graph(graph: Graph, wanted: Wanted | None) -> None:
    """Record a graph that is yet to be started, until it has ended; None is as its launch file says.

    Raises:
        InvalidParameter: what is wanted cannot be, with every reason.
        InvalidName: one of the patterns is none.
    """
    spec = spec_of(wanted, next((each.record for each in graph.descriptions if each.record is not None), None))
    if spec is None:
        return
    graph.attach(Recorder(graph, spec))


def record_share(graph: Graph, share: Share) -> None:
    """Record a graph that is yet to be started, being one process of a run of which each records itself.

    Raises:
        InvalidName: one of the patterns is none.
    """
    graph.attach(Recorder(graph, share.spec, share))


class Recorder(Extension):
    """Writes one run, or a process's share of one, into one file."""

    end_s = CLOSE_TIMEOUT_S

    def __init__(self, graph: Graph, spec: RecordSpec, share: Share | None = None) -> None:
        """A recorder of what `spec` says, which begins when the graph starts."""
        self._graph, self._spec, self._share = graph, spec, share
        self._clock, self._log = graph.clock, graph.log.bind("busflow")
        self._selection = Selection(spec.topics, spec.exclude)
        self._tracks = Tracks()
        self._parameters = ParameterTrack(graph.clock)
        self._seen: set[str] = set()
        self._taps: list[tuple[Topic[Any], Callable[[Any], None]]] = []
        self._lock = threading.Lock()  # log lines may come from other threads
        self._sequence = 0
        self._missed = 0
        self._why = ""
        self._destination: Destination | None = None
        self._spool: Spool | None = None
        self._finished = self._failed = False

    # Its life.

    def begin(self) -> None:
        """Make the file, and listen from now on; called before the first end of a topic comes.

        Raises:
            RecordingRefused: the file is there already, or cannot be made.
        """
        graph = self._graph
        path = named(self._spec.to, run=graph.name) if self._share is None else self._share.file
        with new_recording(path) as destination:
            self._destination = destination
            self._file = file = McapWriter(destination, library=library(), compression=self._spec.compression)
            now_ns = self._clock.now_ns()
            process = "" if self._share is None else self._share.process
            file.add_metadata(*facts(graph.name, graph.seed, self._clock.kind, now_ns, process))
            for name, text in launch_files(graph.descriptions):
                file.add_attachment(name, "application/yaml", text.encode(), time_ns=now_ns)
        self._loop, self._thread = asyncio.get_running_loop(), threading.get_ident()
        self._spool = Spool(file, destination, threaded=self._clock.kind == "system", on_failure=self._on_failure)
        graph.bus.on_attach.append(self._on_attach)
        if self._selection.includes(ROSOUT):
            from busflow.msgs.rcl_interfaces import Log as LogMessage

            track = self._tracks.own(ROSOUT, LogMessage, _LOG_QOS)
            graph.log.sinks.append(partial(self._on_log, track))

    def end(self) -> None:
        """End the file with what the run came to."""
        with self._lock:  # a line of another thread comes before the account, or not into the file
            spool, self._spool = self._spool, None
        if spool is None:
            return
        bus = self._graph.bus
        bus.on_attach.remove(self._on_attach)
        for topic, tap in self._taps:
            if tap in topic.taps:
                bus.untap(topic, tap)
        if self._share is None:  # else the main process reports: a pattern unmatched here may match elsewhere
            self._report_unmatched()
        for track in self._tracks.by_topic.values():
            if not track.number and track.offered:
                self._tracks.announce(spool, track)
        report = replace(self._graph.report(), recording=None).as_json()
        recorded = self._sequence - self._missed
        complete = spool.do(lambda file: file.add_metadata(*ledger(report, recorded, self._missed)))
        complete = spool.do(lambda file: file.finish()) and complete
        self._finished = spool.close() and complete
        if spool.failure is not None:
            self._on_failure(spool.failure)
        elif not self._finished:
            self._failed = True
            self._report_missing("its end could not be written in time")

    def report(self, report: Report) -> Report:
        """The run's report, with that of its recording."""
        return replace(report, recording=self.statistics())

    def statistics(self) -> RecordingReport:
        """The state of the recording, so far or at the end; what waited when writing failed is missed."""
        left = self._destination.left if self._destination else None
        missed = self._sequence - self._file.written(left) if self._failed else self._missed
        return RecordingReport(
            path=str(self._destination.path if self._destination else self._spec.to),
            recorded=self._sequence - missed,
            missed=missed,
            complete=self._finished and not missed,
            why=self._why,
        )

    # What comes.

    def _on_attach(self, attached: Attached) -> None:
        if isinstance(attached, ParameterStore):
            self._follow_parameters(attached)
        elif isinstance(attached, Timer):
            self._follow_timer(attached)
        elif isinstance(attached, Server | Client):
            if attached.service not in self._seen:
                self._seen.add(attached.service)
                self._follow_service(attached.service)
        else:
            topic = self._graph.bus.topics[attached.topic]
            if topic.name not in self._seen:
                self._seen.add(topic.name)
                self._follow_topic(topic)
            track = self._tracks.by_topic.get(topic.name)
            if track is not None and isinstance(attached, Publisher) and not track.number and self._is_own(attached):
                track.offered.append(attached.endpoint.qos)
                if attached.endpoint.node not in track.nodes:
                    track.nodes.append(attached.endpoint.node)

    def _is_own(self, publisher: Publisher[Any]) -> bool:
        """True if messages of a publisher may be recorded here."""
        end = publisher.endpoint
        return self._share is None or not end.remote or end.node not in self._share.nodes

    def _follow_topic(self, topic: Topic[Any]) -> None:
        # The recorder itself records parameters and log, also without another subscription.
        if topic.name in {PARAMETER_EVENTS, ROSOUT} or not self._selection.includes(topic.name):
            return
        track = self._tracks.add(topic.name, topic.type)
        tap = partial(self._write, track) if self._share is None else self._own(track, topic, self._share)
        self._taps.append((topic, tap))
        self._graph.bus.tap(topic, tap)

    def _own(self, track: Track, topic: Topic[Any], share: Share) -> Callable[[Any], None]:
        """Make the tap that records a topic here; messages of nodes of other processes are recorded there."""
        origins = Origins(topic)
        recorder = share.outside.get(topic.name)

        def record(message: Message) -> None:
            node = origins.of_this()
            if node is None or (node not in share.nodes and recorder == share.process):
                self._write(track, message)
            elif node not in share.nodes and recorder is None:
                self._miss(f"no process records what {node} publishes on {topic.name} from outside the run")

        return record

    def _follow_service(self, name: str) -> None:
        topic = name + SUFFIX
        if not self._selection.includes(name, topic):
            return
        service = self._graph.bus.services[name]
        cls = event_class(service.type)
        track = self._tracks.add(topic, cls)
        track.offered.append(_SERVICE_QOS)
        elsewhere: set[int] = set()  # calls of a server in another process, which records them

        def record(call: Call[Any, Any]) -> None:
            if self._share is not None and _is_elsewhere(call, service, elsewhere):
                return
            message = event_message(cls, call, self._clock.now())
            if message is not None:
                self._write(track, message)

        service.taps.append(record)

    def _follow_parameters(self, store: ParameterStore) -> None:
        track = self._tracks.own(PARAMETER_EVENTS, ParameterEvent, _PARAMETERS_QOS)
        self._parameters.follow(store, partial(self._write, track))

    def _follow_timer(self, timer: Timer) -> None:
        track = self._tracks.own(TICKS, String, _TICKS_QOS)
        timer.observe(lambda: self._write(track, tick_message(timer, self._clock)))

    def _on_log(self, track: Track, record: LogRecord) -> None:
        if record.process:
            return  # which has recorded it
        self._write(track, log_message(record))

    # On its way to the file.

    def _write(self, track: Track, message: Message) -> None:
        problem = ""
        try:
            payload = track.encode(message)
        except Exception as error:  # noqa: BLE001  # a message that cannot be recorded is no fault of its publisher
            payload, problem = b"", f"a message on {track.topic} cannot be put into bytes: {error}"
        with self._lock:
            spool = self._spool
            if spool is None:
                return
            self._sequence += 1
            taken = not problem and (track.number or self._tracks.announce(spool, track))
            taken = taken and spool.put(track.number, self._sequence, self._clock.now_ns(), payload)
            if not taken:
                self._missed += 1
        if not taken:
            self._report_missing(problem or _reason(spool.failure))

    def _miss(self, why: str) -> None:
        """Leave a gap for a message that is not recorded and should be."""
        with self._lock:
            self._sequence += 1
            self._missed += 1
        self._report_missing(why)

    # What goes wrong.

    def _on_failure(self, error: Exception) -> None:
        """Nothing more can be written; in the spool's thread, if it has one."""
        self._failed = True
        self._report_missing(_reason(error))

    def _report_missing(self, why: str) -> None:
        """Say once that the recording is not complete, in whichever thread that is found out."""
        if threading.get_ident() != self._thread:
            with suppress(RuntimeError):  # the loop has ended: `end` reports it
                self._loop.call_soon_threadsafe(self._report_missing, why)
            return
        if self._why:
            return
        self._why = why
        text = f"the recording {printable(self.statistics().path)} is incomplete: {self._why}"
        if self._spec.on_drop is OnDrop.FAIL:
            self._graph.give_up(IncompleteRecording(f"{text} (on_drop: fail)"))
        else:
            self._log.warning(text)

    def _report_unmatched(self) -> None:
        for pattern in self._selection.unmatched:
            self._log.warning(
                f"there was no topic {printable(pattern)}, so nothing of it was recorded; "
                f"{did_you_mean(pattern, self._graph.bus.topics)}"
            )


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


def _is_elsewhere(call: Call[Any, Any], service: Service[Any, Any], known: set[int]) -> bool:
    """True if a server of another process answers a call; `known` holds those calls while they last."""
    if call.outcome is None and not isinstance(service.server, Server | None):
        known.add(call.number)
        return True
    found = call.number in known
    if call.outcome is not None:
        known.discard(call.number)
    return found


def _reason(failure: Exception | None) -> str:
    """The reason why a message was not recorded."""
    if failure is None:
        return "messages come faster than they can be written"
    reason = failure.strerror if isinstance(failure, OSError) else f"{type(failure).__name__}: {failure}"
    return f"nothing more can be written to it: {reason}"
