"""A bag played into a graph, or into a run of another process. Compares nothing.

`playback_clock` is the time of a recording that is played: paused, faster, slower, set to another moment.
`ordered_messages` has the messages to play, in the file's order, within a span of time; `playing` hands them over by
that clock. Two use it: `player`, a node that publishes messages (a type without a class passes as bytes), and
`bag play --run`, which hands the bytes to a client of the run.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from busflow.recording.player.player import Player

__all__ = ["Player"]


def __getattr__(name: str) -> object:
    """Import the public name when it is first used: the rest of the package is imported without it."""
    if name != "Player":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from busflow.recording.player.player import Player

    return Player
