"""A node whose process takes a second to write to the disk, and gives a recording less."""

import os
import threading

from busflow import Node, timeouts

timeouts.current = timeouts.Timeouts(recording_end=0.05)
os.fsync = lambda _: threading.Event().wait(1.0)


class Tardy(Node):
    """Does nothing."""
