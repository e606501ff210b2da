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


@dataclass(frozen=True, slots=True)
class PublisherMatched(Event):
    """Subscriptions of a topic that this node publishes came or left; those that were there first are told of, too."""

    total: int
    """How many there ever were while this node published."""
    total_change: int
    current: int
    """How many there are."""
    current_change: int


@dataclass(frozen=True, slots=True)
class SubscriptionMatched(Event):
    """Publishers of a topic that this node receives came or left; those that were there first are told of, too."""

    total: int
    """How many there ever were while this node received."""
    total_change: int
    current: int
    """How many there are."""
    current_change: int


@dataclass(frozen=True, slots=True)
class MessageLost(Event):
    """Messages for this node were lost: its queue was full, or they did not arrive.

    Not told of are those that it did not want any more: expired ones, and those that a newer one has superseded.
    """

    total: int
    """How many were lost by now."""
    total_change: int
    """How many of them since it was last told."""
