"""Shares: the part of a run that each of its processes records."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from busflow.recording.recorder.share import Share

if TYPE_CHECKING:
    from busflow.launchfile.model.description import RecordSpec
    from busflow.launchfile.model.placement import Placement
    from busflow.runner.planning.preflight import Plan

_UNFIT = re.compile(r"[^\w.-]+")


class Shares:
    """The shares of all processes of a run, and a name for the file of each."""

    def __init__(self, spec: RecordSpec, placement: Placement, plan: Plan) -> None:
        """Divide the recording of `spec` among the processes of a placement; `plan` has all nodes of the run."""
        self.processes: tuple[str, ...] = (placement.main, *placement.others)
        self.stems: dict[str, str] = {}
        """By process, the name of its file without the suffix."""
        for process in self.processes:
            self.stems[process] = unlike(_stem(process), self.stems.values())
        everywhere = [*placement.nodes.values(), *placement.elsewhere.values()]
        self._spec = spec
        self._nodes = frozenset(node for nodes in everywhere for node in nodes)
        self._outside = _listeners(plan, placement, self.processes)

    def of(self, process: str, file: Path) -> Share:
        """Return the share of a process, which it records to this file."""
        return Share(process, file, self._spec, self._nodes, self._outside)


def unlike(name: str, others: Collection[str]) -> str:
    """Return the name, with as many `_` added as it needs to differ from all others."""
    while name in others:
        name += "_"
    return name


def _listeners(plan: Plan, placement: Placement, processes: Sequence[str]) -> dict[str, str]:
    """Map each topic to the first process that receives it, which also records messages from outside the run."""
    found: dict[str, str] = {}
    for process in processes:
        for planned in plan.nodes:
            if placement.process_of(planned.runtime.full_name) == process:
                for received in planned.subscriptions:
                    found.setdefault(received.topic, process)
    return found


def _stem(process: str) -> str:
    """Return the name of a process's file, without the machine: each machine has its own directory."""
    return _UNFIT.sub("_", process.rpartition(":")[2]).lstrip(".") or "process"
