"""Membership: a process as one of several of a run, with its socket, its mirror and its barrier."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from busflow.wire.zenoh.session import open_session

if TYPE_CHECKING:
    from busflow.launchfile.model.description import LaunchDescription
    from busflow.wire.mirror.barrier import Barrier
    from busflow.wire.mirror.mirror import Mirror
    from busflow.wire.queries.queries import Inspected
    from busflow.wire.zenoh.network import Network
    from busflow.wire.zenoh.run_directory import RunCard

    class Described(Inspected, Protocol):
        """A graph, and the launch files it comes from."""

        descriptions: list[LaunchDescription]


class Membership:
    """Joins the run as its graph starts."""

    def __init__(
        self,
        graph: Described,
        directory: Path,
        card: RunCard,
        *,
        process: str,
        socket: str,
        network: Network | None = None,
        about: Callable[[], Mapping[str, Any]] = dict,
        on_change: Callable[[str, bool], None] | None = None,
    ) -> None:
        """A member that does not join before `begin`.

        Args:
            graph: what runs in this process.
            directory: the run's.
            card: what the run says of itself.
            process: this process's name.
            socket: the name of its socket in the directory.
            network: what links this machine to others, where this process does that.
            about: what the process tells of itself beside what its graph does.
            on_change: hears of another process that has come, or is gone or hangs.
        """
        self._graph, self._directory, self._card = graph, directory, card
        self._process, self._socket, self._network = process, socket, network
        self._about, self._on_change = about, on_change
        self._mirror: Mirror | None = None
        self._barrier: Barrier | None = None

    def begin(self) -> None:
        """Join, on the event loop, before the first node is connected."""
        session = open_session(self._directory, listen=self._socket, network=self._network)
        from busflow.wire.mirror.barrier import Barrier  # both need Zenoh
        from busflow.wire.mirror.mirror import Mirror

        topics = [topic for each in self._graph.descriptions for topic in each.topics]
        history = {topic.topic: topic.history for topic in topics if topic.history is not None}
        self._mirror = Mirror(self._graph, session, self._card, self._process, history, self._about)
        self._mirror.begin()
        self._barrier = Barrier(self._mirror, session, self._process, on_change=self._on_change)

    @property
    def barrier(self) -> Barrier:
        """What holds the nodes back; there once the graph has started."""
        if self._barrier is None:
            raise RuntimeError("the graph has not started")
        return self._barrier

    def close(self) -> None:
        """Leave the run, when all nodes have ended."""
        if self._mirror is not None:
            self._mirror.close()
