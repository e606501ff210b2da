"""Names that Windows or macOS lack, taken away in each process with this folder on its PYTHONPATH.

`PRETENDED_PLATFORM` is win32 or darwin. The standard library and other distributions have chosen their own code by
then: the tests look at busflow's.
"""

import errno
import importlib
import os
import platform
import resource
import select
import selectors
import signal
import socket
import sys
import sysconfig
from collections.abc import Callable
from types import ModuleType
from typing import Any

OTHERS = (
    "anyio._backends._asyncio click ctypes importlib.metadata mcap.reader mcap.writer multiprocessing numpy.random "
)
OTHERS += "pydantic.json_schema shutil subprocess tempfile yaml"
"""Modules of others that ask for the platform when they are imported."""
MISSING_MODULES = {"win32": "fcntl grp pty pwd readline resource syslog termios tty", "darwin": ""}
"""Modules of the standard library that are there on Linux and not on the platform."""
MISSING_NAMES: dict[str, dict[ModuleType, str]] = {
    "win32": {
        os: "eventfd fchmod fork geteuid getpgid getuid killpg mkfifo nice openpty register_at_fork sched_getaffinity "
        "set_blocking setpgid setsid sysconf waitid O_CLOEXEC O_DIRECTORY O_NOFOLLOW O_NONBLOCK WNOHANG",
        select: "epoll poll EPOLLIN POLLIN POLLOUT",
        selectors: "EpollSelector PollSelector",
        signal: "SIGALRM SIGCHLD SIGCONT SIGHUP SIGKILL SIGPIPE SIGQUIT SIGSTOP SIGTSTP SIGUSR1 SIGUSR2 SIGWINCH "
        "alarm pause pthread_kill pthread_sigmask setitimer sigwait",
        socket: "AF_UNIX SCM_RIGHTS recv_fds send_fds",
    },
    "darwin": {
        os: "O_DIRECT O_PATH O_TMPFILE copy_file_range eventfd fdatasync getrandom getresuid getxattr listxattr "
        "memfd_create pidfd_open pipe2 posix_fadvise posix_fallocate sched_getaffinity sched_setaffinity setns "
        "setresuid setxattr splice timerfd_create unshare",
        resource: "prlimit",
        select: "epoll EPOLLIN EPOLLOUT",
        selectors: "EpollSelector",
        signal: "SIGPWR SIGRTMAX SIGRTMIN SIGSTKFLT sigtimedwait sigwaitinfo",
        socket: "AF_NETLINK AF_PACKET AF_VSOCK SOCK_CLOEXEC SOCK_NONBLOCK SO_PEERCRED",
    },
}
"""Names of such modules, some of which only newer versions of Python have."""
MACHINES = {"win32": "AMD64", "darwin": "arm64"}
"""The processor of each platform."""
OPEN_FILES = 256
"""The open files that a shell of macOS allows each process."""


def become(name: str) -> None:
    """Take away what a platform lacks, and have `sys.platform` name it."""
    hide(name)
    platform.machine = lambda: MACHINES[name]
    if name == "darwin":
        resource.setrlimit(resource.RLIMIT_NOFILE, (OPEN_FILES, OPEN_FILES))
        hide_proc()
    sys.platform = name


def hide_proc() -> None:
    """Have nothing below /proc, which only Linux has."""

    def look_for(path: object) -> None:
        if str(path).startswith("/proc/"):
            raise FileNotFoundError(errno.ENOENT, "hidden", path)

    def checked(call: Callable[..., Any]) -> Callable[..., Any]:
        def look(path: object = ".", *arguments: Any, **words: Any) -> Any:
            look_for(path)
            return call(path, *arguments, **words)

        return look

    for each in ("listdir", "lstat", "readlink", "scandir", "stat"):
        setattr(os, each, checked(getattr(os, each)))
    sys.addaudithook(lambda event, arguments: look_for(arguments[0]) if event == "open" else None)


def hide(system: str) -> None:
    """Take away modules and names."""
    for name in OTHERS.split():
        importlib.import_module(name)
    unix, pair = socket.AF_UNIX, socket.socketpair
    for name in MISSING_MODULES[system].split():
        sys.modules[name] = None  # type: ignore[assignment]  # an import of it fails from now on
    for module, names in MISSING_NAMES[system].items():
        for name in names.split():
            if hasattr(module, name):
                delattr(module, name)
    selectors.DefaultSelector = selectors.SelectSelector
    socket.socketpair = lambda *_: pair(unix)  # every platform has a pair of its own
    sysconfig.get_config_vars()  # reads a file that is named for the platform


become(os.environ["PRETENDED_PLATFORM"])
