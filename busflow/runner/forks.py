"""Forks: what an object of this process does in a process forked from it. Imported by every command, so it is light."""

from __future__ import annotations

import os
import weakref
from collections.abc import Callable


def call_in_children(method: Callable[[], None]) -> None:
    """Call a bound method in each process that is forked while its object is there, which this does not keep alive."""
    reference = weakref.WeakMethod(method)
    if hasattr(os, "register_at_fork"):  # Windows forks nothing
        os.register_at_fork(after_in_child=lambda: (found := reference()) and found())
