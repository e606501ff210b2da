"""Session: opens a process's Zenoh session, with Unix sockets in the run's directory and the launch file's links.

By default Zenoh listens on every network interface and finds other sessions by multicast; busflow turns both off. It
would also connect to each address that gossip tells it, and a program that listens at a Unix socket of its own would
then be taken for this user. So a session connects to the addresses that it is given alone: each process of a run to the
processes before it. Nodes of ROS 2 connect by themselves. Zenoh is imported when a session is opened, so a run without
a session works without Zenoh.
"""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import importlib
import json
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from busflow import timeouts
from busflow.errors import InspectionUnavailable
from busflow.text import printable

if TYPE_CHECKING:
    import zenoh

    from busflow.wire.zenoh.network import Network

SOCKET = "main.sock"
"""The main process's socket in the run's directory."""
_RX_BUFFER = 1 << 20
"""Size of the receive buffer in bytes: from 64 KB a message, five to nine times the throughput of Zenoh's default
(measured).
"""
_FILES = 24
"""Number of files that a session opens, some for its links included (measured: 21 with one link). If the system refuses
one, a thread of Zenoh panics, and the process waits for ever for the processes that it links to.
"""
_OCCUPIED = re.compile(r"new \S+ listener on \S+ (\S+: )*(?P<reason>[^:]+?) \(os error")
"""Zenoh's error text when it cannot listen."""
_PATIENCE_US = 250_000
"""How long a message of many pieces waits for room on a link before it is dropped; it waits in a thread of its own.
Zenoh's default of 50 ms is too short for a reader that shares two busy cores.
"""
_ROOM = {
    "transport/link/tx/queue/size/data": 16,
    "transport/link/tx/queue/size/data_low": 16,
    "transport/link/tx/queue/congestion_control/drop/wait_before_drop": 50_000,
}
"""Queue sizes for links within a machine, where a reader at most waits for a core: 16 batches of 64 KB, allocated when
needed, and up to 50 ms for a message's first piece. With Zenoh's 2 batches and 1 ms, 2 to 24 % of a flood of 64 KB or 1
MB messages was lost while six programs shared a core. With these values none was lost, and two or three times as many
arrived; with 20 ms up to 1 % was lost.

Zenoh's BLOCK does not avoid losses: a blocked put holds a lock that closing the link needs. One stopped reader kept all
large messages from the others for as long as was measured, and all small ones for 3 s. A link to another machine may
always be slower than its traffic, and messages that wait there become old: Zenoh's own values are used for it.
"""


_RETRY = {"period_init_ms": 20, "period_max_ms": 500, "period_increase_factor": 2.0}
"""The times between attempts to connect to a process or machine that is not there yet, or has gone."""
_NETWORK_SETTINGS: dict[str, Any] = {
    "timestamping/enabled": False,
    "adminspace/enabled": False,
}
"""Settings of a session that others than this user's terminals reach."""


def require_unix_sockets(otherwise: str = "") -> None:
    """Check that this platform has Unix sockets and file locks, which connect the terminals and processes of one user.

    Args:
        otherwise: another remedy than another platform, as the end of the error's sentence.

    Raises:
        InspectionUnavailable: The platform lacks them, as Windows does.
    """
    try:
        importlib.import_module("fcntl")  # Windows has neither this module nor such sockets
    except ImportError:
        what = "this platform has no sockets that only one user can open, which connect terminals and processes"
        raise InspectionUnavailable(f"{what}: use Linux, or WSL on Windows{otherwise}") from None


def require_zenoh() -> None:
    """Check that a session can be opened here.

    Raises:
        InspectionUnavailable: The platform has no Unix sockets, or Zenoh is missing or broken.
    """
    require_unix_sockets()
    try:
        importlib.import_module("zenoh")
    except ImportError as error:
        raise InspectionUnavailable(f"Zenoh cannot be imported here ({error}); pip install eclipse-zenoh") from None


def open_session(
    directory: Path,
    *,
    listen: str | None = None,
    earlier: Sequence[str] | None = None,
    network: Network | None = None,
    patience_s: float = 5.0,
) -> zenoh.Session:
    """Open a session that links to the processes of a run.

    Args:
        directory: the run's directory.
        listen: the name of the socket on which others reach this process; None for a client, which has none.
        earlier: the names of the sockets to connect to, now or when they are there; None for all that are there now.
        network: the links to other machines, if this process has them.
        patience_s: how long a process may take to answer a new session.

    Raises:
        InspectionUnavailable: Zenoh is missing or refuses, or no process answers a client.
    """
    require_zenoh()
    names = earlier
    if names is None:
        names = [name for name in _names_in(directory) if name.endswith(".sock") and name != listen]
    # The main process comes first: in a run of several machines it has the links to the others.
    others = [f"unixsock-stream/{directory / name}" for name in sorted(names, key=lambda name: (name != SOCKET, name))]
    if listen is None and not others:
        raise InspectionUnavailable(f"the run in {directory} has no socket yet; try again")
    own = [] if listen is None else [f"unixsock-stream/{directory / listen}"]
    settings = _settings(own, others, patience_s)
    if earlier is not None:
        settings["connect/timeout_ms"] = -1  # for ever: a process or machine may come at any time
    if network is None or not (network.listens or network.dials):
        settings |= _ROOM
    if network is not None:
        settings |= _linked(own, others, network) | network.settings()
    try:
        return _opened(settings)
    except InspectionUnavailable as error:
        if network is not None and (found := _OCCUPIED.search(str(error))) is not None:
            ends = ", ".join(network.ends[0])
            text = f"this machine cannot listen at {ends}: {found['reason']}"
            raise InspectionUnavailable(f"{text}; another run of it, or another program, may be there") from None
        if listen is None and any(word in str(error) for word in ("deadline", "Unable to connect")):
            raise InspectionUnavailable(f"{directory.name} does not answer: its process is stopped or hangs") from None
        raise InspectionUnavailable(f"no Zenoh session in {directory}: {error}") from None


