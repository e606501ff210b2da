"""QoS in DDS's words and back, as ROS 2's `rmw_cyclonedds` translates them."""

# The stubs of cyclonedds leave out what many of its functions take and return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cyclonedds.qos import Policy, Qos

from busflow.dds.names import read_user_data
from busflow.wire.zenoh.qos_text import WireQoS

_INFINITE_NS = (1 << 63) - 1
"""DDS's duration without end."""
BLOCKING_NS = 100_000_000
"""How long a write may wait for slow reliable readers, before the message is dropped and counted."""
_MOST_DEPTH = 10_000
"""The largest depth of a history here; ROS 2 allows as many messages as a `size_t` counts."""
SERVICE = WireQoS(depth=10)
"""ROS 2's QoS of services: reliable, volatile, ten deep."""


def to_dds(stated: WireQoS, data: bytes, *, is_reader: bool = False) -> Qos:
    """Return the policies of a reader or writer that has this user data."""
    keeps_all = stated.history == "keep_all"
    history = Policy.History.KeepAll if keeps_all else Policy.History.KeepLast(min(max(1, stated.depth), _MOST_DEPTH))
    policies: list[Any] = [
        history,
        Policy.Reliability.BestEffort
        if stated.reliability == "best_effort"
        else Policy.Reliability.Reliable(max_blocking_time=BLOCKING_NS),
        Policy.Durability.TransientLocal if stated.latched else Policy.Durability.Volatile,
        # ROS 2 reads and writes the first version of CDR alone.
        Policy.DataRepresentation(use_cdrv0_representation=True),
        Policy.Userdata(data),
    ]
    lease_ns = stated.lease_ns or _INFINITE_NS
    by_topic = stated.liveliness == "manual_by_topic"
    policies.append((Policy.Liveliness.ManualByTopic if by_topic else Policy.Liveliness.Automatic)(lease_ns))
    if stated.deadline_ns:
        policies.append(Policy.Deadline(stated.deadline_ns))
    if is_reader:
        return Qos(*policies, Policy.IgnoreLocal.Participant)
    policies.append(Policy.WriterDataLifecycle(autodispose=False))
    if stated.lifespan_ns:
        policies.append(Policy.Lifespan(stated.lifespan_ns))
    if stated.latched:
        policies.append(Policy.DurabilityService(0, history, -1, -1, -1))
    return Qos(*policies)


def from_dds(found: Qos) -> WireQoS:
    """Return what a neighbour's endpoint states; DDS does not say how deep a history of others is."""
    reliability, durability = found[Policy.Reliability], found[Policy.Durability]
    liveliness, service = found[Policy.Liveliness], found[Policy.DurabilityService]
    lifespan, deadline = found[Policy.Lifespan], found[Policy.Deadline]
    depth = getattr(getattr(service, "history", None), "depth", 1)
    return WireQoS(
        reliability="best_effort" if reliability == Policy.Reliability.BestEffort else "reliable",
        durability="volatile" if durability in (None, Policy.Durability.Volatile) else "transient_local",
        depth=min(max(1, int(depth)), _MOST_DEPTH) if durability == Policy.Durability.TransientLocal else 10,
        deadline_ns=_limit(getattr(deadline, "deadline", None)),
        lifespan_ns=_limit(getattr(lifespan, "lifespan", None)),
        liveliness="manual_by_topic" if isinstance(liveliness, Policy.Liveliness.ManualByTopic) else "automatic",
        lease_ns=_limit(getattr(liveliness, "lease_duration", None)),
    )


def stated_user_data(found: Qos) -> Mapping[str, str]:
    """Return the user data that a neighbour's participant or endpoint states among its policies."""
    return read_user_data(getattr(found[Policy.Userdata], "data", b""))


def _limit(duration_ns: int | None) -> int | None:
    return None if duration_ns is None or not 0 < duration_ns < _INFINITE_NS else duration_ns
