"""Link faults: delays and losses that a test injects into topics; the ledger counts each message."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Any, cast

from busflow.bus.bus import Bus, BusObserver
from busflow.bus.subscription import Subscription
from busflow.clock import NS_PER_S, Clock


@dataclass(slots=True)
class LinkFault:
    """Current delay and loss of a topic."""

    delay_ns: int = 0
    lose_every: int = 0
    """Interval of lost messages: 3 loses the third, the sixth, the ninth …, 0 loses none."""
    links: list[_FaultyLink] = field(default_factory=list["_FaultyLink"])


class Faults(BusObserver):
    """Injected faults of the topics of a bus, carried out by a link in each subscription of such a topic."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._faults: dict[str, LinkFault] = {}
        bus.observe(self)

    def delay(self, topic: str, seconds: float) -> None:
        """Delay messages that are published from now on."""
        if not 0 <= seconds < float("inf"):
            raise ValueError(f"a delay is a finite number of seconds, 0 or more, not {seconds!r}")
        self._fault(topic).delay_ns = round(seconds * NS_PER_S)

    def drop(self, topic: str, every: int) -> None:
        """Drop every n-th message that is published from now on."""
        if every < 1:
            raise ValueError(f"every is 1 for all messages, 2 for every second, not {every!r}")
        fault = self._fault(topic)
        fault.lose_every = every
        for link in fault.links:
            link.seen = 0

    def heal(self, topic: str) -> None:
        """Pass messages on at once again; those under way still arrive at their delayed time."""
        fault = self._fault(topic)
        fault.delay_ns = fault.lose_every = 0

    def _fault(self, topic: str) -> LinkFault:
        if topic not in self._faults:
            self._faults[topic] = LinkFault()
            for subscription in self._bus.topics[topic].subscriptions:
                self._interpose(cast("Subscription[Any]", subscription))
        return self._faults[topic]

    def subscription_added(self, subscription: Subscription[Any]) -> None:
        """Carry out a topic's fault for a new subscription too."""
        if subscription.topic in self._faults:
            self._interpose(subscription)

    def _interpose(self, subscription: Subscription[Any]) -> None:
        if subscription.link is None:
            fault = self._faults[subscription.topic]
            subscription.link = link = _FaultyLink(subscription, fault, self._bus.clock)
            fault.links.append(link)
            self._bus.topics[subscription.topic].rebuild()


class _FaultyLink:
    """Link of one subscription, which delays or loses its messages and keeps their order."""

    def __init__(self, target: Subscription[Any], fault: LinkFault, clock: Clock) -> None:
        self.target = target
        self.held = 0
        self.seen = 0
        """Number of messages since the test asked for losses."""
        self._fault = fault
        self._clock = clock
        self._under_way: deque[Any] = deque()
        self._last_due_ns = 0

    def carry(self, item: Any) -> None:
        """Drop the message, delay it, or pass it on."""
        if self._is_lost():
            self.target.queue.drops["injected"] += 1
        elif self._fault.delay_ns or self._under_way:
            self._under_way.append(item)
            self.held += 1
            self._last_due_ns = max(self._last_due_ns, self._clock.monotonic_ns() + self._fault.delay_ns)
            self._clock.call_at(self._last_due_ns, self._arrive)
        else:
            for arrive in self.target.arrivals:
                arrive(item)

    def _is_lost(self) -> bool:
        self.seen += 1
        return self._fault.lose_every > 0 and self.seen % self._fault.lose_every == 0

    def _arrive(self) -> None:
        self.held -= 1
        self.target.receive(self._under_way.popleft())
