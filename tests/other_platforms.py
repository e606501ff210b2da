"""Commands of busflow in an interpreter without what Windows or macOS lack: `python -m tests.other_platforms win32 ps`.

The standard library and other distributions have chosen their own code by then: what is looked at is busflow's.
"""

import importlib
import io
import json
import os
import select
import selectors
import signal
import socket
import sys
import sysconfig
from contextlib import redirect_stderr, redirect_stdout
from types import ModuleType

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
    "darwin": {os: "eventfd sched_getaffinity", select: "epoll EPOLLIN", selectors: "EpollSelector"},
}
"""Names of such modules."""


def become(platform: str) -> None:
    """Take away what the platform lacks, and have `sys.platform` name it."""
    for name in OTHERS.split():
        importlib.import_module(name)
    unix, pair = socket.AF_UNIX, socket.socketpair
    for name in MISSING_MODULES[platform].split():
        sys.modules[name] = None  # type: ignore[assignment]  # an import of it fails from now on
    for module, names in MISSING_NAMES[platform].items():
        for name in names.split():
            delattr(module, name)
    selectors.DefaultSelector = selectors.SelectSelector
    socket.socketpair = lambda *_: pair(unix)  # every platform has a pair of its own
    sysconfig.get_config_vars()  # reads a file that is named for the platform
    sys.platform = platform


def ran(commands: list[str]) -> dict[str, tuple[int, str, str]]:
    """Each command's exit code, output and errors."""
    from busflow.cli import main  # as the platform has it

    done: dict[str, tuple[int, str, str]] = {}
    for command in commands:
        with redirect_stdout(io.StringIO()) as out, redirect_stderr(io.StringIO()) as err:
            code = main(command.split())
        done[command] = int(code or 0), out.getvalue(), err.getvalue()
    return done


if __name__ == "__main__":
    become(sys.argv[1])
    json.dump(ran(sys.argv[2:]), sys.stdout)
