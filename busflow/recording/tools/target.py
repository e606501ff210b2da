"""Target: a file or directory made from a recording; it gets its name once it is complete, or else is removed."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

from busflow.errors import BagError

_NO_LINKS = {errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS}


@contextmanager
def new_file(target: Path) -> Generator[Path]:
    """Yield a path at which to write a file.

    Raises:
        BagError: There is something of this name, or it cannot be written.
    """
    with _part_of(target, lambda part: part.touch(exist_ok=False), lambda part: part.unlink(missing_ok=True)) as part:
        yield part
        _link(part, target)


@contextmanager
def new_directory(target: Path) -> Generator[Path]:
    """Yield a directory in which to write files.

    Raises:
        BagError: There is something of this name, or it cannot be written.
    """
    with _part_of(target, Path.mkdir, lambda part: shutil.rmtree(part, ignore_errors=True)) as part:
        yield part
        part.rename(target)


@contextmanager
def _part_of(target: Path, make: Callable[[Path], None], remove: Callable[[Path], None]) -> Generator[Path]:
    if target.exists() or target.is_symlink():
        raise BagError("it exists already", file=str(target), fix="name another one, or take it away")
    part = target.with_name(f".{target.name}.part")
    try:
        try:
            make(part)
        except FileExistsError:
            fix = f"if no other process does any more, take {part} away"
            raise BagError("another process writes it", file=str(target), fix=fix) from None
        try:
            yield part
        finally:
            remove(part)
    except FileExistsError:
        raise BagError("another process has made it meanwhile", file=str(target)) from None
    except OSError as error:
        raise BagError(f"it cannot be written: {error.strerror or error}", file=str(target)) from None


def _link(part: Path, target: Path) -> None:
    """Give a file its name, unless another program has taken it, which renaming would not notice."""
    try:
        os.link(part, target)
    except OSError as error:
        if error.errno not in _NO_LINKS:
            raise
        if target.exists():  # a USB stick has no links, and hardly ever two programs that write the same file
            raise FileExistsError from None
        part.rename(target)
