"""`owner_of`: the process that listens at a TCP port of this machine, as Linux lists it."""

from __future__ import annotations

import pwd
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from busflow.text import printable

_LISTENING = "0A"
"""The state of a listening socket in the kernel's lists."""


def owner_of(port: int) -> str:
    """Return words for the process that listens at a port: its name and PID, or whose it is; empty if neither is known.

    Another user's processes do not say which sockets they have.
    """
    listeners = dict(_listeners(port))
    for inode in listeners:
        for process, name in _processes_with(inode):
            return f"the process {process} ({printable(name)})"
    for user in listeners.values():
        with suppress(KeyError):
            return f"the process of the user {printable(pwd.getpwuid(user).pw_name)}"
    return ""


def _listeners(port: int) -> Iterator[tuple[int, int]]:
    """Yield the inode of each socket that listens at a port, and its user."""
    for family in ("tcp", "tcp6"):
        with suppress(OSError, ValueError, IndexError):
            for line in Path("/proc/net", family).read_text("ascii").splitlines()[1:]:
                _, local, _, state, *_, user, _, inode = line.split()[:10]
                if state == _LISTENING and int(local.rpartition(":")[2], 16) == port:
                    yield int(inode), int(user)


def _processes_with(inode: int) -> Iterator[tuple[int, str]]:
    """Yield PID and name of each process that has a socket open."""
    for process in (each for each in Path("/proc").iterdir() if each.name.isdigit()):
        with suppress(OSError):  # it is another user's, or has ended
            if any(_leads_to(file, f"socket:[{inode}]") for file in Path(process, "fd").iterdir()):
                yield int(process.name), Path(process, "comm").read_text().strip()


def _leads_to(file: Path, target: str) -> bool:
    try:
        return str(file.readlink()) == target
    except OSError:  # closed meanwhile
        return False
