"""Membership: a process's part in its run (socket, mirror and barrier); Inspection: a run of one process."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from busflow.clock import SystemClock
from busflow.errors import InspectionUnavailable
from busflow.runner.extension import Extension
from busflow.wire.zenoh.run_directory import RunCard, RunDirectory
from busflow.wire.zenoh.session import SOCKET, open_session

if TYPE_CHECKING:
    from busflow.runner.assembly import Run
    from busflow.runner.graph import Graph
    from busflow.runner.supervisor import Supervisor
    from busflow.wire.mirror.barrier import Barrier
    from busflow.wire.mirror.mirror import Mirror
    from busflow.wire.zenoh.network import Network


class Membership(Extension):
    """Joins the run when its graph starts."""

    def __init__(
        self,
        graph: Graph,
        directory: Path,
        card: RunCard,
        *,
        process: str,
        socket: str,
        earlier: Sequence[str] = (),
        network: Network | None = None,
        about: Callable[[], Mapping[str, Any]] = dict,
        on_change: Callable[[str, bool], None] | None = None,
        on_version: Callable[[str, str], None] | None = None,
    ) -> None:
        """Create a member; it joins in `begin`.

        Args:
            graph: the nodes of this process.
            directory: the run's directory, as its processes name it (`RunDirectory.inside`).
            card: the run's description of itself.
            process: this process's name.
            socket: the name of its socket in the directory.
            earlier: those of the processes before it, to which it connects.
            network: the links to other machines, if this process has them.
            about: returns the facts about the process that are not in its graph.
            on_change: called when another process has come, is gone or hangs.
            on_version: called with the name of each process of the run and its version of busflow.
        """
        self._graph, self._directory, self._card = graph, directory, card
        self._process, self._network = process, network
        self._socket, self._earlier = socket, earlier
        self._about, self._on_change, self._on_version = about, on_change, on_version
        self._shown_version: object = None
        self._mirror: Mirror | None = None
        self._barrier: Barrier | None = None

    def begin(self) -> None:
        """Join the run on the event loop, before the first node is connected."""
        session = open_session(self._directory, listen=self._socket, earlier=self._earlier, network=self._network)
        from busflow.wire.mirror.barrier import Barrier  # both modules need Zenoh
        from busflow.wire.mirror.mirror import Mirror

        history = _history(self._graph)
        lines = _line_directory(self._graph, self._directory)
        self._mirror = Mirror(self._graph, session, self._card, self._process, history, self._about, lines)
        self._mirror.begin()
        self._barrier = Barrier(self._mirror, session, self._process, on_change=self._on_change)
        if self._on_version is not None:
            from busflow.wire.mirror.versions import exchange_versions

            self._shown_version = exchange_versions(session, self._process, self._card.version, self._on_version)

    @property
    def barrier(self) -> Barrier:
        """The barrier that delays the nodes; available once the graph has started."""
        if self._barrier is None:
            raise RuntimeError("the graph has not started")
        return self._barrier

    def about(self) -> Mapping[str, Any]:
        """Return what the mirror knows of other sessions."""
        return {} if self._mirror is None else self._mirror.about()

    def end(self) -> None:
        """Leave the run, after all nodes have ended."""
        if self._mirror is not None:
            self._mirror.close()


def card_of(graph: Graph, name: str, process: str, *, since_ns: int, network: Network | None) -> RunCard:
    """Return the description of the run to which this graph belongs, alone or as the one of the main process."""
    file = next((each.file for each in graph.descriptions), "")
    packages = {key: str(path) for each in graph.descriptions for key, path in each.packages.items()}
    card = RunCard(name, os.getpid(), since_ns, file, _version(), packages, main_process=process)
    if network is None or network.ros2 is None:
        return card
    addresses = () if network.ros2.is_router else tuple(network.ros2.listens)  # a later run finds the router anyway
    return replace(card, ros2_domain=network.ros2.domain, ros2_addresses=addresses)


def show(run: Run) -> None:
    """Let this user's other terminals inspect a run of one process, under the name that it is given."""
    inspectable(run.graph, run.given.inspect)


