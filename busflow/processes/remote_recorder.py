"""RemoteRecorder: records a run from another process, which joins the run and only subscribes.

It writes the bytes of each message as they arrived, in the order of arrival. A number that its publisher has used, and
that does not arrive, is a lost message; it leaves a gap in the recording's own numbers too.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from busflow.bus.endpoint import PARAMETER_EVENTS
from busflow.bus.qos import QoS
from busflow.clock import SystemClock
from busflow.errors import BagError, BusflowError
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.rcl_interfaces import ParameterEvent
from busflow.node.parameter_messages import event_message
from busflow.node.parameter_store import ParameterChange
from busflow.node.parameters import ParameterInfo
from busflow.recording.bag.rosbag2_metadata import describe_recordings
from busflow.recording.recorder.channels import Announcer
from busflow.recording.recorder.destination import as_directory, named, new_directory
from busflow.recording.recorder.provenance import MetadataRecord, facts
from busflow.recording.recorder.recording_file import Latched, RecordingFile, SplitFile, file_maker
from busflow.recording.recorder.spool import Spool
from busflow.wire.client.graph_view import TopicView, view
from busflow.wire.client.known_type import known_type
from busflow.wire.client.listener import Listener, Received
from busflow.wire.zenoh.qos_text import as_qos

if TYPE_CHECKING:
    from pathlib import Path

    import zenoh

    from busflow.bus.patterns import Selection
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.launchfile.model.description import Compression, Split
    from busflow.wire.client.client import Peer

_MOST_DEPTH = 10_000
_PARAMETERS_QOS = QoS(depth=1000)


class RemoteRecorder:
    """Writes the messages of a run's topics to a file, until it is closed."""

    def __init__(
        self, peer: Peer, selection: Selection, *, to: str, compression: Compression, split: Split | None = None
    ) -> None:
        """Make the file; the caller calls `follow` again and again, to find new topics.

        Args:
            peer: the connection to the run.
            selection: the topics to record.
            to: the path of the file, in which `{name}` and `{start}` stand for the run's name and the time.
            compression: the compression of the file.
            split: the limits of a part, for a recording that is a directory of parts; None for one file.

        Raises:
            RecordingRefused: the file exists already, or cannot be made.
        """
        self._peer = peer
        self._selection = selection
        self._clock = SystemClock()
        self._lock = threading.Lock()
        self._listening = ExitStack()
        self._listeners: dict[tuple[str, str, str | None], _TopicListener] = {}
        self._unavailable: dict[tuple[str, str, str | None], str] = {}
        self._announcer = Announcer()
        self._sequence = self._missed = 0
        self._complete = False
        self._metadata_error: Exception | None = None
        """The error that prevented the metadata of the parts."""
        self.path: Path = named(to, run=peer.run.name)
        """The file, or the directory of parts."""
        self._split = split
        make_file = file_maker(self._facts(), compression)
        if split is None:
            file = RecordingFile(*make_file(self.path))
        else:
            with new_directory(as_directory(self.path)) as self.path:
                file = SplitFile(self.path / f"{self.path.name}.mcap", split, make_file, durable=True)
        self._spool = Spool(file, threaded=True, on_failure=lambda _error: None)
        self.nodes: int = self._write_parameters()
        """Number of nodes whose parameters were recorded at the beginning."""

    def _facts(self) -> MetadataRecord:
        """Return the facts of the run, with the one that it is recorded from outside."""
        run = self._answer("run")
        clock, seed = str(run.get("clock", self._clock.kind)), run.get("seed")
        name, known = facts(self._peer.run.name, seed, clock, self._clock.now_ns())
        return name, {**known, "heard": "from outside"}

    @property
    def failure(self) -> Exception | None:
        """The error that ended the writing, or prevented the metadata of the parts; None while all is well."""
        return self._spool.failure or self._metadata_error

    @property
    def topics(self) -> tuple[str, ...]:
        """Names of the topics to which the recorder subscribes."""
        return tuple(dict.fromkeys(topic for topic, *_ in self._listeners))

    @property
    def unmatched(self) -> tuple[str, ...]:
        """Patterns for which no topic was found so far."""
        return self._selection.unmatched

    @property
    def unavailable(self) -> Mapping[str, str]:
        """Selected topics to which the recorder could not subscribe so far, each with the reason."""
        return {topic: why for (topic, *_), why in self._unavailable.items()}

    @property
    def recorded(self) -> int:
        """Number of messages that were accepted for writing."""
        return self._sequence - self._missed

    @property
    def published(self) -> int:
        """Number of recorded messages that were published: all but the parameters of the beginning."""
        return self.recorded - self.nodes

    @property
    def missed(self) -> int:
        """Number of messages that were lost on their way here, or could not be written."""
        return self._missed

    @property
    def complete(self) -> bool:
        """True if the file is finished and no message is missing."""
        return self._complete and not self._missed

    def _write_parameters(self) -> int:
        """Write the parameters of all nodes that answer, as a recorder in the run does; return their number."""
        answers: list[Any] = []
        with suppress(BusflowError):  # a process that is blocked or about to end does not answer
            answers = self._peer.ask("parameters")
        found: dict[str, list[dict[str, Any]]] = {node: rows for each in answers for node, rows in each.items()}
        support, now = TypeSupport(ParameterEvent), self._clock.now()
        number = 0
        for node, rows in sorted(found.items()):
            number = number or self._announcer.announce(self._spool, PARAMETER_EVENTS, support, [_PARAMETERS_QOS])
            changes = [ParameterChange(row["name"], None, row["value"]) for row in rows]
            infos = {row["name"]: ParameterInfo(row["name"], row["type"]) for row in rows}
            self._sequence += 1
            payload = support.encode(event_message(now, node, changes, infos))
            if not number or not self._spool.put(number, self._sequence, now.nanoseconds, payload):
                self._missed += 1
        return self._sequence - self._missed

    def _answer(self, question: str) -> Mapping[str, Any]:
        """Query the run; return an empty answer unless exactly one process answers."""
        answers: list[Any] = []
        # A process that is blocked or about to end does not answer; its messages are recorded all the same.
        with suppress(BusflowError):
            answers = self._peer.ask(question)
        return answers[0] if len(answers) == 1 else {}

    def follow(self) -> None:
        """Subscribe to selected topics that are new, and update the publishers of known ones."""
        for topic in view(self._peer.tokens(), []).topics.values():
            for kind in topic.kinds if topic.publishers else ():
                if (listener := self._listeners.get((topic.name, *kind))) is None:
                    self._listen(topic, *kind)
                else:
                    listener.update(topic)

    def _listen(self, topic: TopicView, type_name: str, type_hash: str | None) -> None:
        if not self._selection.includes(topic.name):
            return
        key = topic.name, type_name, type_hash
        try:
            type_ = known_type(self._peer, type_name, type_hash)
            listener = _TopicListener(self, topic, type_)
            self._listening.enter_context(self._peer.listen(topic, type_, listener=listener))
        except BusflowError as error:  # a busy or just ended process is asked again at the next call
            self._unavailable[key] = str(error)
        else:
            self._listeners[key] = listener
            self._unavailable.pop(key, None)

    def write(self, listener: _TopicListener, received: Received, lost: int) -> None:
        """Write a message, with `lost` messages of its publisher missing before it; called in any thread."""
        time_ns = received.stamp_ns or self._clock.now_ns()
        with self._lock:
            self._sequence += lost + 1
            self._missed += lost
            announced = listener.number or self._announce(listener)
            if not announced or not self._spool.put(listener.number, self._sequence, time_ns, received.payload):
                self._missed += 1
            elif self._split is not None and (publisher := listener.latching.get(received.gid)) is not None:
                latched = Latched(publisher, listener.number, self._sequence, time_ns, received.payload)
                self._spool.do(lambda file: file.add_latched(latched))

    def _announce(self, listener: _TopicListener) -> bool:
        listener.number = self._announcer.announce(
            self._spool, listener.topic, listener.type, listener.offered, listener.nodes
        )
        return listener.number > 0

    def close(self) -> None:
        """Stop listening, and finish the file."""
        report: Mapping[str, Any] = self._answer("report") if self._peer.alive else {}
        self._listening.close()
        with self._lock:
            for listener in self._listeners.values():
                if not listener.number:
                    self._announce(listener)
            recorded, missed = self.recorded, self.missed
            whole = self._spool.do(lambda file: file.conclude(report, recorded, missed))
            self._complete = self._spool.close() and whole
        if self._split is not None:
            self._describe_parts()

    def _describe_parts(self) -> None:
        """Write the metadata, which names the parts for readers."""
        try:
            describe_recordings(self.path)
        except (BagError, OSError) as error:
            self._complete, self._metadata_error = False, error


