"""A bag played into a graph. Compares nothing."""

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
