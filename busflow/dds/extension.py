"""Bridge: a program of a run as `busflow dds` is, which lives as long as the run and is started again when it fails."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncGenerator, Mapping
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from busflow import timeouts
from busflow.dds.process import NODE, require_cyclonedds
from busflow.errors import ExitCode
from busflow.launchfile.model.description import ProgramSpec
from busflow.launchfile.model.supervision import RestartPolicy, Supervision
from busflow.launchfile.yaml.value import Origin, StatedBy
from busflow.processes.child import busflow_environment, module_command
from busflow.processes.pipe import record_of
from busflow.programs.program import Program
from busflow.runner.extension import Extension
from busflow.runner.supervisor import outlast
from busflow.text import printable
from busflow.wire.zenoh.run_directory import runs

if TYPE_CHECKING:
    from busflow.launchfile.model.ros2 import Ros2Spec
    from busflow.runner.graph import Graph

_ORIGIN = Origin(StatedBy.CALLER)
_LIFE = Supervision(RestartPolicy("on-failure"))


class Bridge(Extension):
    """The bridge of a run; attach it after what lets other terminals find the run."""

    def __init__(self, graph: Graph, spec: Ros2Spec) -> None:
        """Create a bridge that opens when the graph starts; the graph is that of the run's main process.

        Raises:
            LaunchError: the environment names no valid domain.
        """
        self._graph, self._log = graph, graph.log.bind(NODE)
        self._arguments = (str(spec.domain_in(os.environ)), spec.interface or "", *spec.topics)

    def begin(self) -> None:
        """Check that DDS can be spoken here.

        Raises:
            InspectionUnavailable: it cannot.
        """
        require_cyclonedds()

    @asynccontextmanager
    async def surround(self) -> AsyncGenerator[None]:
        """Keep the bridge's program alive as long as the graph runs."""
        own = next((each for each in runs() if each.card.pid == os.getpid()), None)
        if own is None:
            self._log.error("there is no bridge to DDS: other terminals cannot join this run")
            yield
            return
        command = tuple(module_command("busflow.dds.process", own.name, *self._arguments))
        grace_s = timeouts.current.bridge_end / 2  # after SIGINT, and again after SIGTERM
        spec = ProgramSpec(NODE, _ORIGIN, command, _ORIGIN, Path.cwd(), _ORIGIN, grace_s=grace_s, supervision=_LIFE)
        program = BridgeProgram(self._graph, spec, busflow_environment(os.environ))
        living = asyncio.get_running_loop().create_task(program.live(), name="busflow.dds")
        try:
            yield
        finally:
            program.ask_to_stop()
            await outlast(living)


class BridgeProgram(Program):
    """The program of a bridge. No report lists it, it writes to the run's log, and its failure ends no run."""

    has_pipe = True

    def _fail(self, failure: str) -> None:
        self._log.error(f"there is no bridge to DDS any more: {failure}")

    def _next_pause_s(self, *, failed: bool, mendable: bool = True) -> float | None:
        return super()._next_pause_s(failed=failed, mendable=mendable and self._end.get("code") != ExitCode.USAGE)

    def on_message(self, message: Mapping[str, Any]) -> None:
        """Pass on a line of the bridge's log, or handle a message of the keeper."""
        if "log" not in message:
            super().on_message(message)
            return
        with suppress(ValueError):
            self._graph.log.pass_on(record_of(message["log"], ""))

    def on_print(self, line: str, *, error: bool) -> None:  # noqa: ARG002  # the signature of a `ChildSink`
        """Pass on what the process prints, which is what Python or Cyclone says of a mistake."""
        self._log.warning(printable(line, limit=400))
