"""Offer: the QoS of a client's publisher, and the subscriptions that do not receive it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from busflow.errors import MalformedMessage
from busflow.wire.zenoh.qos_text import WireQoS, as_qos, from_text, written

if TYPE_CHECKING:
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.wire.zenoh.keys import Token

_DEPTH = 10


@dataclass(frozen=True, slots=True)
class Offer:
    """What a client states of its publisher's QoS; None means what suits the topic's subscriptions."""

    depth: int | None = None
    reliability: str | None = None
    durability: str | None = None

    def text(self, subscriptions: Iterable[Token]) -> str:
        """Return the QoS, in the form of tokens, that suffices for all of these as far as the stated words allow it.

        What is not stated follows ROS 2's `best_available`: the most reliable and durable there is, for those that
        come later too.
        """
        found = WireQoS(depth=self.depth or _DEPTH, durability="transient_local")
        for each in subscriptions:
            if (requested := _requested(each)) is not None:
                found = _raised(found, requested)
        reliability, durability = self.reliability or found.reliability, self.durability or found.durability
        return written(replace(found, reliability=reliability, durability=durability))


def misfits(type_: ForeignType, qos: str, subscriptions: Iterable[Token]) -> dict[str, str]:
    """Return why subscriptions do not receive a publisher of this type and QoS, by the names of their nodes."""
    offered, found = from_text(qos), dict[str, str]()
    for each in subscriptions:
        if each.type != type_.name:
            found[each.node_name] = f"it receives {each.type}, not {type_.name}"
        elif each.known_hash not in (None, type_.type_hash):
            found[each.node_name] = f"it has another definition of {type_.name}"
        elif (requested := _requested(each)) is not None and _raised(offered, requested) != offered:
            # A client whose offer suffices does not pay for pydantic.
            from busflow.bus.qos_matching import Verdict, compatibility

            result = compatibility(as_qos(offered), as_qos(requested))
            if result.verdict is Verdict.ERROR:
                found[each.node_name] = "; ".join(result.reasons)
    return found


def _requested(subscription: Token) -> WireQoS | None:
    try:
        return from_text(subscription.qos)
    except MalformedMessage:  # no publisher fits it, and its own process says so
        return None


def _raised(offered: WireQoS, requested: WireQoS) -> WireQoS:
    """Return the offer with what it needs to suffice for a request; depth and lifespan never matter."""
    return replace(
        offered,
        reliability="reliable" if requested.reliability == "reliable" else offered.reliability,
        durability="transient_local" if requested.durability == "transient_local" else offered.durability,
        deadline_ns=_shorter(offered.deadline_ns, requested.deadline_ns),
        liveliness="manual_by_topic" if requested.liveliness == "manual_by_topic" else offered.liveliness,
        lease_ns=_shorter(offered.lease_ns, requested.lease_ns),
    )


def _shorter(offered_ns: int | None, requested_ns: int | None) -> int | None:
    limits = [limit for limit in (offered_ns, requested_ns) if limit]
    return min(limits, default=None)
