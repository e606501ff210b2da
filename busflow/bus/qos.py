"""QoS: how messages of a topic are queued, kept and limited in time.

What delivery means
===================
Each subscription has one bounded queue, first in first out. `publish` never waits: for a full queue a message is
dropped as the subscription's `overflow` says, and counted there. In every line of the ledger, at every moment,
`published == delivered + dropped + queued`.

>>> import asyncio
>>> from busflow import Message, WouldBlock, launch
>>> class Number(Message, package="doc"):
...     data: int
>>> async def drop(overflow):
...     async with launch() as graph:
...         subscription = graph.subscribe(Number, "numbers", qos=QoS(depth=2, overflow=overflow))
...         for data in range(5):
...             graph.publish("numbers", Number(data=data))
...         line = subscription.statistics()
...         first = (await anext(subscription)).data
...         return first, (line.published, line.delivered, line.dropped, line.queued)
>>> asyncio.run(drop(Overflow.DROP_OLDEST))
(3, (5, 0, 3, 2))
>>> asyncio.run(drop(Overflow.DROP_NEWEST))
(0, (5, 0, 3, 2))

With `overflow: block` nothing is dropped: `publish` is refused while any such queue of the topic is full. Then no
subscription receives the message and nothing is counted. `await publisher.send(message)` waits for room instead, first
come first served, for at most the subscription's `block_timeout`.

>>> async def block():
...     async with launch() as graph:
...         careful = graph.subscribe(Number, "numbers", qos=QoS(depth=1, overflow=Overflow.BLOCK))
...         other = graph.subscribe(Number, "numbers")
...         graph.publish("numbers", Number(data=1))
...         try:
...             graph.publish("numbers", Number(data=2))
...         except WouldBlock:
...             return careful.statistics().published, other.statistics().published
>>> asyncio.run(block())
(1, 1)

A late joiner of a `transient_local` topic receives what its publishers kept: the last `depth` messages of the
publisher or of the subscription, whichever is less. A `volatile` one receives what is published from then on.

>>> async def join_late():
...     latched = QoS.merge(TRANSIENT_LOCAL, QoS(depth=3))
...     async with launch() as graph:
...         publisher = graph.advertise(Number, "numbers", qos=latched)
...         for data in range(5):
...             publisher.publish(Number(data=data))
...         newcomer = graph.subscribe(Number, "numbers", qos=latched.model_copy(update={"depth": 2}))
...         return [(await anext(newcomer)).data for _ in range(2)], len(newcomer.queue)
>>> asyncio.run(join_late())
([3, 4], 0)

Messages older than their publisher's `lifespan` are dropped as `expired` instead of delivered. A silence beyond the
`deadline` is an event and a count on both ends; it runs from the first message. A `manual_by_topic` publisher that is
silent beyond its `lease` counts as not alive.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from enum import StrEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

from pydantic import AliasChoices, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, WithJsonSchema

from busflow.errors import Fault, InvalidDeclaration, InvalidParameter
from busflow.text import did_you_mean, printable
from busflow.validation.durations import PATTERN, parse_duration
from busflow.validation.faults import faults

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass as _InWords
else:

    class _InWords(type(BaseModel)):
        """The class of `QoS`: a call with wrong values ends in busflow's words, a file's values in `qos_faults`."""

        def __call__(cls, *unnamed: object, **stated: object) -> Any:
            if unnamed:
                raise InvalidDeclaration("QoS takes its fields by name: write QoS(depth=10)")
            try:
                return super().__call__(**stated)
            except ValidationError as error:
                found = [_remedied(each, cls.model_fields) for each in faults(error, cls, stated, noun="field")]
            raise InvalidDeclaration(f"QoS: {InvalidParameter(found)}")


class _Word(StrEnum):
    """A word of a profile, in upper or lower case."""

    @classmethod
    def _missing_(cls, value: object) -> Self | None:
        lower = value.lower() if isinstance(value, str) else None
        return next((member for member in cls if member.value == lower), None)


class _Policy(_Word):
    """A policy of ROS 2, including the values that only remote peers have."""

    @classmethod
    def read(cls, text: str | None) -> Self:
        """Return the policy for a peer's word; UNKNOWN if this version does not know it."""
        return cls(text) if text in cls.__members__.values() else cls("unknown")

    @classmethod
    def __offered__(cls) -> list[Self]:
        """Return the values a profile may state: not `unknown` nor `best_available`."""
        return [member for member in cls if member.value not in ("unknown", "best_available")]

    @property
    def word(self) -> str | None:
        """The word to send to a peer; None for UNKNOWN."""
        return None if self.value == "unknown" else self.value


