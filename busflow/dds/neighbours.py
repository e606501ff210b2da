"""Neighbours: the endpoints of other participants of the domain, and the nodes to which these belong."""

# The stubs of cyclonedds leave out what many of its functions take and return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsParticipant,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import InstanceState
from cyclonedds.qos import Policy, Qos

from busflow.dds.idl import Carriers
from busflow.dds.names import DdsName, NameUse, is_of_cyclone, type_of, user_data
from busflow.dds.node_lists import READ, TOPIC, WRITTEN, ListedNode, decode_nodes, encode_nodes, node_list_type
from busflow.dds.participant import Intake, Participant
from busflow.dds.qos import from_dds, stated_user_data
from busflow.errors import MalformedMessage
from busflow.interfaces.encoding.description import is_rihs01
from busflow.wire.zenoh.qos_text import WireQoS

BARE = ListedNode("/", "_CREATED_BY_BARE_DDS_APP_")
"""ROS 2's name for whatever has endpoints and lists no node."""
UNKNOWN = ListedNode("/", "_NODE_NAME_UNKNOWN_")
"""ROS 2's name for the node of an endpoint that its participant should have listed."""
_MOST = 10_000
"""Limit of the endpoints, and of the participants, that are known; a domain with more is faulty or malicious."""


@dataclass(frozen=True, slots=True)
class NeighbourEnd:
    """A reader or writer of another participant, on a topic or service of ROS 2."""

    gid: bytes
    participant: bytes
    name: DdsName
    type: str
    """ROS 2's name of its type, such as `sensor_msgs/msg/Imu`."""
    hash: str | None
    """The hash of its type, if it states one."""
    qos: WireQoS
    is_writer: bool
    describes_type: bool
    """Whether it describes its type to others (XTypes), as nodes of ROS 2 with Fast DDS 3 do."""

    @property
    def can_cross(self) -> bool:
        """Whether the bridge can carry it: of services, those of Cyclone alone, as others write no header."""
        return self.name.use is NameUse.TOPIC or is_of_cyclone(self.gid)

    @property
    def may_not_match(self) -> bool:
        """Whether another DDS than Cyclone compares its description of the type with Cyclone's."""
        return self.describes_type and not is_of_cyclone(self.gid)


class Neighbours:
    """What other participants of the domain have, as it is now."""

    def __init__(
        self,
        participant: Participant,
        carriers: Carriers,
        *,
        on_change: Callable[[], None],
        on_fault: Callable[[str], None],
    ) -> None:
        """Look for neighbours from now on.

        Args:
            participant: this process's own, whose endpoints are left out.
            carriers: DDS types.
            on_change: called in a thread when something has come, changed or gone.
            on_fault: called with the reason when a neighbour shows what cannot be.
        """
        self._own, self._on_change, self._on_fault = participant, on_change, on_fault
        self._lock = threading.Lock()
        self._ends: dict[bytes, NeighbourEnd] = {}
        self._nodes: dict[bytes, tuple[ListedNode, ...]] = {}
        self._participants: dict[bytes, bool] = {}
        """By gid, whether it is ROS 2's, and so lists its nodes."""
        self._listed: tuple[ListedNode, ...] | None = None
        self._type = node_list_type()
        carrier = carriers.of(self._type)
        stated = user_data(typehash=self._type.type_hash)
        self._carrier, self._writer = carrier, participant.writer(TOPIC, carrier, WRITTEN, stated)
        lists = participant.reader(TOPIC, carrier, READ, stated)
        everything = Qos(Policy.History.KeepLast(1))
        participants, publications, subscriptions = (
            BuiltinDataReader(participant.entity, topic, qos=everything)
            for topic in (BuiltinTopicDcpsParticipant, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription)
        )
        self._intake = Intake(participant, "busflow.dds.neighbours", on_error=lambda error: on_fault(str(error)))
        self._intake.add(participants, self._on_participants)
        self._intake.add(publications, lambda samples: self._on_ends(samples, is_writer=True))
        self._intake.add(subscriptions, lambda samples: self._on_ends(samples, is_writer=False))
        self._intake.add(lists, self._on_lists)

    def close(self) -> None:
        """Look no more."""
        self._intake.close()

    @property
    def ends(self) -> list[NeighbourEnd]:
        """The endpoints of topics and services."""
        with self._lock:
            return list(self._ends.values())

    @property
    def nodes(self) -> list[ListedNode]:
        """The nodes of all neighbours."""
        with self._lock:
            return [node for nodes in self._nodes.values() for node in nodes]

    def node_of(self, end: NeighbourEnd) -> ListedNode | None:
        """Return the node of an endpoint; `BARE` if its participant lists none, None if ROS 2 has yet to list it."""
        with self._lock:
            listed = self._nodes.get(end.participant, ())
            lists_nodes = self._participants.get(end.participant, False)
        found = (node for node in listed if end.gid in (node.writers if end.is_writer else node.readers))
        return next(found, None if lists_nodes else BARE)

    def list_own(self, nodes: tuple[ListedNode, ...]) -> None:
        """List the nodes of this participant for the neighbours, if they have changed."""
        if nodes != self._listed:
            self._listed = nodes
            self._writer.write(self._carrier.of(encode_nodes(self._type, self._own.gid, nodes)))

    def _on_participants(self, samples: list[Any]) -> None:
        for sample in samples:
            gid = sample.key.bytes
            with self._lock:
                if not _is_alive(sample):
                    self._participants.pop(gid, None)
                    self._nodes.pop(gid, None)
                elif len(self._participants) < _MOST:
                    self._participants[gid] = "enclave" in stated_user_data(sample.qos)
        self._on_change()

    def _on_ends(self, samples: list[Any], *, is_writer: bool) -> None:
        for sample in samples:
            gid = sample.key.bytes
            if not _is_alive(sample):
                with self._lock:
                    self._ends.pop(gid, None)
            elif sample.participant_key.bytes != self._own.gid and (end := self._end(sample, is_writer=is_writer)):
                with self._lock:
                    if gid in self._ends or len(self._ends) < _MOST:
                        self._ends[gid] = end
        self._on_change()

    def _end(self, sample: Any, *, is_writer: bool) -> NeighbourEnd | None:
        try:
            name = DdsName.parse(sample.topic_name)
            if name is None:
                return None
            type_hash = stated_user_data(sample.qos).get("typehash", "")
            return NeighbourEnd(
                gid=sample.key.bytes,
                participant=sample.participant_key.bytes,
                name=name,
                type=type_of(sample.type_name),
                hash=type_hash if is_rihs01(type_hash) else None,
                qos=from_dds(sample.qos),
                is_writer=is_writer,
                describes_type=sample.type_id is not None,
            )
        except MalformedMessage as error:
            self._on_fault(str(error))
            return None

    def _on_lists(self, samples: list[Any]) -> None:
        for sample in samples:
            if not sample.sample_info.valid_data:
                continue
            try:
                gid, nodes = decode_nodes(self._type, sample.payload)
            except MalformedMessage as error:
                self._on_fault(str(error))
                continue
            with self._lock:
                if gid in self._nodes or len(self._nodes) < _MOST:
                    self._nodes[gid] = tuple(nodes)
        self._on_change()


def _is_alive(sample: Any) -> bool:
    return bool(sample.sample_info.instance_state == InstanceState.Alive and sample.sample_info.valid_data)
