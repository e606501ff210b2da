"""TopicInlet: carries the messages of one topic from DDS into the run, each under the name of its writer's node."""

# The stubs of zenoh and cyclonedds leave out what many of their functions take and return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import threading
from collections import deque
from typing import TYPE_CHECKING, Any

from busflow.dds.names import DdsName, NameUse, user_data

if TYPE_CHECKING:
    from busflow.dds.calls import BridgeParts
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.wire.client.speaker import Speaker
    from busflow.wire.zenoh.qos_text import WireQoS

_MOST_HELD = 1000
"""Messages that wait until the run knows their writer."""
_MOST_HELD_BYTES = 64 * 1024 * 1024


class TopicInlet:
    """Carries one topic's messages into the run. They wait until the run knows their writer."""

    def __init__(self, topic: str, type_: ForeignType, qos: WireQoS, parts: BridgeParts) -> None:
        """Create the topic's reader.

        Raises:
            UnknownType: DDS cannot describe the type.
        """
        self.type: ForeignType = type_
        self.qos: WireQoS = qos
        self._name, self._carried = topic, parts.carried
        self._participant, self._intake = parts.participant, parts.intake
        self._carrier = parts.carriers.of(type_)
        self._lock = threading.Lock()
        self._speakers: dict[bytes, Speaker | None] = {}
        """By gid of the writer; None for one that the run does not take."""
        self._gids: dict[int, bytes] = {}
        self._held: deque[tuple[bytes, bytes]] = deque()
        self._held_bytes = 0
        self._latest_ns: dict[bytes, int] = {}
        self._renewed = False
        self._reader = self._read(qos)

    @property
    def gid(self) -> bytes:
        """The reader's gid in DDS."""
        return self._reader.guid.bytes

    def renew(self, qos: WireQoS) -> None:
        """Read with another QoS; what writers keep for late joiners comes again, and is not carried twice."""
        self._intake.remove(self._reader)
        self._renewed = True
        self.qos = qos
        self._reader = self._read(qos)

    def admit(self, gid: bytes, speaker: Speaker | None) -> None:
        """Carry a writer's messages from now on, those first that waited; without a speaker, ignore them."""
        with self._lock:
            self._speakers[gid] = speaker
            waiting, self._held = self._held, deque()
            self._held_bytes = 0
            for held_gid, payload in waiting:
                self._carry(held_gid, payload)

    def dismiss(self, gid: bytes) -> None:
        """Forget a writer that has gone."""
        with self._lock:
            self._speakers.pop(gid, None)
            self._latest_ns.pop(gid, None)
            self._gids = {handle: each for handle, each in self._gids.items() if each != gid}

    def close(self) -> None:
        """Read no more."""
        self._intake.remove(self._reader)

    def _read(self, qos: WireQoS) -> Any:
        stated = user_data(typehash=self.type.type_hash)
        reader = self._participant.reader(DdsName(NameUse.TOPIC, self._name), self._carrier, qos, stated)
        self._intake.add(reader, self._on_samples)
        return reader

    def _on_samples(self, samples: list[Any]) -> None:
        with self._lock:
            for sample in samples:
                info = sample.sample_info
                if not info.valid_data or (gid := self._gid(info.publication_handle)) is None:
                    continue
                if self._renewed and info.source_timestamp <= self._latest_ns.get(gid, 0):
                    continue
                self._latest_ns[gid] = info.source_timestamp
                self._carry(gid, sample.payload)

    def _carry(self, gid: bytes, payload: bytes) -> None:
        speaker = self._speakers.get(gid)
        if speaker is not None:
            speaker.publish_bytes(payload)
            self._carried.into_run += 1
        elif gid not in self._speakers:
            self._hold(gid, payload)

    def _hold(self, gid: bytes, payload: bytes) -> None:
        self._held.append((gid, payload))
        self._held_bytes += len(payload)
        while len(self._held) > _MOST_HELD or (self._held_bytes > _MOST_HELD_BYTES and len(self._held) > 1):
            self._held_bytes -= len(self._held.popleft()[1])
            self._carried.dropped += 1

    def _gid(self, handle: int) -> bytes | None:
        if handle not in self._gids:
            found = self._reader.get_matched_publication_data(handle)
            if found is None:  # it has gone
                return None
            self._gids[handle] = found.key.bytes
        return self._gids[handle]
