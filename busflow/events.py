"""Events: what can happen to an endpoint besides messages; a node hears of them with `@on_event(topic)`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Event:
    """Something happened to one end of a topic."""

    topic: str
    """The topic's final name."""


@dataclass(frozen=True, slots=True)
class DeadlineMissed(Event):
    """No message for longer than the `deadline`; told once per deadline for as long as the silence lasts.

    A publisher's node hears that it has not published, a subscription's node that nothing has arrived.
    """

    count: int
    """How often it has been missed by now."""


@dataclass(frozen=True, slots=True)
class LivelinessLost(Event):
    """A `manual_by_topic` publisher of this node has been silent for longer than its `lease`."""

    count: int
    """How often it has been lost by now."""


@dataclass(frozen=True, slots=True)
class LivelinessChanged(Event):
    """A publisher of a topic that this node receives came to life, fell silent beyond its `lease`, or left."""

    alive: int
    """How many publishers of the topic are alive."""
    not_alive: int
    """How many are there, but silent beyond their lease."""
