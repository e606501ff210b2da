"""SynchronizedGroup: takes messages that belong together from the queues of their topics to one handler."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from inspect import iscoroutinefunction
from typing import Any

from busflow.bus.expiry import message_of
from busflow.bus.failure import is_failure, refuse_coroutine
from busflow.clock import NS_PER_S
from busflow.interfaces.message import Message
from busflow.pairing.matching import Alone, Match, Matcher
from busflow.pairing.members import SUPERSEDED, Member, stamp_ns


class SynchronizedGroup:
    """The members of one `@synchronized` of a node, and its handler."""

    def __init__(self, handler: Callable[..., Any], origin: str) -> None:
        self.members: list[Member] = []
        self._handler, self._origin = handler, origin
        self._arrived: asyncio.Event | None = asyncio.Event() if iscoroutinefunction(handler) else None

    def take(self) -> tuple[Message, ...] | None:
        """Take the next messages that belong together; drop what is in front of them."""
        raise NotImplementedError

    def remark(self, member: Member, nearest_s: float | None) -> str:
        """Say why a message of a member found no partner."""
        raise NotImplementedError

    # Handing over.

    def serve(self, limit: int) -> int:
        """Hand over up to `limit` groups of messages, and return how many."""
        handled = 0
        while handled < limit and self.members[0].is_receiving and (messages := self.take()) is not None:
            handled += 1
            try:
                refuse_coroutine(self._handler(*messages), self._origin)
            except BaseException as error:  # noqa: BLE001  # a handler may raise anything; its node fails
                self.members[0].fail(error, messages[0])
        return handled

    def wake_task(self) -> bool:
        """Wake the task of an `async` handler; return False where there is none."""
        if self._arrived is None:
            return False
        self._arrived.set()
        return True

    def pump(self, member: Member) -> Coroutine[Any, Any, None] | None:
        """Return the task of an `async` handler, for the first member."""
        return self._pump(self._arrived) if self._arrived is not None and member is self.members[0] else None

    async def _pump(self, arrived: asyncio.Event) -> None:
        while True:
            for member in self.members:  # now that nothing is left to take, the next message wakes this task
                member.set_idle()
            await arrived.wait()
            arrived.clear()
            while (messages := self.take()) is not None:
                try:
                    await self._handler(*messages)
                except BaseException as error:
                    if not is_failure(error):
                        raise
                    self.members[0].fail(error, messages[0])
                    return
                await asyncio.sleep(0)  # a flood must not keep timers waiting


class StampGroup(SynchronizedGroup):
    """A group of messages whose stamps lie within a time of each other; each message is used once."""

    def __init__(self, handler: Callable[..., Any], origin: str, topics: int, within_ns: int) -> None:
        super().__init__(handler, origin)
        self._matcher = Matcher(topics, within_ns)
        self._within_ns = within_ns

    def take(self) -> tuple[Message, ...] | None:
        """Take the next messages that belong together; drop what is in front of them as unpaired."""
        while True:
            stamps = [member.stamps() for member in self.members]
            match self._matcher.decide(stamps):
                case Match():
                    for topic, waiting in enumerate(stamps):
                        self._matcher.leave(topic, waiting[:1])
                    return tuple(member.pop() for member in self.members)
                case Alone(topic, count, apart_ns):
                    self._matcher.leave(topic, stamps[topic][:count])
                    for _ in range(count):
                        self.members[topic].drop(apart_ns / NS_PER_S)
                case None:
                    return None

    def remark(self, member: Member, nearest_s: float | None) -> str:
        """Say why a message of a member found no partner."""
        others = " and ".join(each.topic for each in self.members if each is not member)
        if nearest_s is None:
            return f"its queue was full before {others} had a message within {self._within_ns / 1e6:g} ms"
        return f"{member.topic} and {others} are {nearest_s * 1e3:g} ms apart, within is {self._within_ns / 1e6:g} ms"


class HoldGroup(SynchronizedGroup):
    """A group of one topic that triggers, and of the newest messages of others."""

    def __init__(self, handler: Callable[..., Any], origin: str) -> None:
        super().__init__(handler, origin)
        self._newest: dict[Member, Message] = {}

    def take(self) -> tuple[Message, ...] | None:
        """Take the next trigger, with the newest of the others that is not younger."""
        trigger, *others = self.members
        for latest in trigger.stamps():
            for member in others:
                self._hold(member, latest)
            if len(self._newest) == len(others):
                return (trigger.pop(), *(self._newest[member] for member in others))
            trigger.drop(None)
        return None

    def _hold(self, member: Member, latest: int) -> None:
        member.discard_expired()
        while member.items and stamp_ns(message_of(member.items[0])) <= latest:
            if len(member.items) > 1 and stamp_ns(message_of(member.items[1])) <= latest:
                member.queue.discard(SUPERSEDED)
            else:
                self._newest[member] = member.pop()

    def remark(self, member: Member, nearest_s: float | None) -> str:  # noqa: ARG002  # as in SynchronizedGroup
        """Say why a trigger was dropped."""
        missing = " and ".join(each.topic for each in self.members[1:] if each not in self._newest)
        return f"{missing} had no message yet" if missing else "its queue was full"
