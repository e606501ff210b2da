"""`@synchronized`: a handler for messages of several topics that belong together."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import FrameType, FunctionType
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar, cast

from busflow.bus.qos import QoS
from busflow.clock import NS_PER_S
from busflow.errors import InvalidDeclaration
from busflow.interfaces.message import Message
from busflow.node.declarations import ComposedDeclaration, checked_name, checked_type
from busflow.node.node import Node, runtime_of
from busflow.node.signatures import line_of, names_used, resolve
from busflow.pairing.group import HoldGroup, StampGroup, SynchronizedGroup
from busflow.pairing.members import SUPERSEDED, UNPAIRED, Member, MemberQueue, require_header
from busflow.text import printable
from busflow.validation.durations import parse_duration

P = ParamSpec("P")
R = TypeVar("R")

_EXAMPLE = '@synchronized("left/image", "right/image", within="20ms")'


class SynchronizedDeclaration(ComposedDeclaration[Callable[P, R]], Generic[P, R]):
    """A method with `@synchronized` above; on an instance it is the method."""

    def __init__(
        self,
        function: Callable[Concatenate[Any, P], R],
        topics: tuple[str, ...],
        within_ns: int | None,
        depth: int,
        *,
        triggers: int,
        above: SynchronizedDeclaration[..., Any] | None = None,
    ) -> None:
        code = getattr(function, "__code__", None)
        if code is None or code.co_argcount != len(topics) + 1:
            name, words = getattr(function, "__name__", "on_pair"), ", ".join(_argument(each) for each in topics)
            raise InvalidDeclaration(
                f"@synchronized calls {name} with one message of each topic: write def {name}(self, {words})"
            )
        self.function = function
        self.written: tuple[str, int] | None = line_of(function)
        self._topics, self._within_ns, self._depth, self._triggers = topics, within_ns, depth, triggers
        self._above = above
        self._surroundings: Mapping[str, Any] = {}

    def renewed(self, function: FunctionType) -> SynchronizedDeclaration[..., Any]:
        """Return the same group for the method of a subclass that overrides this one."""
        return SynchronizedDeclaration(
            function, self._topics, self._within_ns, self._depth, triggers=self._triggers, above=self
        )

    def remember(self, frame: FrameType) -> None:
        """Keep what the annotations name of the class's surroundings."""
        stated = " ".join(each for each in self._annotations() if isinstance(each, str))
        self._surroundings = names_used(stated, frame)

    def compose(self, node: Node) -> Callable[P, R]:
        """Subscribe the node to the topics of the group."""
        runtime, bound = runtime_of(node), self.function.__get__(node)  # type: ignore[attr-defined]  # a function in a class body
        group: SynchronizedGroup
        if self._within_ns is None:
            group = HoldGroup(bound, self.origin)
        else:
            group = StampGroup(bound, self.origin, len(self._topics), self._within_ns)
        layers = runtime.surroundings.subscription_qos
        for number, (topic, kind) in enumerate(zip(self._topics, self._types(), strict=True)):
            endpoint = runtime.endpoint(kind, topic, QoS(depth=self._depth), layers, self.origin, self.written)
            queue = MemberQueue(endpoint.qos.depth, UNPAIRED if number < self._triggers else SUPERSEDED)
            group.members.append(Member(kind, endpoint, group, queue))
        for member in group.members:
            runtime.endpoints.add(member)
        return bound

    def _annotations(self) -> list[Any]:
        names = self.function.__code__.co_varnames[1 : len(self._topics) + 1]  # type: ignore[attr-defined]  # as above
        return [getattr(self.function, "__annotations__", {}).get(name) for name in names]

    def _types(self) -> list[type[Message]]:
        """Return the types of messages that the annotations state.

        Raises:
            InvalidDeclaration: one is missing, is no message, or has no header with a stamp.
        """
        if self._above is not None and not any(self._annotations()):
            return self._above._types()  # noqa: SLF001  # of the same class
        found: list[type[Message]] = []
        for topic, stated in zip(self._topics, self._annotations(), strict=True):
            if stated is None:
                raise InvalidDeclaration(f"{self.origin} must annotate each message: {_argument(topic)}: Image")
            names = getattr(self.function, "__globals__", {})
            kind = resolve(stated, names, self._surroundings, self.origin) if isinstance(stated, str) else stated
            checked: Any = checked_type(kind, self.origin)
            require_header(checked, self.origin, topic)
            found.append(checked)
        return found


def synchronized(
    *topics: str, within: str | float | None = None, hold: str | tuple[str, ...] = (), depth: int = 10
) -> Callable[[Callable[Concatenate[Any, P], R]], SynchronizedDeclaration[P, R]]:
    """Handle messages of several topics that belong together, by the stamps of their headers.

    Write `@synchronized("left/image", "right/image", within="20ms")` above a method that takes one message of each
    topic, `def on_pair(self, left: Image, right: Image)`. Each message is used once; what finds no partner is a drop
    with the reason `unpaired`.

    Args:
        topics: The topics, in the order of the method's arguments.
        within: How far the stamps may be apart: `20ms`, or 0 for equal stamps.
        hold: Topics of which each message of the one topic gets the newest that is not younger.
        depth: How many messages of each topic wait for a partner.
    """
    held = (hold,) if isinstance(hold, str) else tuple(hold)
    names = tuple(checked_name(each, "@synchronized(…)", "topic") for each in (*topics, *held))
    if held and (within is not None or len(topics) != 1):
        example = '@synchronized("imu/data", hold="joint_states")'
        raise InvalidDeclaration(f"@synchronized with hold= has one topic and no within: write {example}")
    if not held and (within is None or len(topics) < 2):
        raise InvalidDeclaration(f"@synchronized needs two topics or more, and within: write {_EXAMPLE}")
    if isinstance(cast("object", depth), bool) or not isinstance(cast("object", depth), int) or depth < 1:
        raise InvalidDeclaration(f"@synchronized(…) keeps at least one message of each topic, not depth={depth!r}")
    within_ns = None if within is None else _nanoseconds(within)
    triggers = 1 if held else len(names)
    return lambda function: SynchronizedDeclaration(function, names, within_ns, depth, triggers=triggers)


def _nanoseconds(within: str | float) -> int:
    if within == 0:
        return 0
    try:
        return round(parse_duration(within) * NS_PER_S)
    except (ValueError, OverflowError) as error:
        raise InvalidDeclaration(f"@synchronized(…, within=…): {error}") from None


def _argument(topic: str) -> str:
    """Return a name for the message of a topic: `left` for `left/image`."""
    word = printable(topic).strip("/~").partition("/")[0]
    return word if word.isidentifier() else "message"
