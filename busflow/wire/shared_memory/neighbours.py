"""Neighbours: the sessions of a run whose processes can read each other's memory."""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import Callable, Collection
from pathlib import Path
from typing import TYPE_CHECKING, Any

import zenoh

from busflow.wire.zenoh.keys import QUERY_PREFIX

if TYPE_CHECKING:
    from busflow.log import Logger


_PROC = Path("/proc")


class MemoryNeighbours:
    """Shows by a liveliness token where this process can read memory, and knows the other sessions that can.

    The token's key names the kernel, the user and the namespaces, so a session sees its neighbours' tokens only.
    """

    def __init__(
        self,
        session: zenoh.Session,
        on_loop: Callable[..., None],
        on_change: Callable[[], None],
        log: Logger,
    ) -> None:
        """Create a record without neighbours; `on_change` is called on the loop whenever one has come or gone."""
        self._session, self._on_loop, self._on_change, self._log = session, on_loop, on_change, log
        self._sessions: set[str] = set()
        self._declared: list[Any] = []

    def begin(self) -> None:
        """Show this process, if it can read the memory of others, and watch for the others."""
        place = _place_of_this_process()
        if place is None:
            return
        key = f"{QUERY_PREFIX}/memory/{place}"
        callback: Any = zenoh.handlers.Callback(self._on_sample, indirect=False)
        liveliness = self._session.liveliness()
        self._declared = [
            liveliness.declare_token(f"{key}/{self._session.info.zid()}"),
            liveliness.declare_subscriber(f"{key}/*", callback, history=True),
        ]

    def all_or_none(self, sessions: Collection[str]) -> Collection[str]:
        """Return these sessions if all of them are neighbours, else none."""
        return sessions if self._sessions.issuperset(sessions) else ()

    def withdraw(self, why: OSError) -> None:
        """Show no more that this process can read memory, since it cannot: others then send it their messages."""
        if self._declared:
            self._log.warning(f"messages of other processes cannot be read from shared memory: {why}")
        for each in self._declared:
            each.undeclare()
        self._declared.clear()

    def _on_sample(self, sample: zenoh.Sample) -> None:
        session = str(sample.key_expr).rpartition("/")[2]
        self._on_loop(self._note, session, sample.kind == zenoh.SampleKind.PUT)

    def _note(self, session: str, alive: bool) -> None:
        (self._sessions.add if alive else self._sessions.discard)(session)
        self._on_change()


def _place_of_this_process() -> str | None:
    """Return a word that all processes share which can read each other's memory; None if there are none.

    The kernel lets a process open those of another one of the same user in the same namespaces, unless that one has
    taken special rights.
    """
    if platform.machine() != "x86_64":  # others may show a reader the bytes of a newer message before its position
        return None
    try:
        if not hasattr(os, "memfd_create") or (_PROC / "self").stat().st_uid != os.geteuid():
            return None
        boot = (_PROC / "sys/kernel/random/boot_id").read_text(encoding="ascii")
        spaces = [str((_PROC / f"self/ns/{kind}").readlink()) for kind in ("pid", "user")]
    except OSError:
        return None
    return hashlib.blake2b(f"{boot} {os.geteuid()} {spaces}".encode(), digest_size=16).hexdigest()