class Overflow(_Word):
    """What happens to a message for a full queue."""

    DROP_OLDEST = "drop_oldest"
    DROP_NEWEST = "drop_newest"
    BLOCK = "block"
    """The publisher waits."""


class History(_Policy):
    """The history policy of ROS 2. busflow always keeps the last `depth`: no queue is unbounded."""

    SYSTEM_DEFAULT = "system_default"
    KEEP_LAST = "keep_last"
    KEEP_ALL = "keep_all"
    UNKNOWN = "unknown"


class Reliability(_Policy):
    """Rule for messages that a link between processes loses: if they are sent again."""

    SYSTEM_DEFAULT = "system_default"
    RELIABLE = "reliable"
    BEST_EFFORT = "best_effort"
    UNKNOWN = "unknown"
    BEST_AVAILABLE = "best_available"


class Durability(_Policy):
    """Rule for late joiners: if they receive messages that were published before they came."""

    SYSTEM_DEFAULT = "system_default"
    TRANSIENT_LOCAL = "transient_local"
    VOLATILE = "volatile"
    UNKNOWN = "unknown"
    BEST_AVAILABLE = "best_available"


class Liveliness(_Policy):
    """The sign of life of a publisher: its process, or every single message."""

    SYSTEM_DEFAULT = "system_default"
    AUTOMATIC = "automatic"
    MANUAL_BY_TOPIC = "manual_by_topic"
    UNKNOWN = "unknown"
    BEST_AVAILABLE = "best_available"


def _limit(value: object) -> float | None:
    """Parse a duration; null and infinity mean no limit."""
    return None if value is None or (seconds := parse_duration(value)) == math.inf else seconds


_DURATION_SCHEMA = [{"type": "number", "exclusiveMinimum": 0}, {"type": "string", "pattern": f"^{PATTERN}$"}]
_Seconds = Annotated[float, BeforeValidator(parse_duration), WithJsonSchema({"anyOf": _DURATION_SCHEMA})]
_Limit = Annotated[
    float | None, BeforeValidator(_limit), WithJsonSchema({"anyOf": [*_DURATION_SCHEMA, {"type": "null"}]})
]


def _said(default: object, description: str, key: str | None = None) -> Any:
    """Create a field with its JSON Schema description; `key` is its YAML name, without the unit."""
    alias = AliasChoices(key, f"{key}_s") if key else None
    return Field(default=default, description=description, validation_alias=alias)


class QoS(BaseModel, metaclass=_InWords):
    """A quality-of-service profile. Another layer can set the fields that are not stated: see `merge`.

    In YAML the durations are `deadline`, `lifespan`, `lease`, `block_timeout`: seconds, or text with a unit.

    >>> QoS.model_validate({"depth": 5, "deadline": "50ms"}).deadline_s
    0.05
    >>> QoS(depth=0)
    Traceback (most recent call last):
    busflow.errors.InvalidDeclaration: QoS: depth must be at least 1, got 0 (allowed: at least 1)
    """

    model_config: ClassVar[ConfigDict] = ConfigDict(frozen=True, extra="forbid")

    depth: Annotated[int, Field(ge=1, strict=True)] = _said(
        10, "How many messages may wait for a subscription, and how many a transient_local topic keeps."
    )
    overflow: Overflow = _said(Overflow.DROP_OLDEST, "What happens to a message for a full queue.")
    block_timeout_s: _Seconds = _said(5.0, "How long `send` waits for room, where overflow is block.", "block_timeout")
    reliability: Reliability = _said(Reliability.RELIABLE, "Whether what a link between processes loses is sent again.")
    durability: Durability = _said(
        Durability.VOLATILE, "Whether a late joiner receives what was published before it came."
    )
    deadline_s: _Limit = _said(None, "The longest time between two messages.", "deadline")
    lifespan_s: _Limit = _said(None, "The age at which a message expires.", "lifespan")
    liveliness: Liveliness = _said(
        Liveliness.AUTOMATIC, "Who says that a publisher is alive: its process, or every single message."
    )
    lease_s: _Limit = _said(None, "How long a publisher that says nothing counts as alive.", "lease")

    @property
    def history(self) -> History:
        """Always `keep_last`."""
        return History.KEEP_LAST

    @property
    def latched(self) -> bool:
        """Whether late joiners receive what was published before: of this publisher, or as this subscription.

        `best_available` is decided for each pair: such a publisher keeps messages for all that want them, and such a
        subscription takes what each publisher keeps.
        """
        return self.durability in (Durability.TRANSIENT_LOCAL, Durability.BEST_AVAILABLE)

    @classmethod
    def merge(cls, *layers: QoS) -> QoS:
        """Merge several layers into one profile: a field stated in a later layer wins.

        A field stated as `system_default` becomes busflow's own default.

        >>> merged = QoS.merge(QoS(depth=5, deadline_s=1), SENSOR_DATA, QoS(depth=2))
        >>> merged.depth, merged.reliability.value, merged.deadline_s
        (2, 'best_effort', 1.0)
        """
        if len(layers) < 2:  # the usual case: endpoints declared alike share one profile
            only = layers[0] if layers else _NOTHING_STATED
            if "system_default" not in only.__dict__.values():
                return only
        stated: dict[str, object] = {}
        for layer in layers:
            stated |= {name: getattr(layer, name) for name in layer.model_fields_set}
        for name, value in stated.items():
            if value == "system_default":
                stated[name] = cls.model_fields[name].default
        return cls.model_validate(stated)


