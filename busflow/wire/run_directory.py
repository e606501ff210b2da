"""The run directory: where on this machine a run can be found, and by whom.

A run owns `$XDG_RUNTIME_DIR/busflow/<run>/`, or `/tmp/busflow-<uid>/<run>/` where there is no such place or its path is
too long for a socket. The directory is the guard: it is this user's and nobody else may open it. A lock that the run
holds says that it lives, since the kernel drops it with the process, however that ends. Imports nothing heavy.
"""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shutil
import stat
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Self

from busflow.errors import InspectionUnavailable, NoSuchRun
from busflow.text import did_you_mean, printable

SOCKET = "main.sock"
_LOCK = "run.lock"
_CARD = "run.json"
_CARD_BYTES = 65_536
_PATH_BYTES = 100
"""The longest path of a socket that every kernel takes, with room for the lock that Zenoh puts beside it."""
_NAME_BYTES = 40
_ATTEMPTS = 100
_UNFIT = re.compile(r"[^A-Za-z0-9_.-]|^\.")


@dataclass(frozen=True, slots=True)
class RunCard:
    """What a run says of itself to whoever finds its directory."""

    name: str
    pid: int
    since_ns: int
    """Wall time of its start, nanoseconds since 1970."""
    file: str = ""
    """The launch file, absolute; empty where there is none."""
    version: str = ""


@dataclass(frozen=True, slots=True)
class FoundRun:
    """A run that lives on this machine."""

    directory: Path
    card: RunCard

    @property
    def name(self) -> str:
        """What `--run` takes: the directory's name, which no other run has."""
        return self.directory.name


class RunDirectory:
    """The directory of a run that is about to live here; `close` removes it."""

    def __init__(self, path: Path, lock: int) -> None:
        self.path = path
        self._lock = lock

    @classmethod
    def claim(cls, name: str, environment: Mapping[str, str] = os.environ) -> Self:
        """Take a directory of this name, `name-2` and so on where other runs have it; remains of dead ones go.

        Raises:
            InspectionUnavailable: there is no place that only this user can open.
        """
        folder = _writable_folder(environment)
        fit = (_UNFIT.sub("_", name) or "run")[:_NAME_BYTES]
        for number in range(1, _ATTEMPTS):
            path = folder / (fit if number == 1 else f"{fit}-{number}")
            lock = _take(path)
            if lock is not None:
                _empty(path)
                return cls(path, lock)
        raise InspectionUnavailable(f"{_ATTEMPTS - 1} runs are called {printable(name)}; see busflow ps")

    def write_card(self, card: RunCard) -> None:
        """Let the run be found; whoever looked earlier saw nothing."""
        draft = self.path / f"{_CARD}.new"
        draft.write_text(json.dumps(asdict(card)), encoding="utf-8")
        draft.replace(self.path / _CARD)

    def close(self) -> None:
        """Remove the directory, the lock last."""
        shutil.rmtree(self.path, ignore_errors=True)
        os.close(self._lock)


def runs(environment: Mapping[str, str] = os.environ) -> list[FoundRun]:
    """The runs of this user that live on this machine, the oldest first; remains of dead ones are removed.

    Raises:
        InspectionUnavailable: a folder where runs would be belongs to somebody else, or others can open it.
    """
    found = [run for folder in _folders(environment) if folder.exists() for run in _living(_own(folder))]
    return sorted(found, key=lambda run: run.card.since_ns)


def find_run(name: str | None = None, environment: Mapping[str, str] = os.environ) -> FoundRun:
    """The run of a name, or the only one there is.

    Raises:
        NoSuchRun: there is none, none of that name, or several and no name.
    """
    found = runs(environment)
    if not found:
        raise NoSuchRun("nothing is running; start a graph in another terminal: busflow run FILE")
    if name is None:
        if len(found) == 1:
            return found[0]
        raise NoSuchRun(f"{len(found)} graphs are running; say which: --run {' | '.join(run.name for run in found)}")
    for run in found:
        if run.name == name:
            return run
    raise NoSuchRun(f"there is no run {printable(name)!r}; {did_you_mean(name, [run.name for run in found])}")


