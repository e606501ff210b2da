"""Assignment: one line of JSON on a worker process's standard input, which says which nodes the process runs, and how.

The pipe stays open until the main process ends; then the worker process ends too.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TextIO

from busflow.bus.bus import BusObserver
from busflow.bus.failure import is_failure
from busflow.errors import InvalidParameter, ProcessFailed
from busflow.node.factory import NodeFactory, rebuild
from busflow.runner.source import Source
from busflow.text import printable
from busflow.validation.faults import plain
from busflow.wire.zenoh.run_directory import RunCard

if TYPE_CHECKING:
    from busflow.log import Log
    from busflow.node.parameter_store import ParameterStore
    from busflow.node.parameters import Parameters
    from busflow.runner.planning.planned_node import PlannedNode
    from busflow.runner.planning.preflight import Plan

_MOST_CHARACTERS = 1 << 24


@dataclass(frozen=True, slots=True)
class Assignment:
    """Name of a worker process, its nodes, and the other processes of the run."""

    process: str
    socket: str
    """Name of the process's own socket in the run's directory."""
    earlier: tuple[str, ...]
    """Those to which it connects: of the processes before it, and after a restart of all. Later ones connect to it."""
    directory: str
    card: RunCard
    nodes: tuple[str, ...]
    """Full names of the process's nodes."""
    others: tuple[str, ...]
    """Names of the processes with which this one must be linked, in both directions, before its nodes start."""
    seed: int
    log_level: str
    ros2_listens: str
    """Address at which it waits for nodes of ROS 2; empty if the run lets none in."""
    ros2_dials: tuple[str, ...]
    """Addresses of their router and of the processes of earlier runs."""
    restarts: int
    """Number of restarts of the process."""
    nice: int
    env: Mapping[str, str]
    """Environment variables of this process alone."""
    outer: Mapping[str, str | None]
    """Variables of the main process when it read the launch file; with them the worker reads the same from the file."""
    watchdog_s: float | None
    prints_failures: bool
    """True if the run prints a failure that ends the process at its own end; then the log does not print it too."""
    path: tuple[str, ...]
    """Module search path (`sys.path`) of the main process."""
    source: Source
    """The launch file or plugin that every process of the run reads."""
    memory: Memory
    """Parameters and restarts of its nodes, from before the process restarted."""
    event_loop: str
    """Name of the event loop that all processes of the run use."""
    timeouts: Mapping[str, float]
    """Limits of real time that differ from the defaults."""
    record: Mapping[str, Any] | None = None
    """The process's part of the recording, as plain data of a `Share`; None if nothing is recorded."""

    def line(self) -> bytes:
        """Return the line that is written to the process's standard input."""
        return json.dumps(asdict(self), default=str).encode() + b"\n"

    @classmethod
    def read(cls, stream: TextIO | None) -> Self:
        """Read the assignment from standard input.

        Raises:
            ProcessFailed: there is no assignment, because busflow did not start this process.
        """
        try:
            values: dict[str, Any] = json.loads(stream.readline(_MOST_CHARACTERS)) if stream is not None else {}
            memory = values["memory"] | {"stopped": tuple(values["memory"]["stopped"])}
            card = values["card"] | {"ros2_addresses": tuple(values["card"]["ros2_addresses"])}
            stated = values["source"]
            folder = stated["folder"] and Path(stated["folder"])
            stated |= {key: tuple(stated[key]) for key in ("assignments", "sets", "profiles", "remaps")}
            source = Source(**stated | {"file": Path(stated["file"]), "folder": folder})
            values |= {"card": RunCard(**card), "memory": Memory(**memory), "source": source}
            values |= {key: tuple(values[key]) for key in ("earlier", "nodes", "others", "path", "ros2_dials")}
            return cls(**values)
        except (ValueError, TypeError, LookupError):
            text = "this module is for busflow run, which starts the processes of a launch file with it"
            raise ProcessFailed(f"{text}: use busflow run FILE") from None


@dataclass(frozen=True, slots=True)
class Memory:
    """Parameters and restarts of a process's nodes, kept for the restart of the process."""

    parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict[str, Mapping[str, Any]])
    """By node of which some were set at run time, its parameters as `ParameterReports` sends them."""
    restarts: Mapping[str, int] = field(default_factory=dict[str, int])
    """By node, how often it was started again: with its process, by its own policy, or by hand."""
    stopped: tuple[str, ...] = ()
    """Nodes that were stopped by hand when the process ended; they stay stopped."""

    def restored(self, plan: Plan, log: Log) -> list[PlannedNode]:
        """Return the nodes of a plan, with the parameters and restarts that they had when the process ended."""
        return [self._restored(planned, log) for planned in plan.nodes]

    def _restored(self, planned: PlannedNode, log: Log) -> PlannedNode:
        name = planned.runtime.full_name
        changes, restarts = self.parameters.get(name), self.restarts.get(name, 0)
        former: Parameters = planned.runtime.node.parameters
        try:
            parameters: Parameters = (
                former if changes is None else NodeFactory(type(planned.node)).parameters(changes["values"])
            )
            runtime = rebuild(planned.runtime, parameters, restarts)
        except BaseException as error:  # the code of a node may have been edited since, and may raise anything
            if not is_failure(error):
                raise
            why = str(error) if isinstance(error, InvalidParameter) else f"{type(error).__name__}: {printable(error)}"
            log.bind(name).warning("parameters set at run time are not valid any more: the file's are used", reason=why)
            return replace(planned, node=rebuild(planned.runtime, former, restarts).node)
        if changes is not None:
            runtime.parameters.remember(changes["set"], changes["times"])
        return replace(planned, node=runtime.node)


class ParameterReports(BusObserver):
    """Sends the parameters of each node on a bus after every change."""

    def __init__(self, send: Callable[[Mapping[str, Any]], None]) -> None:
        self._send = send

    def parameters_added(self, store: ParameterStore) -> None:
        """Send these parameters when they change."""
        store.on_change.append(lambda _old, _result: self._send({store.node: _changed(store)}))


def _changed(store: ParameterStore) -> Mapping[str, Any]:
    return {"values": plain(store.current), "set": sorted(store.set_at_run_time), "times": store.times_set}
