"""Compatibility: whether the QoS of a publisher and a subscription fit, and what to change if not.

A publisher offers, a subscription requests, and a pair is refused if less is offered than requested. This is the rule
of DDS. ROS 2 follows it on every middleware but Zenoh, which delivers regardless.

>>> found = compatibility(QoS(reliability=Reliability.BEST_EFFORT), QoS())
>>> found.verdict, found.reasons
(<Verdict.ERROR: 'ERROR'>, ('reliability: best_effort is offered, reliable is requested',))
>>> found.fix
'set reliability: best_effort on the subscription, or reliability: reliable on the publisher'
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from busflow.bus.qos import Durability, Liveliness, QoS, Reliability
from busflow.validation.durations import show_duration


class Verdict(StrEnum):
    """Verdict on a publisher and a subscription: do they fit?"""

    OK = "OK"
    WARNING = "WARNING"
    """The result depends on the actual value of a `system_default` or unknown policy."""
    ERROR = "ERROR"


@dataclass(frozen=True, slots=True)
class Compatibility:
    """Compatibility of two endpoints: every conflicting policy, the reasons, and the smallest change that helps."""

    verdict: Verdict
    policies: tuple[str, ...] = ()
    """In ROS 2's words: reliability, durability, deadline, liveliness, liveliness_lease_duration."""
    reasons: tuple[str, ...] = ()
    fix: str = ""
    requests: tuple[str, ...] = ()
    """The fields that the subscription would have to state, as in a launch file: `reliability: best_effort`."""
    offers: tuple[str, ...] = ()
    """The fields that the publisher would have to state instead."""


_WEAK_AND_STRONG: Mapping[str, tuple[str, str]] = {
    "reliability": (Reliability.BEST_EFFORT, Reliability.RELIABLE),
    "durability": (Durability.VOLATILE, Durability.TRANSIENT_LOCAL),
    "liveliness": (Liveliness.AUTOMATIC, Liveliness.MANUAL_BY_TOPIC),
}
_POLICIES = {
    "reliability": "reliability",
    "durability": "durability",
    "deadline_s": "deadline",
    "liveliness": "liveliness",
    "lease_s": "liveliness_lease_duration",
}
_UNCLEAR = ("system_default", "unknown")


def compatibility(offered: QoS, requested: QoS) -> Compatibility:
    """Compare the QoS that a publisher offers with the QoS that a subscription requests.

    Depth, overflow and lifespan never matter. Warnings are reported only if there is no error. An unlimited
    deadline or lease is the same as none.
    """
    pairs = [(name, getattr(offered, name), getattr(requested, name)) for name in _POLICIES]
    if clashes := [pair for pair in pairs if _clash(*pair)]:
        requests, offers = (tuple(_said(each[0], each[end]) for each in clashes) for end in (1, 2))
        fix = f"set {' and '.join(requests)} on the subscription, or {' and '.join(offers)} on the publisher"
        return Compatibility(Verdict.ERROR, *_explained(clashes), fix, requests, offers)
    if doubts := [pair for pair in pairs if _doubt(*pair)]:
        fix = f"state {' and '.join(name for name, *_ in doubts)} on both ends"
        return Compatibility(Verdict.WARNING, *_explained(doubts), fix)
    return Compatibility(Verdict.OK)


def _clash(name: str, offered: Any, requested: Any) -> bool:
    if name in _WEAK_AND_STRONG:
        return (offered, requested) == _WEAK_AND_STRONG[name]
    return requested is not None and (offered is None or requested < offered)


def _doubt(name: str, offered: Any, requested: Any) -> bool:
    """Return whether the two would conflict in the worst case of an unclear policy."""
    if name not in _WEAK_AND_STRONG or not {offered, requested} & {*_UNCLEAR}:
        return False
    weak, strong = _WEAK_AND_STRONG[name]
    return offered in (*_UNCLEAR, weak) and requested in (*_UNCLEAR, strong)


def _explained(pairs: Iterable[tuple[str, Any, Any]]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the policies' names, and a reason for each."""
    explained = [
        (_POLICIES[name], f"{_said(name, offered)} is offered, {_value(requested)} is requested")
        for name, offered, requested in pairs
    ]
    return tuple(name for name, _ in explained), tuple(reason for _, reason in explained)


def _said(name: str, value: str | float | None) -> str:
    """Return a field in the form of YAML."""
    return f"{name.removesuffix('_s')}: {_value(value)}"


def _value(value: str | float | None) -> str:
    if value is None:
        return "null"
    return str(value) if isinstance(value, str) else show_duration(value)
