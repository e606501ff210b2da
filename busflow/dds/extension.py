"""BridgeProcess: the process of a bridge to DDS, which lives as long as a run and is started again when it fails."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncGenerator, Mapping
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Any

from busflow import timeouts
from busflow.dds.process import NODE, require_cyclonedds
from busflow.errors import ExitCode
from busflow.launchfile.model.supervision import RestartPolicy
from busflow.node.supervision import Backoff
from busflow.processes.child import Child, busflow_command, busflow_environment
from busflow.processes.pipe import record_of
from busflow.runner.extension import Extension
from busflow.text import printable
from busflow.wire.zenoh.run_directory import runs

if TYPE_CHECKING:
    from busflow.launchfile.model.ros2 import Ros2Spec
    from busflow.runner.graph import Graph

_LIFE = RestartPolicy(when="on-failure")


class BridgeProcess(Extension):
    """The bridge of a run; attach it after what lets other terminals find the run."""

    def __init__(self, graph: Graph, spec: Ros2Spec) -> None:
        """Create a bridge that opens when the graph starts; the graph is that of the run's main process.

        Raises:
            LaunchError: the environment names no valid domain.
        """
        self._graph, self._log = graph, graph.log.bind(NODE)
        self._arguments = ["dds", "--domain", str(spec.domain_in(os.environ))]
        self._arguments += [f"--topics={each}" for each in spec.topics]
        self._arguments += [] if spec.interface is None else [f"--interface={spec.interface}"]
        self._child: Child | None = None
        self._ending = False

    def begin(self) -> None:
        """Check that DDS can be spoken here.

        Raises:
            InspectionUnavailable: it cannot.
        """
        require_cyclonedds()

    def on_message(self, message: Mapping[str, Any]) -> None:
        """Pass on a line of the bridge's log; called in the thread that reads it."""
        with suppress(ValueError):
            self._graph.log.pass_on(record_of(message.get("log"), ""))

    def on_print(self, line: str, *, error: bool) -> None:  # noqa: ARG002  # the signature of a `ChildSink`
        """Pass on what the process prints, which is what Python or Cyclone says of a mistake."""
        self._log.warning(printable(line, limit=400))

    @asynccontextmanager
    async def surround(self) -> AsyncGenerator[None]:
        """Keep the bridge's process alive as long as the graph runs."""
        living = asyncio.get_running_loop().create_task(self._live(), name="busflow.dds")
        living.add_done_callback(self._on_end)
        try:
            yield
        finally:
            self._ending = True
            if self._child is not None:
                self._child.terminate()
            _, late = await asyncio.wait([living], timeout=timeouts.current.bridge_end)
            for task in late:
                if self._child is not None:
                    self._child.kill()
                task.cancel()

    def _on_end(self, task: asyncio.Task[None]) -> None:
        if not task.cancelled() and (error := task.exception()) is not None:
            self._log.error(f"there is no bridge to DDS: {type(error).__name__}: {error}")

    async def _live(self) -> None:
        """Start the process, and start it again when it fails."""
        backoff, clock = Backoff(_LIFE), self._graph.clock
        own = next((each for each in runs() if each.card.pid == os.getpid()), None)
        if own is None:
            self._log.error("there is no bridge to DDS: other terminals cannot join this run")
            return
        while not self._ending:
            since_s = clock.seconds()
            command = busflow_command([*self._arguments, "--run", own.name])
            try:
                self._child = Child(command, busflow_environment(os.environ), lambda: b"\n", self)
            except OSError as error:
                self._log.error(f"there is no bridge to DDS: its process cannot be started: {error}")
                return
            code = await self._child.ended()
            self._child = None
            if self._ending or code == ExitCode.OK:
                return
            pause_s = backoff.next_s(lived_s=clock.seconds() - since_s, now_s=clock.seconds())
            if pause_s is None or code == ExitCode.USAGE:
                self._log.error(f"there is no bridge to DDS any more: it ended with exit code {code}")
                return
            self._log.error(f"the bridge to DDS ended with exit code {code}; it opens again in {pause_s:g} s")
            await clock.sleep(pause_s)