def inspectable(graph: Graph, name: bool | str = True, *, network: Callable[[], Network | None] | None = None) -> None:
    """Let this user's other terminals inspect a graph from its start to its end.

    If that is not possible (no Zenoh, no safe directory), the graph's log says why, and the graph runs all the same;
    with a `network` it does not run.

    Args:
        graph: a graph that has not started.
        name: the name under which other terminals find the graph; True takes the launch file's name, or the program's
            if there is no launch file. If another run has that name, it becomes `name-2`.
        network: returns the links to others than this user's terminals; called when the graph starts.
    """
    own = graph.name if graph.descriptions else Path(sys.argv[0]).stem or graph.name
    shown = own if name is True else str(name)
    graph.attach(Inspection(graph, name=shown, network=network))


class Inspection(Extension):
    """A graph's run directory and session, from its start to its end."""

    def __init__(
        self,
        graph: Graph,
        *,
        name: str,
        network: Callable[[], Network | None] | None = None,
    ) -> None:
        self._graph, self._name, self._network = graph, name, network
        self._log = graph.log.bind("busflow")
        self._directory: RunDirectory | None = None
        self._mirror: Mirror | None = None

    def begin(self) -> None:
        """Create directory and session on the event loop, before the first endpoint is attached."""
        try:
            self._directory = RunDirectory.claim(self._name)
            self._show(self._directory)
        except Exception as error:  # a graph runs even if it cannot be inspected
            if self._network is not None:
                self.end()
                raise
            known = isinstance(error, (InspectionUnavailable, OSError))
            why = str(error) if known else f"{type(error).__name__}: {error}"
            self._log.warning(f"this run cannot be inspected: {why}")
            self.end()

    def about(self) -> Mapping[str, Any]:
        """Return what the mirror knows of other sessions."""
        return {} if self._mirror is None else self._mirror.about()

    def node_dismissed(self, supervisor: Supervisor) -> None:
        """Stop showing a node."""
        if self._mirror is not None:
            self._mirror.hide(supervisor.name)

    def end(self) -> None:
        """Close session and directory."""
        mirror, self._mirror = self._mirror, None
        directory, self._directory = self._directory, None
        with nullcontext() if directory is None else directory.ending():
            if mirror is not None:
                mirror.close()

    def _show(self, directory: RunDirectory) -> None:
        network = None if self._network is None else self._network()
        session = open_session(directory.inside, listen=SOCKET, earlier=(), network=network)
        from busflow.wire.mirror.mirror import Mirror  # the module needs Zenoh

        name, process = directory.path.name, SOCKET.removesuffix(".sock")
        started_ns = SystemClock().now().nanoseconds  # wall time, whatever clock the graph has
        card = card_of(self._graph, name, process, since_ns=started_ns, network=network)
        lines = _line_directory(self._graph, directory.inside)
        self._mirror = Mirror(self._graph, session, card, process, _history(self._graph), lines=lines)
        self._mirror.begin()
        directory.write_card(card)
        if network is not None and network.ros2 is not None:
            self._log.info(str(network.ros2))
        if name != self._name:
            self._log.info(f"other terminals find this run as {name}")


def _history(graph: Graph) -> Mapping[str, int]:
    """Return how many messages of a topic are kept for `--last`, where a launch file says it."""
    topics = [topic for each in graph.descriptions for topic in each.topics]
    return {topic.topic: topic.history for topic in topics if topic.history is not None}


def _line_directory(graph: Graph, directory: Path) -> Path | None:
    """Return the run's directory if its processes send each other messages by lines, whose sockets lie there."""
    return directory if all(each.line for each in graph.descriptions) else None


def _version() -> str:
    import busflow

    return busflow.__version__
