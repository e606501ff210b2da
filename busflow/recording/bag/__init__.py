"""Bags to read: MCAP files and ROS 2's bags, with what is known of their completeness. Writes nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from busflow.recording.bag.bag import Bag

__all__ = ["Bag"]


def __getattr__(name: str) -> object:
    """Import the public name when it is first used: the rest of the package is imported without it."""
    if name != "Bag":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from busflow.recording.bag.bag import Bag

    return Bag
