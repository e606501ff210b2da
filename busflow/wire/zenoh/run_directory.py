"""Run directory: the directory by which clients on this machine find a run; its permissions protect the run.

The directory of a run is `$XDG_RUNTIME_DIR/busflow/<run>/`. It is `/tmp/busflow-<uid>/<run>/` if that variable is not
set or the path is too long for a socket, and `$BUSFLOW_RUNTIME_DIR/<run>/` if this variable is set. The folder of all
runs belongs to this user, and no other user may open it. A run holds a lock on its directory until it ends; the kernel
releases the lock with the process, however that ends. The lock is held before the directory gets its name, so a
directory with a free lock remains from a dead run. A process that makes or removes a directory holds the folder's lock
meanwhile.

Zenoh tells each session that it links to where its own sockets are, nodes of ROS 2 included, which would link there as
this user. So the processes of a run name their sockets through an open file (`inside`) that no other process has.
Imports nothing heavy.
"""

from __future__ import annotations

import json
import os
import re
import stat
from collections import Counter
from collections.abc import Generator, Iterable, Mapping
from contextlib import closing, contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from busflow.errors import InspectionUnavailable, NoSuchRun
from busflow.runner.own_process import call_in_children
from busflow.text import did_you_mean, printable
from busflow.wire.zenoh.keys import DOMAIN
from busflow.wire.zenoh.run_lock import ENDED, LOCK, RunLock, locked
from busflow.wire.zenoh.session import SOCKET, open_session, require_unix_sockets

if TYPE_CHECKING:
    import zenoh

AT = "@"
"""Separates identity and launch file in the name of a run on other machines; no local run's name contains it."""
_CARD = "run.json"
_FOLDER_LOCK = ".lock"
_DRAFT = ".new"
_CARD_BYTES = 65_536
_PATH_BYTES = 100
"""Length of the longest socket path that every kernel accepts, with room for Zenoh's lock file beside the socket."""
_NAME_BYTES = 40
_LEAST_NAME_BYTES = 8
_ATTEMPTS = 100
_UNFIT = re.compile(r"[^A-Za-z0-9_.-]|^\.")
_LATEST_NS = 1 << 62


@dataclass(frozen=True, slots=True)
class RunCard:
    """Description of a run, stored in its directory for clients."""

    name: str
    pid: int
    since_ns: int
    """Wall time of its start, nanoseconds since 1970."""
    file: str = ""
    """Absolute path of the launch file; empty if there is none."""
    version: str = ""
    packages: Mapping[str, str] = field(default_factory=dict[str, str], hash=False)
    """The folders of `packages:` of the launch file on this machine, by name."""
    ros2_domain: int | None = None
    """The domain of the nodes of ROS 2 that take part; None if none can."""
    ros2_addresses: tuple[str, ...] = ()
    """Where its processes wait for nodes of ROS 2, and for the processes of later runs in the domain."""
    main_process: str = ""
    """The name of its main process on this machine, in the keys of answers."""

    @property
    def domain(self) -> int:
        """The domain in the keys of the run's topics and tokens."""
        return DOMAIN if self.ros2_domain is None else self.ros2_domain


@dataclass(frozen=True, slots=True)
class FoundRun:
    """A live run on this machine."""

    directory: Path
    card: RunCard
    is_double: bool = field(default=False, compare=False)
    """True if a run in another folder has a directory of the same name."""

    @property
    def name(self) -> str:
        """The name for `--run`, unique on this machine: the directory's name, or its path if two have the same name."""
        return str(self.directory) if self.is_double else self.directory.name

    def open(self, patience_s: float) -> zenoh.Session:
        """Join the run.

        Raises:
            InspectionUnavailable: it does not answer.
        """
        return open_session(self.directory, patience_s=patience_s)

    def is_alive(self, _session: zenoh.Session) -> bool:
        """Return whether the run still exists, for a client that has joined it by this session."""
        return self in runs()

    def lock(self) -> RunLock:
        """Return the lock that the run holds, opened; the caller closes it."""
        return RunLock(self.directory)

    def require(self, _what: str) -> None:
        """Allow everything: any process that can open the directory has all rights."""

    def answered(self, _answers: Iterable[Mapping[str, object]]) -> Self:
        """Return the run itself: the directory already describes it, so the answers to `run` add nothing."""
        return self