def open_router(address: str) -> zenoh.Session:
    """Open a session that listens at an address as a router, and links what connects to it.

    Raises:
        InspectionUnavailable: Zenoh is missing or refuses, or something listens there already.
    """
    require_zenoh()
    return _opened(_settings([address], []) | _NETWORK_SETTINGS | {"mode": "router"})


def _names_in(directory: Path) -> list[str]:
    """List a run's directory; the run may end and remove it at any moment.

    Raises:
        InspectionUnavailable: the directory is gone.
    """
    try:
        return [path.name for path in directory.iterdir()]
    except OSError as error:
        raise InspectionUnavailable(f"the run in {directory} is gone: {error.strerror}") from None


def _settings(own: Sequence[str], others: Sequence[str], patience_s: float = 5.0) -> dict[str, Any]:
    return {
        # A client links to the run only, which forwards messages between clients. As peers, two clients that do not
        # listen would not find each other.
        "mode": "peer" if own else "client",
        "listen/endpoints": own,
        "connect/endpoints": others,
        "connect/timeout_ms": 0,
        "connect/exit_on_failure": not own,
        "connect/retry": _RETRY,
        "scouting/delay": 1,  # milliseconds; multicast scouting is off
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": True,
        "scouting/gossip/autoconnect": [],
        "transport/unicast/open_timeout": round(patience_s * 1000),
        "transport/link/rx/buffer_size": _RX_BUFFER,
        "transport/link/tx/queue/congestion_control/drop/max_wait_before_drop_fragments": _PATIENCE_US,
        "transport/link/tx/lease": round(timeouts.current.lease * 1000),
        "transport/shared_memory/enabled": False,
    }


def _linked(own: Sequence[str], others: Sequence[str], network: Network) -> dict[str, Any]:
    """Return the settings of a process with links to other machines or to ROS 2: a router that forwards messages.

    Where ROS 2 has a router, it is a peer of the nodes of ROS 2, which find it through that router.
    """
    listens, dials = network.ends
    router = network.is_router
    return {
        **({} if network.ros2 is None else {"id": _low_id()}),
        "mode": "router" if router else "peer",
        "listen/endpoints": [*own, *listens],
        "connect/endpoints": dials if router else [*others, *dials],
        **_NETWORK_SETTINGS,
    }


def _low_id() -> str:
    """Return an id that is lower than that of a node of ROS 2, with as good as certainty.

    Of two sessions that hear of each other, the one with the greater id connects; a session of a run never does. Zenoh
    compares the bytes of ids from the last one on, or has compared them as numbers: so the last four are zero, and the
    first four of sixteen as well.
    """
    return f"{int.from_bytes(os.urandom(8)):x}00000000"


def open_remote(network: Network, *, patience_s: float = 5.0) -> zenoh.Session:
    """Open a session with a run on other machines, for a client.

    Raises:
        InspectionUnavailable: Zenoh is missing or refuses, or no machine of the run accepts the client.
    """
    require_zenoh()
    return _opened(_settings([], [str(end) for end in network.dials], patience_s) | network.settings())


def links_of(session: zenoh.Session) -> dict[str, str]:
    """Return the address at the other end of each link, by the id of the session there; "" has the session's own id."""
    info: Any = session.info
    ends = {str(link.zid): str(link.dst) for link in info.links()}
    return {"": str(info.zid()), **ends}


def _require_files() -> None:
    """Check that the process may open as many files as a session needs.

    Raises:
        InspectionUnavailable: It may not open so many.
    """
    import resource  # Windows does not have it

    allowed, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    used = sum(1 for _ in Path("/dev/fd").iterdir())
    if allowed != resource.RLIM_INFINITY and allowed - used < _FILES:
        why = f"{allowed} open files are allowed here (ulimit -n) and {used} are open, but Zenoh needs {_FILES} more"
        raise InspectionUnavailable(f"{why}: allow {used + _FILES} at least, better 1024")


def _opened(settings: Mapping[str, Any]) -> zenoh.Session:
    import zenoh

    _require_files()
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise InspectionUnavailable(str(error)) from None
    except BaseException as error:
        if type(error).__name__ != "PanicException":  # pyo3's class, which cannot be imported
            raise
        why = f"Zenoh gave up ({printable(error)}); too few files or threads may be allowed here, see ulimit -n and -u"
        raise InspectionUnavailable(why) from None
