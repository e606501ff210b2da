"""Inspection: lets a graph be looked into from other processes of its user, for as long as it runs."""

from __future__ import annotations

import os
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol

from busflow.errors import InspectionUnavailable
from busflow.wire.run_directory import SOCKET, RunCard, RunDirectory
from busflow.wire.session import open_session

if TYPE_CHECKING:
    from collections.abc import Callable

    from busflow.wire.questions import Inspected

    class Startable(Inspected, Protocol):
        """A graph that says when it starts."""

        on_start: list[Callable[[], None]]


@contextmanager
def inspected(graph: Startable, *, name: str, file: str = "", history: Mapping[str, int]) -> Generator[None]:
    """Let a graph that is about to run be looked into, while the block lasts.

    Where that cannot be (no Zenoh, no safe directory), the graph's log says why, and it runs all the same.

    Args:
        graph: what runs inside the block.
        name: the name under which it is found; another one of that name makes it `name-2`.
        file: its launch file.
        history: by final topic name, how many messages are kept for `--last`.
    """
    tell = graph.log.bind("busflow")
    try:
        directory = RunDirectory.claim(name)
    except (InspectionUnavailable, OSError) as error:
        tell.warning(f"this run cannot be looked into: {error}")
        yield
        return
    try:
        session = open_session(directory.path, listen=SOCKET)
    except InspectionUnavailable as error:
        directory.close()
        tell.warning(f"this run cannot be looked into: {error}")
        yield
        return
    from busflow.wire.mirror import Mirror

    card = RunCard(directory.path.name, os.getpid(), graph.clock.now().nanoseconds, file, _version())
    mirror = Mirror(graph, session, card, SOCKET.removesuffix(".sock"), history)

    def begin() -> None:
        mirror.begin()
        directory.write_card(card)
        if directory.path.name != name:
            tell.info(f"another run is called {name}, so this one is {directory.path.name}")

    graph.on_start.append(begin)
    try:
        yield
    finally:
        mirror.close()
        directory.close()


def _version() -> str:
    import busflow

    return busflow.__version__
