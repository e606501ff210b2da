"""QoS text: the short form of a QoS in the liveliness tokens of `rmw_zenoh`; an empty field has its default value.

    reliability:durability:history,depth:deadline_s,deadline_ns:lifespan_s,lifespan_ns:liveliness,lease_s,lease_ns

Source: ros2/rmw_zenoh, `liveliness_utils.cpp`; the numbers are those of `rmw/types.h`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from busflow.clock import NS_PER_S
from busflow.errors import MalformedMessage

if TYPE_CHECKING:
    from busflow.bus.qos import QoS

_LONGEST_NS = 2**63 - 1
"""ROS 2's infinite duration, `RMW_DURATION_INFINITE`, which is the longest that it has."""
_INFINITE = divmod(_LONGEST_NS, NS_PER_S)
_RELIABILITIES = {0: "system_default", 1: "reliable", 2: "best_effort", 3: "unknown", 4: "best_available"}
_DURABILITIES = {0: "system_default", 1: "transient_local", 2: "volatile", 3: "unknown", 4: "best_available"}
_HISTORIES = {0: "system_default", 1: "keep_last", 2: "keep_all", 3: "unknown"}
_LIVELINESSES = {0: "system_default", 1: "automatic", 3: "manual_by_topic", 4: "unknown", 5: "best_available"}
_DEFAULT_DEPTH = 42
_MOST = {"reliability": "reliable", "durability": "transient_local", "liveliness": "manual_by_topic"}
"""What suffices for every request."""
_LEAST = {"reliability": "best_effort", "durability": "volatile", "liveliness": "automatic"}
"""What every offer suffices for."""


@dataclass(frozen=True, slots=True)
class WireQoS:
    """The QoS of an endpoint as its token states it, in ROS 2's words."""

    reliability: str = "reliable"
    durability: str = "volatile"
    history: str = "keep_last"
    depth: int = _DEFAULT_DEPTH
    deadline_ns: int | None = None
    """Limit in nanoseconds; None means no limit, here and in the two limits below."""
    lifespan_ns: int | None = None
    liveliness: str = "automatic"
    lease_ns: int | None = None

    @property
    def latched(self) -> bool:
        """True if late joiners receive earlier messages, as with `QoS.latched`."""
        return self.durability in ("transient_local", "best_available")


def to_text(qos: QoS, *, is_request: bool = False) -> str:
    """Return the short form of what a publisher with this profile offers, or a subscription requests.

    `best_available` is written as what fits every counterpart: most versions of `rmw_zenoh` ignore an endpoint whose
    token has its number.

    >>> from busflow.bus.qos import QoS
    >>> to_text(QoS(depth=7, durability="transient_local", deadline_s=0.5))
    ':1:,7:0,500000000:,:,,'
    """
    limits = (qos.deadline_s, qos.lifespan_s, qos.lease_s)
    deadline_ns, lifespan_ns, lease_ns = (None if limit is None else round(limit * NS_PER_S) for limit in limits)
    stated = {name: getattr(qos, name).value for name in _MOST}
    words = {name: (_LEAST if is_request else _MOST)[name] for name, word in stated.items() if word == "best_available"}
    return written(
        WireQoS(depth=qos.depth, deadline_ns=deadline_ns, lifespan_ns=lifespan_ns, lease_ns=lease_ns, **stated | words)
    )


def written(stated: WireQoS) -> str:
    """Return the short form of a token's QoS; its history is always `keep_last`."""
    reliability = _number(_RELIABILITIES, stated.reliability, "reliable")
    durability = _number(_DURABILITIES, stated.durability, "volatile")
    liveliness = _number(_LIVELINESSES, stated.liveliness, "automatic")
    depth = "" if stated.depth == _DEFAULT_DEPTH else str(stated.depth)
    limits = [_written(limit) for limit in (stated.deadline_ns, stated.lifespan_ns, stated.lease_ns)]
    return f"{reliability}:{durability}:,{depth}:{limits[0]}:{limits[1]}:{liveliness},{limits[2]}"


def from_text(text: str) -> WireQoS:
    """Parse the short form.

    >>> from_text(":1:,7:0,500000000:,:,,").deadline_ns
    500000000

    Raises:
        MalformedMessage: the text is not in the short form.
    """
    try:
        reliability, durability, history, deadline, lifespan, liveliness = text.split(":")
        policy, depth = history.split(",")
        alive, lease = liveliness.split(",", 1)
        return WireQoS(
            reliability=_RELIABILITIES[int(reliability or 1)],
            durability=_DURABILITIES[int(durability or 2)],
            history=_HISTORIES[int(policy or 1)],
            depth=int(depth or _DEFAULT_DEPTH),
            deadline_ns=_read(deadline),
            lifespan_ns=_read(lifespan),
            liveliness=_LIVELINESSES[int(alive or 1)],
            lease_ns=_read(lease),
        )
    except (ValueError, KeyError):
        raise MalformedMessage(f"{text[:200]!r} is no QoS in the form of ROS 2's tokens") from None


def as_qos(stated: WireQoS, *, most_depth: int = 1 << 31) -> QoS:
    """Convert a token's QoS into a profile, with a depth of at most `most_depth`; every parsed QoS can be converted."""
    from busflow.bus.qos import QoS  # a client that only shows tokens does not pay for pydantic

    limits = {"deadline": stated.deadline_ns, "lifespan": stated.lifespan_ns, "lease": stated.lease_ns}
    words: dict[str, object] = {word: limit / NS_PER_S for word, limit in limits.items() if limit}
    words |= {"reliability": stated.reliability, "durability": stated.durability, "liveliness": stated.liveliness}
    return QoS.model_validate({"depth": min(max(1, stated.depth), most_depth), **words})


def _number(numbers: dict[int, str], word: str, default: str) -> str:
    return "" if word == default else next(str(number) for number, each in numbers.items() if each == word)


def _written(limit_ns: int | None) -> str:
    """Return both parts of a limit, each left out if it is that of the infinite duration, as ROS 2 does."""
    parts = divmod(_LONGEST_NS if limit_ns is None else limit_ns, NS_PER_S)
    return ",".join("" if part == infinite else str(part) for part, infinite in zip(parts, _INFINITE, strict=True))


def _read(text: str) -> int | None:
    whole, rest = (int(part or infinite) for part, infinite in zip(text.split(","), _INFINITE, strict=True))
    if min(whole, rest) < 0 or (limit := whole * NS_PER_S + rest) > _LONGEST_NS:
        raise ValueError(f"a limit from 0 to {_LONGEST_NS} ns")
    return None if limit == _LONGEST_NS else limit
