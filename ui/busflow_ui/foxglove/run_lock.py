"""RunLock: whether a run on this machine died without an end of its own, as by `kill -9` or for want of memory."""

from __future__ import annotations

import os
from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

_LOCK = "run.lock"


class RunLock:
    """Lock that a run holds while it lives, and lets go only after it has taken its directory away, if it ends itself.

    A run without a directory, as one on other machines, has no lock here: nothing is known of its death.
    """

    def __init__(self, directory: Path | None) -> None:
        self._directory, self._file, self._inode = directory, -1, 0
        if directory is not None:
            with suppress(OSError):
                self._file = os.open(directory / _LOCK, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
                self._inode = os.fstat(self._file).st_ino

    @property
    def is_held(self) -> bool:
        """Whether a process holds the lock; False where nothing is known of it."""
        return self._file >= 0 and not self._is_free()

    @property
    def is_abandoned(self) -> bool:
        """Whether no process holds the lock, and the directory is still there. The next search for runs removes it."""
        return self._is_free() and self._is_in_place()

    def close(self) -> None:
        """Let go of the file."""
        if self._file >= 0:
            os.close(self._file)
        self._file = -1

    def _is_free(self) -> bool:
        if self._file < 0:
            return False
        import fcntl  # which Windows has not, nor directories of runs

        try:
            fcntl.flock(self._file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError:
            return False
        fcntl.flock(self._file, fcntl.LOCK_UN)
        return True

    def _is_in_place(self) -> bool:
        try:
            return self._directory is not None and (self._directory / _LOCK).stat().st_ino == self._inode
        except OSError:
            return False
