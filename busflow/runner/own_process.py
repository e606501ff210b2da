"""This process: its forks, and its end. Imported by every command, so it is light."""

from __future__ import annotations

import gc
import os
import weakref
from collections.abc import Callable


def call_in_children(method: Callable[[], None]) -> None:
    """Call a bound method in each process that is forked while its object is there, which this does not keep alive."""
    reference = weakref.WeakMethod(method)
    if hasattr(os, "register_at_fork"):  # Windows forks nothing
        os.register_at_fork(after_in_child=lambda: (found := reference()) and found())


def leave(code: int) -> None:
    """End this process at once if a thread hangs, e.g. in a driver's `read`; else make its own end quick."""
    import threading

    if any(not thread.daemon for thread in threading.enumerate() if thread is not threading.main_thread()):
        os._exit(code)
    # The interpreter's three collections at exit took a tenth of a second.
    gc.collect()  # closes what a node has left open
    gc.freeze()