def _folders(environment: Mapping[str, str]) -> list[Path]:
    """The folders of runs, the preferred one first."""
    found: list[Path] = []
    runtime = environment.get("XDG_RUNTIME_DIR", "")
    longest = len(os.fsencode(f"{runtime}/busflow/{'x' * _NAME_BYTES}-99/{SOCKET}"))
    # Zenoh reads what follows these signs as settings of the socket.
    if runtime.startswith("/") and longest <= _PATH_BYTES and not set("?#") & set(runtime):
        found.append(Path(runtime, "busflow"))
    user = os.geteuid() if hasattr(os, "geteuid") else 0
    return [*found, Path(f"/tmp/busflow-{user}")]  # noqa: S108  # who owns it and may open it is checked


def _writable_folder(environment: Mapping[str, str]) -> Path:
    if importlib.util.find_spec("fcntl") is None:
        raise InspectionUnavailable("this platform has no sockets that only one user can open")
    reason = ""
    for folder in _folders(environment):
        try:
            folder.mkdir(mode=0o700, exist_ok=True)
        except OSError as error:  # a runtime directory of somebody else's session, or none any more
            if not folder.is_symlink():
                reason = f"{folder}: {error.strerror}"
                continue
        return _own(folder)
    raise InspectionUnavailable(f"there is no folder for the run's socket; {reason}")


def _own(folder: Path) -> Path:
    """The folder, once it is certain that nobody else can put anything there."""
    status = folder.lstat()
    fault = None
    if not stat.S_ISDIR(status.st_mode):
        fault = "is a symbolic link" if stat.S_ISLNK(status.st_mode) else "is no directory"
    elif status.st_uid != os.geteuid():
        fault = "belongs to another user"
    elif stat.S_IMODE(status.st_mode) & 0o077:
        fault = f"can be opened by others (mode {stat.S_IMODE(status.st_mode):04o}); chmod 700 it"
    if fault is not None:
        raise InspectionUnavailable(f"{folder} {fault}: busflow uses it only where it is safe; remove it or mend it")
    return folder


def _take(path: Path) -> int | None:
    """The lock of a directory, made where it is missing; None where a run holds it."""
    while True:
        with suppress(FileExistsError):
            path.mkdir(mode=0o700)
        try:
            lock = os.open(_own(path) / _LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
        except FileNotFoundError:
            continue  # somebody has just removed the remains
        if not _locked(lock):
            os.close(lock)
            return None
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(lock), (path / _LOCK).stat()):
                return lock
        os.close(lock)  # of a directory that is no longer there


def _empty(path: Path) -> None:
    for each in path.iterdir():
        if each.name != _LOCK:
            each.unlink()


def _living(folder: Path) -> Iterator[FoundRun]:
    for path in sorted(folder.iterdir()):
        if path.is_symlink() or not path.is_dir():
            continue
        if not _held(path):
            continue
        card = _card(path)
        if card is not None:
            yield FoundRun(path, card)


def _held(path: Path) -> bool:
    """Whether a run holds the directory's lock; where none does, what is left of it is removed."""
    try:
        lock = os.open(path / _LOCK, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
    except OSError:
        return False  # it is being made, or removed
    try:
        if not _locked(lock):
            return True
        shutil.rmtree(path, ignore_errors=True)
    finally:
        os.close(lock)
    return False


def _locked(lock: int) -> bool:
    """Lock an open file for this process, unless another one has it locked."""
    import fcntl  # which Windows has not, nor the sockets that all this is for

    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _card(path: Path) -> RunCard | None:
    """What the run says of itself; None while it has not yet said anything."""
    try:
        with (path / _CARD).open("rb") as file:
            return RunCard(**json.loads(file.read(_CARD_BYTES)))
    except (OSError, ValueError, TypeError):
        return None
