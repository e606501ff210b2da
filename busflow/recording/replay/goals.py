"""SentGoals: the identifiers of the goals that replayed nodes send, now and in the recording.

On virtual time a client draws the same ones again. On the system's time it draws them at random: there its nth goal
stands for its nth recorded one, and what is recorded of the one is passed to the node as of the other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

_PLACE = slice(4, 20)
"""The place of the identifier in each message that begins with one: behind the four bytes that state the encoding."""


class SentGoals:
    """The goals that replayed nodes send, each with its two identifiers."""

    def __init__(self, recorded: Mapping[tuple[str, str], Sequence[bytes]]) -> None:
        """Store the recorded identifiers in their order, by service and caller."""
        self._recorded = recorded
        self._then: dict[bytes, bytes] = {}
        self._now: dict[bytes, bytes] = {}

    def send(self, service: str, caller: str, number: int, identifier: bytes) -> None:
        """Note that a caller sends a goal; `number` counts its goals from 0."""
        recorded = self._recorded.get((service, caller), ())
        if number < len(recorded):
            self._then[identifier] = recorded[number]
            self._now[recorded[number]] = identifier

    def as_recorded(self, payload: bytes) -> bytes:
        """Return a message of the replay with the recorded identifier of its goal."""
        return _renamed(payload, self._then)

    def as_now(self, payload: bytes) -> bytes:
        """Return a recorded message with the identifier that its goal has in the replay."""
        return _renamed(payload, self._now)


def _renamed(payload: bytes, names: Mapping[bytes, bytes]) -> bytes:
    """Return a message with another identifier; as it is where its goal is not known."""
    name = names.get(payload[_PLACE])
    return payload if name is None else payload[: _PLACE.start] + name + payload[_PLACE.stop :]
