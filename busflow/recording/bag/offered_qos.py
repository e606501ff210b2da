"""Offered QoS: what a recording says of the publishers of a topic, in the form in which rosbag2 writes it.

A list of profiles as YAML, their policies as words or, in older bags, as the numbers of `rmw/types.h`; a duration of
centuries means no limit. A reader of ROS 2 refuses an incomplete profile, so all of it is written.
Source: ros2/rosbag2, `rosbag2_storage/src/rosbag2_storage/qos.cpp`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, cast

import yaml

from busflow.bus.qos import Durability, Liveliness, QoS, Reliability
from busflow.clock import NS_PER_S
from busflow.errors import BagError

_LONGEST_TEXT = 1 << 16
_FOREVER_S = 1 << 31
_FOREVER_NS = (1 << 63) - 1
_MOST_DEPTH = 1 << 20
_KEPT_ALL = 1000
"""The depth that stands for all: no queue is unbounded here."""
_NUMBERS: Mapping[str, tuple[str, ...]] = {
    "history": ("system_default", "keep_last", "keep_all", "unknown"),
    "reliability": ("system_default", "reliable", "best_effort", "unknown", "best_available"),
    "durability": ("system_default", "transient_local", "volatile", "unknown", "best_available"),
    "liveliness": ("system_default", "automatic", "", "manual_by_topic", "unknown", "best_available"),
}
_DECIDED = {"reliability": Reliability, "durability": Durability, "liveliness": Liveliness}


def offered(text: str | None) -> QoS | None:
    r"""Return one profile that offers what all the recorded publishers of a topic offered; None where nothing is said.

    >>> offered("- reliability: 2\n  durability: 2\n  history: 1\n  depth: 5\n").reliability.value
    'best_effort'

    Raises:
        BagError: The text is no such list.
    """
    found = _profiles(text)
    return _all(found) if found else None


def kept_depths(text: str | None) -> list[int]:
    """Return how many messages each publisher keeps for late joiners: of each `transient_local` one its depth."""
    try:
        return [each.depth for each in _profiles(text) if each.durability is Durability.TRANSIENT_LOCAL]
    except BagError:  # no reader could use it either
        return []


def _profiles(text: str | None) -> list[QoS]:
    try:
        profiles = yaml.safe_load((text or "")[:_LONGEST_TEXT])
        return [_profile(each) for each in profiles or ()]
    except (yaml.YAMLError, AttributeError, TypeError, ValueError, KeyError, OverflowError, RecursionError) as error:
        raise BagError(f"the offered QoS of a topic is not what ROS 2 writes: {type(error).__name__}") from None


def _all(profiles: list[QoS]) -> QoS:
    """Return the most that each of these profiles offers; it keeps as many messages as the deepest of them."""
    best_effort = any(each.reliability is Reliability.BEST_EFFORT for each in profiles)
    volatile = any(each.durability is not Durability.TRANSIENT_LOCAL for each in profiles)
    manual = all(each.liveliness is Liveliness.MANUAL_BY_TOPIC for each in profiles)
    first = profiles[0]
    alike = all(each.deadline_s == first.deadline_s and each.lease_s == first.lease_s for each in profiles)
    return QoS(
        depth=max(each.depth for each in profiles),
        reliability=Reliability.BEST_EFFORT if best_effort else Reliability.RELIABLE,
        durability=Durability.VOLATILE if volatile else Durability.TRANSIENT_LOCAL,
        liveliness=Liveliness.MANUAL_BY_TOPIC if manual else Liveliness.AUTOMATIC,
        deadline_s=first.deadline_s if alike else None,
        lease_s=first.lease_s if alike else None,
        lifespan_s=_longest([each.lifespan_s for each in profiles]),
    )


def _longest(limits_s: list[float | None]) -> float | None:
    stated = [each for each in limits_s if each is not None]
    return max(stated) if len(stated) == len(limits_s) else None


def _profile(stated: Mapping[str, Any]) -> QoS:
    words: dict[str, Any] = {}
    for name, policy in _DECIDED.items():
        word = _word(name, stated.get(name))
        if word in {each.value for each in policy} - {"system_default", "unknown", "best_available"}:
            words[name] = word
    for name, theirs in {"deadline": "deadline", "lifespan": "lifespan", "lease": "liveliness_lease_duration"}.items():
        limit_s = _seconds(stated.get(theirs))
        if limit_s is not None:
            words[name] = limit_s
    keeps_all = _word("history", stated.get("history")) == "keep_all"
    depth = _KEPT_ALL if keeps_all else int(stated.get("depth") or 10)
    return QoS.model_validate({"depth": min(max(1, depth), _MOST_DEPTH), **words})


def _word(policy: str, stated: Any) -> str:
    """Return a policy's word, which older bags write as its number."""
    if isinstance(stated, int):
        numbers = _NUMBERS[policy]
        return numbers[stated] if 0 <= stated < len(numbers) else "unknown"
    return str(stated)


def _seconds(stated: Any) -> float | None:
    if not isinstance(stated, Mapping):
        return None
    parts = cast("Mapping[str, Any]", stated)
    seconds = int(parts["sec"]) + int(parts["nsec"]) / 1e9
    return seconds if 0 < seconds < _FOREVER_S - 1 else None


def offered_qos_profiles(offered: Iterable[QoS]) -> str:
    """Return a list with the profile of each publisher.

    >>> print(offered_qos_profiles([QoS(depth=5, reliability="best_effort", deadline_s=0.5)]))
    - history: keep_last
      depth: 5
      reliability: best_effort
      durability: volatile
      deadline:
        sec: 0
        nsec: 500000000
      lifespan:
        sec: 9223372036
        nsec: 854775807
      liveliness: automatic
      liveliness_lease_duration:
        sec: 9223372036
        nsec: 854775807
      avoid_ros_namespace_conventions: false
    """
    return "\n".join(map(_written, offered))


def _written(qos: QoS) -> str:
    lines = (
        "history: keep_last",
        f"depth: {qos.depth}",
        f"reliability: {qos.reliability.value}",
        f"durability: {qos.durability.value}",
        *_duration("deadline", qos.deadline_s),
        *_duration("lifespan", qos.lifespan_s),
        f"liveliness: {qos.liveliness.value}",
        *_duration("liveliness_lease_duration", qos.lease_s),
        "avoid_ros_namespace_conventions: false",
    )
    return "- " + "\n  ".join(lines)


def _duration(word: str, limit_s: float | None) -> tuple[str, str, str]:
    seconds, nanoseconds = divmod(_FOREVER_NS if limit_s is None else round(limit_s * NS_PER_S), NS_PER_S)
    return f"{word}:", f"  sec: {seconds}", f"  nsec: {nanoseconds}"
