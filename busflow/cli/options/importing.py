"""Importing: what a command imports is not looked through for garbage."""

from __future__ import annotations

import gc
from collections.abc import Generator
from contextlib import contextmanager

from busflow.runner.garbage import is_frozen


@contextmanager
def importing() -> Generator[None]:
    """Keeps Python's collector away while modules are imported: nothing of them is garbage, and looking took 60 ms.

    Who has turned the collector off, or frozen anything, has a policy, which stays.
    """
    if not gc.isenabled() or is_frozen():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.unfreeze()  # what is there counts as old from now on, or else the next step would look at all of it
        gc.enable()