@dataclass(frozen=True, slots=True)
class _Publisher:
    """A publisher of the run."""

    gid: bytes
    qos: QoS


class _TopicListener(Listener):
    """Listens to one topic."""

    def __init__(self, owner: RemoteRecorder, topic: TopicView, type_: ForeignType) -> None:
        super().__init__(depth=1)
        self.topic: str = topic.name
        self.type: ForeignType = type_
        self.number = 0
        """Number of the topic's channel; 0 before the first message."""
        self.offered: list[QoS] = [as_qos(end.qos, most_depth=_MOST_DEPTH) for end in topic.publishers]
        self.nodes: list[str] = sorted({end.node for end in topic.publishers})
        self.latching: dict[bytes, _Publisher] = {}
        """The transient_local publishers, by gid."""
        self._owner = owner
        self.update(topic)

    def update(self, topic: TopicView) -> None:
        """Update the transient_local publishers of the topic."""
        ends = ((end.token.gid, as_qos(end.qos, most_depth=_MOST_DEPTH)) for end in topic.publishers)
        self.latching = {gid: _Publisher(gid, qos) for gid, qos in ends if qos.latched}

    def put(self, sample: zenoh.Sample) -> None:
        """Pass a message on at once, without a queue."""
        received = Received.of(sample)
        with self._arrived:
            before = self.lost
            self._count_lost(received)
            lost = self.lost - before
        self._owner.write(self, received, lost)