class RunDirectory:
    """The directory of a run that is about to start here; `close` removes it."""

    def __init__(self, path: Path, lock: int) -> None:
        self.path = path
        self._lock = lock
        self.descriptor: int = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        """The directory, open; the processes of the run inherit it."""
        # A child that a node forks inherits the lock. It must release it, or a dead run would look alive.
        call_in_children(self._release)

    @classmethod
    def claim(cls, name: str, environment: Mapping[str, str] = os.environ) -> Self:
        """Create a directory of this name, or `name-2` and so on if others have it; remains of dead runs are removed.

        Raises:
            InspectionUnavailable: there is no folder that only this user can open.
        """
        folder = _writable_folder(environment)
        fit = (_UNFIT.sub("_", name) or "run")[: _room(folder)]
        with _folder_locked(folder):
            draft = folder / _DRAFT
            _remove(draft)
            draft.mkdir(mode=0o700)
            lock = os.open(draft / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
            locked(lock, exclusive=True, wait=True)  # wait for processes that check whether it is held
            for number in range(1, _ATTEMPTS):
                path = folder / (fit if number == 1 else f"{fit}-{number}")
                if _is_free(path):
                    draft.rename(path)
                    return cls(path, lock)
            os.close(lock)
            _remove(draft)
        raise InspectionUnavailable(f"{_ATTEMPTS - 1} runs are called {printable(name)}; see busflow ps")

    @property
    def inside(self) -> Path:
        """A path that leads to the directory in the processes of the run alone; `path` where the system has none."""
        inside = Path(f"/proc/self/fd/{self.descriptor}")
        return inside if inside.exists() else self.path

    def write_card(self, card: RunCard) -> None:
        """Write the card, which makes the run visible to clients."""
        draft = self.path / f"{_CARD}.new"
        draft.write_text(json.dumps(asdict(card)), encoding="utf-8")
        draft.replace(self.path / _CARD)

    @contextmanager
    def ending(self) -> Generator[None]:
        """Hide the run from clients, and remove its directory after the block, in which its session closes.

        A client whose question comes too late to be answered then sees that the run has ended.
        """
        with suppress(OSError):  # a full disk must not keep the run from ending
            os.write(self._lock, ENDED)
        try:
            yield
        finally:
            gone = self.path.with_name(f".{self.path.name}.{os.getpid()}")
            with suppress(OSError):  # another program removed it while the run lasted, which is no fault of the run
                self.path.rename(gone)
            _remove(gone)
            self._release()

    def close(self) -> None:
        """Remove the directory, atomically for clients."""
        with self.ending():
            pass

    def _release(self) -> None:
        for opened in (self._lock, self.descriptor):
            if opened >= 0:
                os.close(opened)
        self._lock = self.descriptor = -1


def runs(environment: Mapping[str, str] = os.environ) -> list[FoundRun]:
    """Return this user's live runs on this machine, the oldest first; remains of dead runs are removed.

    Raises:
        InspectionUnavailable: no run was found, and one of the folders belongs to another user, or others can open it;
            or this platform has no Unix sockets.
    """
    found: list[FoundRun] = []
    unsafe: list[InspectionUnavailable] = []
    for folder in _folders(environment, search=True):
        try:
            if os.path.lexists(folder):
                found += _alive_runs(_checked_folder(folder))
        except InspectionUnavailable as error:  # a foreign folder in /tmp must not hide runs in other folders
            unsafe.append(error)
    if unsafe and not found:
        raise unsafe[0]
    times = Counter(run.directory.name for run in found)
    found = [replace(run, is_double=times[run.directory.name] > 1) for run in found]
    return sorted(found, key=lambda run: run.card.since_ns)


@dataclass(frozen=True, slots=True)
class Folder:
    """A folder that may contain runs of this user."""

    path: Path
    exists: bool
    fault: str = ""
    """Why it cannot be used; empty if it can."""
    remains: tuple[str, ...] = ()
    """Names of the directories of dead runs in it; the next search for runs removes them."""


def folders(environment: Mapping[str, str] = os.environ) -> list[Folder]:
    """Return the folders in which busflow searches for runs, in its order; remove nothing.

    Raises:
        InspectionUnavailable: this platform has no Unix sockets.
    """
    found: list[Folder] = []
    for path in _folders(environment, search=True):
        exists, fault, inside = os.path.lexists(path), "", list[Path]()
        try:
            inside = _directories(_checked_folder(path)) if exists else []
        except (InspectionUnavailable, OSError) as error:
            fault = str(error)
        found.append(Folder(path, exists, fault, tuple(each.name for each in inside if not _is_alive(each))))
    return found


def find_run(name: str | None = None, environment: Mapping[str, str] = os.environ) -> FoundRun:
    """Return the run of a name, or the only run.

    Raises:
        NoSuchRun: there is no run, or none of that name; or there are several, and no name; or several of that name.
    """
    found = runs(environment)
    if not found:
        raise NoSuchRun("nothing is running; start a graph in another terminal: busflow run FILE")
    if name is None:
        if len(found) == 1:
            return found[0]
        raise NoSuchRun(
            f"{len(found)} graphs are running; say which: --run {' | '.join(printable(run.name) for run in found)}\n"
            "  busflow ps shows each with its folder and PID; kill PID ends one as Ctrl-C does"
        )
    for run in found:
        if name in {run.name, str(run.directory)}:
            return run
    alike = [run for run in found if run.directory.name == name]
    if alike:
        which = " | ".join(f"{printable(run.name)} (process {run.card.pid})" for run in alike)
        raise NoSuchRun(
            f"{len(alike)} runs in several folders are called {printable(name)!r}; say which: --run {which}"
        )
    raise NoSuchRun(f"there is no run {printable(name)!r}; {did_you_mean(name, [run.name for run in found])}")


def _folders(environment: Mapping[str, str], *, search: bool = False) -> list[Path]:
    """Return the folders for runs, the preferred one first; with `search`, also those of other login sessions.

    Raises:
        InspectionUnavailable: this platform has no Unix sockets.
    """
    require_unix_sockets()
    user = os.geteuid()
    stated = environment.get("BUSFLOW_RUNTIME_DIR")
    if stated:
        return [Path(stated).absolute()]
    runtime = environment.get("XDG_RUNTIME_DIR", "")
    sessions = [runtime] if runtime.startswith("/") else []
    if search and f"/run/user/{user}" not in sessions:  # cron and ssh find the runs of a desktop session there
        sessions.append(f"/run/user/{user}")
    shared = Path(f"/tmp/busflow-{user}")  # noqa: S108  # `_checked_folder` checks its owner and permissions
    return [*(folder for each in sessions if not _unfit(folder := Path(each, "busflow"))), shared]


def _room(folder: Path) -> int:
    """Return how many bytes a run's name in a folder may have, so that the path of its socket is valid."""
    return min(_NAME_BYTES, _PATH_BYTES - len(os.fsencode(f"{folder}/-{_ATTEMPTS}/{SOCKET}")))


def _unfit(folder: Path) -> str | None:
    """Return why a folder cannot contain sockets; None if it can."""
    # Zenoh reads what follows these signs as settings of the socket.
    if set("?#") & set(str(folder)):
        return "a socket's path cannot contain ? or #"
    if _room(folder) < _LEAST_NAME_BYTES:
        return f"the path of a socket there would be longer than {_PATH_BYTES} bytes"
    return None


def _writable_folder(environment: Mapping[str, str]) -> Path:
    reason = ""
    for folder in _folders(environment):
        unfit = _unfit(folder)
        if unfit is not None:
            raise InspectionUnavailable(f"{folder}: {unfit}; set BUSFLOW_RUNTIME_DIR to another one")
        try:
            folder.mkdir(mode=0o700, exist_ok=True)
        except OSError as error:  # the session is another user's, or its folder is gone
            if not folder.is_symlink():
                reason = f"{folder}: {error.strerror}"
                continue
        if os.access(_checked_folder(folder), os.W_OK | os.X_OK):
            return folder
        reason = f"{folder}: it cannot be written to"
    raise InspectionUnavailable(f"there is no folder for the run's socket; {reason}")


def _checked_folder(folder: Path) -> Path:
    """Return the folder after checking that no other user can write to it."""
    status = folder.lstat()
    fault = None
    if not stat.S_ISDIR(status.st_mode):
        fault = "is a symbolic link" if stat.S_ISLNK(status.st_mode) else "is no directory"
    elif status.st_uid != os.geteuid():
        fault = "belongs to another user"
    elif stat.S_IMODE(status.st_mode) & 0o077:
        fault = f"can be opened by others (mode {stat.S_IMODE(status.st_mode):04o}); chmod 700 it"
    if fault is not None:
        raise InspectionUnavailable(f"{folder} {fault}: busflow uses it only if it is safe; remove it or repair it")
    return folder


@contextmanager
def _folder_locked(folder: Path, *, wait: bool = True) -> Generator[bool]:
    """Hold the folder's lock, and yield whether it was acquired; every process holds it only for a moment."""
    lock = os.open(folder / _FOLDER_LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    try:
        yield locked(lock, exclusive=True, wait=wait)
    finally:
        os.close(lock)


def _is_free(path: Path) -> bool:
    """Return whether no run has this directory, and remove that of a dead run. The caller holds the folder's lock."""
    if path.is_symlink() or (path.exists() and not path.is_dir()) or _is_alive(path):
        return False
    _remove(path)
    return True


def _remove(path: Path) -> None:
    import shutil

    shutil.rmtree(path, ignore_errors=True)


def _directories(folder: Path) -> list[Path]:
    return sorted(path for path in folder.iterdir() if path.is_dir() and not path.is_symlink())


def _alive_runs(folder: Path) -> list[FoundRun]:
    directories = _directories(folder)
    living = [path for path in directories if _is_alive(path, unless_ending=True)]
    if len(living) < len(directories):
        # An error may leave a dead run's directory there; the result leaves it out all the same.
        with suppress(OSError), _folder_locked(folder, wait=False) as is_locked:
            for path in directories:
                if is_locked and not _is_alive(path):
                    _remove(path)
    return [FoundRun(path, card) for path in living if not path.name.startswith(".") and (card := _card(path))]


def _is_alive(path: Path, *, unless_ending: bool = False) -> bool:
    """Return whether a run holds the directory's lock; with `unless_ending` also that it has not begun to close."""
    with closing(RunLock(path)) as lock:
        return lock.is_held and not (unless_ending and lock.has_ended)


def _card(path: Path) -> RunCard | None:
    """Read a run's card; None if it is not written yet or not valid."""
    try:
        with (path / _CARD).open("rb") as file:
            found: Any = json.loads(file.read(_CARD_BYTES))
        words = {field: found.get(field, "") for field in ("name", "file", "version", "main_process")}
        numbers = {field: found[field] for field in ("pid", "since_ns")}
        packages = {str(name): str(folder) for name, folder in found.get("packages", {}).items()}
        addresses = tuple(str(address) for address in found.get("ros2_addresses", ()))
        if found.get("ros2_domain") is not None:
            numbers["ros2_domain"] = found["ros2_domain"]
    except (OSError, ValueError, TypeError, AttributeError, LookupError, RecursionError):
        return None
    fits = all(type(word) is str for word in words.values())
    fits = fits and all(type(number) is int and 0 <= number < _LATEST_NS for number in numbers.values())
    return RunCard(**words, **numbers, packages=packages, ros2_addresses=addresses) if fits else None
