"""`RemoteRecorder`: records a run from outside, as a member of it that only listens.

Messages are written as the bytes that they came as, in the order in which they came. What a publisher numbered and did
not get here is lost, and leaves a gap in the recording's own numbers too.
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
from busflow.recording.mcap.writer import McapWriter
from busflow.recording.recorder.channels import Announcer
from busflow.recording.recorder.destination import as_directory, named, new_directory, new_recording
from busflow.recording.recorder.provenance import facts, library
from busflow.recording.recorder.recording_file import Latched, RecordingFile, SplitFile
from busflow.recording.recorder.spool import Spool
from busflow.wire.client.graph_view import view
from busflow.wire.client.known_type import known_type
from busflow.wire.client.listener import Listener, Received
from busflow.wire.zenoh.qos_text import as_qos

if TYPE_CHECKING:
    from pathlib import Path

    import zenoh

    from busflow.bus.patterns import Selection
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.launchfile.model.description import Compression, Split
    from busflow.recording.recorder.destination import Destination
    from busflow.recording.recorder.provenance import Words
    from busflow.recording.recorder.recording_file import Begin
    from busflow.wire.client.client import Peer
    from busflow.wire.client.graph_view import TopicView

_MOST_DEPTH = 10_000
_PARAMETERS_QOS = QoS(depth=1000)


class RemoteRecorder:
    """Writes what a run publishes into a file, until it is closed."""

    def __init__(
        self, peer: Peer, selection: Selection, *, to: str, compression: Compression, split: Split | None = None
    ) -> None:
        """Make the file; `follow` says when to look for topics.

        Args:
            peer: the run.
            selection: the topics to record.
            to: the path of the file, in which `{name}` and `{start}` stand for the run's name and the time.
            compression: how the file is made smaller.
            split: when a part ends, of a recording that is a directory of parts.

        Raises:
            RecordingRefused: it is there already, or cannot be made.
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
        self._undescribed: Exception | None = None
        """The error after which the parts are without their metadata."""
        self.path: Path = named(to, run=peer.run.name)
        """The file, or the directory of parts."""
        self._split = split
        begin = self._beginning(compression)
        if split is None:
            file = RecordingFile(*begin(self.path))
        else:
            with new_directory(as_directory(self.path)) as self.path:
                file = SplitFile(self.path / f"{self.path.name}.mcap", split, begin, durable=True)
        self._spool = Spool(file, threaded=True, on_failure=lambda _error: None)
        self.nodes: int = self._write_parameters()
        """Number of nodes whose parameters at the beginning have been recorded."""

    def _beginning(self, compression: Compression) -> Begin:
        """Return the function that begins the file, or each part, with the facts of the run."""
        run = self._asked("run")
        clock, seed = str(run.get("clock", self._clock.kind)), run.get("seed")
        name, words = facts(self._peer.run.name, seed, clock, self._clock.now_ns())

        def begin(path: Path, *more: Words) -> tuple[Destination, McapWriter]:
            with new_recording(path) as destination:
                writer = McapWriter(destination, library=library(), compression=compression)
                for each in (*more, (name, {**words, "heard": "from outside"})):
                    writer.add_metadata(*each)
            return destination, writer

        return begin

    @property
    def failure(self) -> Exception | None:
        """Error after which nothing more can be written; None while writing works."""
        return self._spool.failure or self._undescribed

    @property
    def topics(self) -> tuple[str, ...]:
        """Names of the topics that the recorder listens to."""
        return tuple(dict.fromkeys(topic for topic, *_ in self._listeners))

    @property
    def unmatched(self) -> tuple[str, ...]:
        """Patterns for which no topic was found so far."""
        return self._selection.unmatched

    @property
    def unavailable(self) -> Mapping[str, str]:
        """Wanted topics that could not be listened to so far, each with the reason."""
        return {topic: why for (topic, *_), why in self._unavailable.items()}

    @property
    def recorded(self) -> int:
        """Number of messages that were taken in."""
        return self._sequence - self._missed

    @property
    def published(self) -> int:
        """Number of recorded messages that were published: all but the parameters of the beginning."""
        return self.recorded - self.nodes

    @property
    def missed(self) -> int:
        """Number of messages that were lost on the way, or could not be written."""
        return self._missed

    @property
    def complete(self) -> bool:
        """Whether the file is finished and nothing is missing."""
        return self._complete and not self._missed

    def _write_parameters(self) -> int:
        """Write the parameters of all nodes that answer, as a recorder in the run does; return their number."""
        answers: list[Any] = []
        with suppress(BusflowError):  # as above
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

    def _asked(self, question: str) -> Mapping[str, Any]:
        """Ask the run; return nothing if several processes answer, or none."""
        answers: list[Any] = []
        with suppress(
            BusflowError
        ):  # a blocked or leaving process does not answer; its messages are recorded all the same
            answers = self._peer.ask(question)
        return answers[0] if len(answers) == 1 else {}

    def follow(self) -> None:
        """Begin to listen to wanted topics that are new."""
        for topic in view(self._peer.tokens(), []).topics.values():
            for kind in topic.kinds if topic.publishers else ():
                if (listener := self._listeners.get((topic.name, *kind))) is None:
                    self._listen(topic, *kind)
                else:
                    listener.look(topic)

    def _listen(self, topic: TopicView, type_name: str, type_hash: str | None) -> None:
        if not self._selection.includes(topic.name):
            return
        key = topic.name, type_name, type_hash
        try:
            type_ = known_type(self._peer, type_name, type_hash)
            listener = _TopicListener(self, topic, type_)
            self._listening.enter_context(self._peer.listen(topic, type_, listener=listener))
        except BusflowError as error:  # a process that is busy, or has just gone, is asked again the next time
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
        report: Mapping[str, Any] = self._asked("report") if self._peer.alive else {}
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
        """Write the metadata by which readers find the parts."""
        try:
            describe_recordings(self.path)
        except (BagError, OSError) as error:
            self._complete, self._undescribed = False, error


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
        self.look(topic)

    def look(self, topic: TopicView) -> None:
        """Take note of the topic's publishers."""
        ends = ((end.token.gid, as_qos(end.qos, most_depth=_MOST_DEPTH)) for end in topic.publishers)
        self.latching = {gid: _Publisher(gid, qos) for gid, qos in ends if qos.latched}

    def put(self, sample: zenoh.Sample) -> None:
        """Pass a message on at once: nothing waits here."""
        received = Received.of(sample)
        with self._arrived:
            before = self.lost
            self._count_lost(received)
            lost = self.lost - before
        self._owner.write(self, received, lost)
