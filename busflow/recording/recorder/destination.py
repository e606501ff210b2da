"""`Destination`: the file of a recording: its name, and the checks that it is new and still there."""

from __future__ import annotations

import errno
import os
import re
import shlex
from collections.abc import Generator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from busflow.clock import NS_PER_S, SystemClock
from busflow.errors import RecordingRefused
from busflow.text import printable

_PLACEHOLDER = re.compile(r"\{([^{}]*)\}")
_UNFIT = re.compile(r"[^\w.+-]+")
_SUFFIX = ".mcap"


class Destination:
    """A new file, written from beginning to end, as long as it can be found under its name."""

    def __init__(self, path: Path) -> None:
        """Make the file.

        Raises:
            RecordingRefused: it is there already, or cannot be made.
        """
        self.path = path
        _check_name(path)
        try:
            self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_CLOEXEC", 0), 0o666)
        except OSError as error:
            raise refusal(path, error) from None
        self._inode = _inode(os.fstat(self._descriptor))
        self._size = 0

    def write(self, data: memoryview) -> int:
        """Write to the end.

        Raises:
            OSError: the disk is full or broken, or what is written could not be found afterwards.
        """
        self._check_size()
        written = os.write(self._descriptor, data)
        self._size += written
        try:
            found = _inode(self.path.stat())
        except OSError:
            found = None
        if found != self._inode:
            raise OSError(errno.ENOENT, "it was moved or deleted while it was written")
        return written

    def cut_off(self, size: int) -> int:
        """Cut off what was written in part; return the bytes that are left."""
        with suppress(OSError):  # a reader copes with what is left
            size = min(size, os.fstat(self._descriptor).st_size)
            os.ftruncate(self._descriptor, size)
        return size

    def secure(self) -> None:
        """Make sure that what was written survives a loss of power.

        Raises:
            OSError: the disk is broken, or what was written is not there any more.
        """
        self._check_size()
        os.fsync(self._descriptor)

    def _check_size(self) -> None:
        if os.fstat(self._descriptor).st_size < self._size:  # a write after it would leave a hole of zeros
            raise OSError(errno.EIO, "it was truncated while it was written")

    def close(self) -> None:
        """Write no more."""
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor >= 0:
            os.close(descriptor)


@contextmanager
def new_recording(path: Path) -> Generator[Destination]:
    """Yield a new file to begin a recording in; it is removed again if its beginning cannot be written.

    Raises:
        RecordingRefused: it is there already, or cannot be made, or not even its beginning can be written.
    """
    destination = Destination(path)
    try:
        yield destination
    except BaseException as error:
        destination.close()
        path.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise refusal(path, error) from None
        raise


@contextmanager
def new_directory(path: Path) -> Generator[Path]:
    """Yield a new directory for a recording of several files; it is removed again if the first cannot be begun.

    Raises:
        RecordingRefused: it is there already, or cannot be made.
    """
    try:
        path.mkdir()
    except OSError as error:
        raise refusal(path, error) from None
    try:
        yield path
    except BaseException:
        with suppress(OSError):  # it is not empty
            path.rmdir()
        raise


def numbered(path: Path, least: int) -> tuple[Path, int]:
    """Return the first free name of a snapshot, and its number: `run-001.mcap`, `run-002.mcap`; such names sort."""
    for number in count(least):
        found = path.with_stem(f"{path.stem}-{number:03}")
        if not os.path.lexists(found) and not os.path.lexists(as_directory(found)):
            return found, number
    raise AssertionError("numbers do not end")


def named(pattern: str, *, run: str) -> Path:
    """Return the path that a pattern stands for: `{name}` is the run's name, `{start}` the time, in UTC.

    >>> named("runs/{name}.mcap", run="lab 1").as_posix()
    'runs/lab_1.mcap'

    Raises:
        RecordingRefused: it has another placeholder.
    """

    def fill(found: re.Match[str]) -> str:
        match found[1]:
            case "name":
                return _UNFIT.sub("_", run)
            case "start":
                return _start()
            case _:
                known = "{name} for the run's name, {start} for the time"
                raise RecordingRefused(f"{printable(pattern)}: {printable(found[0])} stands for nothing; write {known}")

    return Path(_PLACEHOLDER.sub(fill, pattern))


def refusal(path: Path, error: OSError) -> RecordingRefused:
    """Return an error about a destination that cannot be recorded to, with what to do."""
    shown = printable(path)
    match error:
        case FileExistsError():
            dated = printable(path.with_stem(f"{path.stem}-{{start}}"))
            text = f"{shown} is there already, and a recording overwrites nothing: move it away, choose another name,"
            return RecordingRefused(f"{text} or let the time be part of it: {dated}")
        case FileNotFoundError():
            # Quoted, so that a shell reads `~/runs` as the folder that was looked for, not as one in the home folder.
            folder = printable(shlex.quote(str(path.parent)))
            return RecordingRefused(f"cannot record to {shown}: make its folder first: mkdir -p {folder}")
        case _:
            return RecordingRefused(f"cannot record to {shown}: {error.strerror}")


def foresee(pattern: str, *, run: str, apart: bool) -> None:
    """Check whether a recording could begin now where a pattern says, without beginning it.

    Args:
        pattern: as `named` takes it.
        run: the run's name.
        apart: it has several files, of parts or of processes, in a directory.

    Raises:
        RecordingRefused: it cannot.
    """
    path = named(pattern, run=run)
    if apart:
        path = as_directory(path)
    else:
        _check_name(path)
    if os.path.lexists(path):
        raise refusal(path, OSError(errno.EEXIST, os.strerror(errno.EEXIST)))
    _check_folder(path)


def foresee_snapshots(pattern: str, *, run: str) -> Path:
    """Check whether snapshots could be written where a pattern says; return their path without their numbers.

    Raises:
        RecordingRefused: they cannot.
    """
    path = named(pattern, run=run)
    _check_name(path)
    _check_folder(path)
    return path


def _check_folder(path: Path) -> None:
    """Refuse a path in which nothing can be made.

    Raises:
        RecordingRefused: with the reason.
    """
    number = 0
    if not path.parent.exists():
        number = errno.ENOENT
    elif not path.parent.is_dir():
        number = errno.ENOTDIR
    elif not os.access(path.parent, os.W_OK | os.X_OK):
        number = errno.EACCES
    if number:
        raise refusal(path, OSError(number, os.strerror(number)))


def as_directory(path: Path) -> Path:
    """Return the directory that a recording of several files is, whose name needs no suffix."""
    return path.with_suffix("") if path.suffix == _SUFFIX else path


def _check_name(path: Path) -> None:
    shown = printable(path)
    if not path.name:
        raise RecordingRefused("a recording needs the name of a file: run.mcap")
    if path.suffix != _SUFFIX:
        raise RecordingRefused(f"a recording is an MCAP file: write {shown}{_SUFFIX} instead of {shown}")


def _start() -> str:
    """Return the time of day, also for a simulation, whose runs all begin at the same time of their own."""
    import datetime as dt

    now = dt.datetime.fromtimestamp(SystemClock().now().nanoseconds // NS_PER_S, dt.UTC)
    return now.strftime("%Y%m%dT%H%M%SZ")


def _inode(found: os.stat_result) -> tuple[int, int]:
    return found.st_dev, found.st_ino