_NOTHING_STATED = QoS()


def checked_qos(qos: Any, origin: str) -> QoS | None:
    """Return the QoS or None; the error for a bare depth, as in rclpy, shows how to write it.

    Raises:
        InvalidDeclaration: it is anything else.
    """
    if qos is None or isinstance(qos, QoS):
        return qos
    depth = qos if type(qos) is int and qos > 0 else 10
    got = printable(repr(qos), limit=200)
    raise InvalidDeclaration(f"{origin}: qos must be a QoS: write qos=QoS(depth={depth}), not {got}")


def qos_faults(data: Mapping[str, object]) -> tuple[Fault, ...]:
    """Return all faults of a profile in a file: the path of each key, the reason, and a fix.

    >>> for fault in qos_faults({"depht": 5, "deadline": -1}):
    ...     print(fault.path, fault.message, "→", fault.fix)
    ('deadline',) deadline: a duration is at least 1 ns and at most 292 years, got -1 → None
    ('depht',) unknown key depht → did you mean 'depth'?
    """
    try:
        profile = QoS.model_validate(data)
    except ValidationError as error:
        words = [name.removesuffix("_s") for name in QoS.model_fields]
        return tuple(_remedied(fault, words) for fault in faults(error, QoS, data, noun="key"))
    unknown = [name for name, value in profile if value == "unknown"]
    return tuple(Fault((name,), f"{name}: unknown is only for what others say", "leave it out") for name in unknown)


def _remedied(fault: Fault, words: Collection[str]) -> Fault:
    """Return the fault with a fix for an unknown name; `words` are those that are known."""
    if fault.code != "unknown":
        return fault
    key = str(fault.path[-1])
    fix = did_you_mean(key, words)
    if key == "history":
        fix = "leave it out: the last `depth` messages are kept; instead of keep_all, choose overflow: block"
    elif key.removesuffix("_s") in words:
        fix = f"{key.removesuffix('_s')} says the same; leave one of them out"
    return replace(fault, fix=fix)


def _preset(depth: int, reliability: Reliability, durability: Durability = Durability.VOLATILE) -> QoS:
    """Create a profile of ROS 2: it states every field except the time limits."""
    system = Liveliness.SYSTEM_DEFAULT
    return QoS(depth=depth, reliability=reliability, durability=durability, liveliness=system)


DEFAULT = _preset(10, Reliability.RELIABLE)
SENSOR_DATA = _preset(5, Reliability.BEST_EFFORT)
SERVICES_DEFAULT = _preset(10, Reliability.RELIABLE)
PARAMETERS = _preset(1000, Reliability.RELIABLE)
PARAMETER_EVENTS = _preset(1000, Reliability.RELIABLE)
ACTION_STATUS_DEFAULT = _preset(1, Reliability.RELIABLE, Durability.TRANSIENT_LOCAL)
TRANSIENT_LOCAL = _preset(1, Reliability.RELIABLE, Durability.TRANSIENT_LOCAL)
SYSTEM_DEFAULT = _preset(10, Reliability.SYSTEM_DEFAULT, Durability.SYSTEM_DEFAULT)
BEST_AVAILABLE = QoS(
    depth=10,
    reliability=Reliability.BEST_AVAILABLE,
    durability=Durability.BEST_AVAILABLE,
    liveliness=Liveliness.BEST_AVAILABLE,
)
PRESETS: Mapping[str, QoS] = MappingProxyType(
    {
        "default": DEFAULT,
        "sensor_data": SENSOR_DATA,
        "services_default": SERVICES_DEFAULT,
        "parameters": PARAMETERS,
        "parameter_events": PARAMETER_EVENTS,
        "action_status_default": ACTION_STATUS_DEFAULT,
        "transient_local": TRANSIENT_LOCAL,
        "system_default": SYSTEM_DEFAULT,
        "best_available": BEST_AVAILABLE,
    }
)
"""The built-in profiles, by the names of `ros2 topic echo --qos-profile`; `transient_local` is of busflow alone."""
