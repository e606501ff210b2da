"""The end of a process of busflow: it waits for no thread that hangs, and for no collection of garbage."""

from __future__ import annotations

import gc
import os


def leave(code: int) -> None:
    """End this process at once if a thread hangs, e.g. in a driver's `read`; else make its own end quick."""
    import threading

    if any(not thread.daemon for thread in threading.enumerate() if thread is not threading.main_thread()):
        os._exit(code)
    # The interpreter's three collections at exit took a tenth of a second.
    gc.collect()  # closes what a node has left open
    gc.freeze()
