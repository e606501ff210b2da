"""RunLock: the lock on a run's directory, by which others see whether the run lives, and whether it ended by itself."""

from __future__ import annotations

import os
from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

LOCK = "run.lock"
"""Name of the locked file in the directory."""
ENDED = b"ended"
"""Content of the file once its run ends by itself."""


class RunLock:
    """Lock that a run holds while it lives; a run that ends by itself writes so into the file before it lets go.

    The file stays open here, so it says how the run ended also when the directory has been removed. A run without a
    directory on this machine has no lock here: nothing is known of its death.
    """

    def __init__(self, directory: Path | None) -> None:
        self._file = -1
        if directory is not None:
            with suppress(OSError):
                self._file = os.open(directory / LOCK, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)

    @property
    def is_held(self) -> bool:
        """Whether a process holds the lock; False where nothing is known of it."""
        return self._file >= 0 and not self._is_free()

    @property
    def has_ended(self) -> bool:
        """Whether the run has written that it ends by itself; it may still hold the lock, while it closes."""
        return self._file >= 0 and os.pread(self._file, len(ENDED), 0) == ENDED

    @property
    def is_abandoned(self) -> bool:
        """Whether no process holds the lock, and its run did not end by itself."""
        return self._is_free() and not self.has_ended

    def close(self) -> None:
        """Let go of the file."""
        if self._file >= 0:
            os.close(self._file)
        self._file = -1

    def _is_free(self) -> bool:
        if self._file < 0 or not locked(self._file, exclusive=False):
            return False
        import fcntl

        fcntl.flock(self._file, fcntl.LOCK_UN)
        return True


def locked(lock: int, *, exclusive: bool, wait: bool = False) -> bool:
    """Lock an open file for this process; False if another process has it locked."""
    import fcntl  # Windows has neither this module nor Unix sockets

    kind = fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH
    try:
        fcntl.flock(lock, kind if wait else kind | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
