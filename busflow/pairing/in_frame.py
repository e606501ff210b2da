"""`@subscription(topic, in_frame=…)`: messages that are handed over once the transform to a frame is there."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from inspect import iscoroutinefunction
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar

from busflow.bus.expiry import message_of
from busflow.bus.failure import is_failure, refuse_coroutine
from busflow.bus.qos import QoS, checked_qos
from busflow.clock import NS_PER_S, Clock, Time
from busflow.errors import InvalidDeclaration, TransformError
from busflow.frames.declarations import Frames
from busflow.node.declarations import ComposedDeclaration, checked_name
from busflow.node.handlers import Handler, SubscriptionRole
from busflow.node.node import Node, runtime_of
from busflow.pairing.members import Member, MemberQueue, require_header, stamp_ns
from busflow.validation.durations import parse_duration

P = ParamSpec("P")
R = TypeVar("R")

_WAIT_S = 0.1
NO_TRANSFORM = "no_transform"
"""The reason of a drop for a message whose transform was not there in time."""


class _ArrivalQueue(MemberQueue):
    """A queue that knows when each of its messages arrived."""

    __slots__ = ("_clock", "arrivals")

    def __init__(self, depth: int, clock: Clock) -> None:
        super().__init__(depth, NO_TRANSFORM)
        self._clock = clock
        self.arrivals: deque[int] = deque()
        """Monotonic times in ns, one for each message."""

    def push(self, item: Any) -> None:
        """Add the message; without room, drop the oldest one."""
        super().push(item)
        self.arrivals.append(self._clock.monotonic_ns())
        while len(self.arrivals) > len(self.items):  # what left was the oldest, for whatever reason
            self.arrivals.popleft()

    @property
    def oldest_ns(self) -> int:
        """The time at which its oldest message arrived."""
        return self.arrivals[len(self.arrivals) - len(self.items)]


class FrameWaiter:
    """Takes the messages of one subscription to its handler, each once its transform is there."""

    def __init__(
        self,
        handler: Callable[[Any], Any],
        origin: str,
        frames: Frames,
        target: str,
        *,
        wait_ns: int,
        clock: Clock,
    ) -> None:
        self._handler, self._origin, self._clock = handler, origin, clock
        self._frames, self._target, self._wait_ns = frames, target, wait_ns
        self._arrived = asyncio.Event()
        self._reason = ""

    def serve(self, limit: int) -> int:  # noqa: ARG002  # as a group's; the task hands over
        """Hand over nothing in a turn of the dispatcher."""
        return 0

    def wake_task(self) -> bool:
        """Wake the task that hands over."""
        self._arrived.set()
        return True

    def remark(self, member: Member, nearest_s: float | None) -> str:  # noqa: ARG002  # as a group's
        """Say why the last message had no transform."""
        return self._reason

    async def pump(self, member: Member) -> None:
        """Wait for the transform of each message, and hand the message over, until the handler fails."""
        while True:
            member.set_idle()
            await self._arrived.wait()
            self._arrived.clear()
            while member.items:
                item = member.items[0]
                is_there = await self._is_there(message_of(item), member)
                if not member.items or member.items[0] is not item:  # the queue was full meanwhile, and let it go
                    continue
                if not is_there:
                    member.remark = self._reason
                    member.drop(None)
                elif not await self._hand_over(member):
                    return

    async def _is_there(self, message: Any, member: Member) -> bool:
        queue, stamp = member.queue, stamp_ns(message)
        arrived_ns = queue.oldest_ns if isinstance(queue, _ArrivalQueue) else 0
        left_s = max(0, arrived_ns + self._wait_ns - self._clock.monotonic_ns()) / NS_PER_S
        frame = message.header.frame_id
        try:
            await self._frames.lookup(self._target, frame, at=Time(stamp), timeout=left_s)
        except TransformError as error:
            self._reason = str(error)
            return False
        return True

    async def _hand_over(self, member: Member) -> bool:
        """Call the handler; return False, and fail the node, if it raises."""
        message = member.pop()
        try:
            result = self._handler(message)
            if iscoroutinefunction(self._handler):
                await result
            else:
                refuse_coroutine(result, self._origin)
                await asyncio.sleep(0)  # a flood must not keep timers waiting
        except BaseException as error:
            if not is_failure(error):
                raise
            member.fail(error, message)
            return False
        return True


class InFrameDeclaration(ComposedDeclaration[Callable[P, R]], Generic[P, R]):
    """A method with `@subscription(topic, in_frame=…)` above; on an instance it is the method."""

    def __init__(
        self,
        function: Callable[Concatenate[Any, P], R],
        topic: str,
        qos: QoS | None,
        target: str,
        wait_ns: int,
    ) -> None:
        if isinstance(function, ComposedDeclaration | Handler):
            raise InvalidDeclaration(
                "@subscription(…, in_frame=…) stands alone: give another topic a method of its own"
            )
        self._handler = Handler(function, (SubscriptionRole(topic, qos),))
        self.function = function
        self.written: tuple[str, int] | None = self._handler.written
        self._topic, self._qos, self._target, self._wait_ns = topic, qos, target, wait_ns

    def __set_name__(self, owner: type, name: str) -> None:
        """Learn which attribute of which class this is."""
        super().__set_name__(owner, name)
        self._handler.__set_name__(owner, name)

    def remember(self, frame: Any) -> None:
        """Keep what the annotation names of the class's surroundings."""
        self._handler.remember(frame)

    def compose(self, node: Node) -> Callable[P, R]:
        """Subscribe the node to the topic, and to those of frames."""
        runtime, bound = runtime_of(node), self.function.__get__(node)  # type: ignore[attr-defined]  # a function in a class body
        kind = self._handler.message_type()
        require_header(kind, self.origin, self._topic)
        known = (each for each in vars(node).values() if isinstance(each, Frames))
        frames = next(known, None) or Frames(runtime, self)
        around = runtime.surroundings
        waiter = FrameWaiter(bound, self.origin, frames, self._target, wait_ns=self._wait_ns, clock=around.clock)
        layers = around.subscription_qos
        endpoint = runtime.endpoint(kind, self._topic, self._qos, layers, self.origin, self.written)
        queue = _ArrivalQueue(endpoint.qos.depth, around.clock)
        runtime.endpoints.add(Member(kind, endpoint, waiter, queue))
        return bound


def subscription(
    topic: object, other: object, *, qos: QoS | None, in_frame: str | None = None, wait: str | float | None = None
) -> Callable[[Callable[Concatenate[Any, P], R]], InFrameDeclaration[P, R]]:
    """Return the decorator of `@subscription(topic, in_frame=…, wait=…)`."""
    if not isinstance(topic, str) or other is not None or in_frame is None:
        raise InvalidDeclaration('in_frame= and wait= are for a handler: write @subscription("scan", in_frame="map")')
    target = checked_name(in_frame, "@subscription(…, in_frame=…)", "frame")
    try:
        wait_ns = round(parse_duration(_WAIT_S if wait is None else wait) * NS_PER_S)
    except (ValueError, OverflowError) as error:
        raise InvalidDeclaration(f"@subscription(…, wait=…): {error}") from None
    checked = checked_qos(qos, "@subscription(…)")
    return lambda function: InFrameDeclaration(function, topic, checked, target, wait_ns)
