"""Program: one program of a run: starts it, restarts and stops it by its policies, and keeps account of its lives."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from busflow.errors import ProgramFailed
from busflow.launchfile.model.supervision import Condition, OnExit
from busflow.processes.child import Child
from busflow.programs import keeper
from busflow.programs.output import Output
from busflow.runner.report import ProgramReport
from busflow.runner.restarting import Restarting, following
from busflow.runner.signals import signal_name

if TYPE_CHECKING:
    from busflow.launchfile.model.description import ProgramSpec
    from busflow.runner.graph import Graph

_KEEPER = str(Path(keeper.__file__))


class ProgramState(StrEnum):
    """State of a program in a run."""

    WAITING = "waiting"
    """It waits for what it depends on."""
    STARTING = "starting"
    RUNNING = "running"
    RESTARTING = "restarting"
    """It failed or ended, and will be restarted."""
    STOPPING = "stopping"
    ENDED = "ended"
    FAILED = "failed"


_OUT = {ProgramState.ENDED, ProgramState.FAILED}
TRANSITIONS: Mapping[ProgramState, Collection[ProgramState]] = {
    ProgramState.WAITING: {ProgramState.STARTING, *_OUT},
    ProgramState.STARTING: {ProgramState.RUNNING, ProgramState.RESTARTING, ProgramState.STOPPING, *_OUT},
    ProgramState.RUNNING: {ProgramState.RESTARTING, ProgramState.STOPPING, *_OUT},
    ProgramState.RESTARTING: {ProgramState.STARTING, ProgramState.ENDED},
    ProgramState.STOPPING: _OUT,
    ProgramState.ENDED: set(),
    ProgramState.FAILED: set(),
}
"""The states that may follow each state of a program."""


class Program(Restarting):
    """A program and its lives: a life is one start of it, until nothing of it is left."""

    has_pipe = False
    """Whether its command gets the number of a pipe as another argument, for records of the log."""

    def __init__(self, graph: Graph, spec: ProgramSpec, environment: Mapping[str, str]) -> None:
        """Prepare the program; `live` starts it."""
        log = graph.log.bind(spec.name)
        super().__init__(spec.name, spec.supervision.restart, graph.clock.seconds, log)
        self.spec = spec
        self.state: ProgramState = ProgramState.WAITING
        """The state of the program; changed by `_become` alone."""
        self.pid: int | None = None
        """Number of its process; None if none runs."""
        self.output: Output = Output(log, spec.ready, lambda: self._call(self._meet, Condition.READY))
        self._graph, self._environment = graph, environment
        self._child: Child | None = None
        self._end: Mapping[str, Any] = {}
        """The end that the keeper reported: `code`, `killed`; or that it `failed` to start the program."""
        self._failure = ""
        """Text that says how it failed for good."""
        self._exit_codes: list[int] = []
        self._fates: list[str] = []
        self._loop: asyncio.AbstractEventLoop | None = None

    def _become(self, state: ProgramState) -> None:
        """Change the state, as `TRANSITIONS` allows."""
        self.state = following(self.name, TRANSITIONS, self.state, state)

    def statistics(self) -> ProgramReport:
        """Return the program's line of the report."""
        return ProgramReport(
            name=self.name,
            command=self.spec.command,
            state=self.state.value,
            pid=self.pid,
            restarts=self.restarts,
            exit_codes=tuple(self._exit_codes),
            fates=tuple(self._fates),
            lines=self.output.lines,
            lines_left_out=self.output.left_out,
        )

    def _finish(self) -> None:
        self._order_stop()  # where its task was cancelled
        self._become(ProgramState.FAILED if self._failure else ProgramState.ENDED)
        super()._finish()
        if self._failure:
            self._fail(self._failure)
        elif not self._stopping.is_set() and self.spec.supervision.on_exit is OnExit.SHUTDOWN:
            self._graph.ask_to_stop()
        elif not self._stopping.is_set():
            self._graph.course.end_if_finished()

    def _fail(self, failure: str) -> None:
        """End the run with a failure that no restart follows."""
        self._graph.log.bind(self.name, to_all=not self._graph.course.prints_failures).error(failure)
        self._graph.course.give_up(ProgramFailed(failure))

    def ask_to_stop(self) -> None:
        """Ask the program to end, without a restart."""
        if not self._stopping.is_set():
            super().ask_to_stop()
            if self.pid is not None:
                self._order_stop()

    def _order_stop(self) -> None:
        if self._child is not None and self.state is not ProgramState.STOPPING:
            self._become(ProgramState.STOPPING)
            self._child.send(b"stop\n")

    def _wait_in_vain(self, other: str, condition: Condition) -> None:
        self._failure = f"the program {self.name} is not started: {other} has ended before it was {condition}"

    async def _live_once(self) -> float | None:
        self._loop = asyncio.get_running_loop()
        if not await self._wait_for_others():
            return None
        failure = await self._run()
        pause_s = self._next_pause_s(failed=bool(failure))
        if pause_s is None:
            self._failure = failure
            return None
        if failure:
            self._log.error(failure)
        self._become(ProgramState.RESTARTING)
        self._log.warning("restarts", after_s=pause_s, restart=self.restarts)
        return pause_s

    async def _run(self) -> str:
        """Start the program and wait for its end; return how it failed, or an empty text."""
        self._become(ProgramState.STARTING)
        self._end, self._running_since_s = {}, None
        command = [sys.executable, "-I", "-S", _KEEPER]
        try:
            self._child = Child(command, self._environment, self._order, self)
        except OSError as error:
            failure = f"the program {self.name} cannot be started: {error.strerror}"
        else:
            await self._child.ended()
            self._kill_leftover()
            self.output.finish()
            failure = self._failure_text()
        self._child, self.pid = None, None
        if (code := self._end.get("code")) is not None:
            self._exit_codes.append(code)
        if failure:
            self._fates.append(failure)
        elif code is not None and not self._stopping.is_set():
            self._log.info("the program has ended", exit_code=code)
        return failure

    def _order(self) -> bytes:
        spec = self.spec
        order = {"command": spec.command, "cwd": str(spec.cwd), "grace_s": spec.grace_s, "pipe": self.has_pipe}
        return json.dumps(order).encode() + b"\n"

    def _kill_leftover(self) -> None:
        """Kill the program's process group where its keeper has not reported its end: the keeper was killed."""
        if self.pid is not None and "code" not in self._end:
            with suppress(OSError):  # nothing is left
                os.killpg(self.pid, signal.SIGKILL)

    def _failure_text(self) -> str:
        """Return a text that says how this life failed; empty if it ended well, or as the run asked."""
        begun = f"the program {self.name}"
        if (why := self._end.get("failed")) is not None:
            return f"{begun} cannot be started: {why}"
        if self._end.get("killed") and self._stopping.is_set():
            return f"{begun} did not end within {2 * self.spec.grace_s:g} s, and was killed"
        code: int | None = self._end.get("code")
        if code is None:
            return f"{begun} was killed, since its keeper has ended"
        if code == 0 or self._stopping.is_set():
            return ""
        return f"{begun} ended with exit code {code}" if code > 0 else f"{begun} was ended by {signal_name(-code)}"

    # What the keeper and the program say; these methods run in the thread that reads it.

    def on_message(self, message: Mapping[str, Any]) -> None:
        """Handle a message of the keeper: the program's number, or its end."""
        if "pid" in message:
            self._log.info("the program is started", pid=message["pid"])
            self.output.begin()
        self._call(self._on_start if "pid" in message else self._on_end, message)

    def on_print(self, line: str, *, error: bool) -> None:  # noqa: ARG002  # many programs write all they log to standard error
        """Log a line of the program's output."""
        self.output.write(line)

    def _call(self, act: Callable[[Any], None], value: Any) -> None:
        if self._loop is not None:
            with suppress(RuntimeError):  # the loop has ended: nothing waits
                self._loop.call_soon_threadsafe(act, value)

    def _on_start(self, message: Mapping[str, Any]) -> None:
        self.pid, self._running_since_s = message["pid"], self._seconds()
        if self.state is not ProgramState.STARTING:  # its task was cancelled, which has ordered the end
            return
        self._become(ProgramState.RUNNING)
        self._meet(Condition.STARTED)
        if self._stopping.is_set():
            self._order_stop()

    def _on_end(self, message: Mapping[str, Any]) -> None:
        self._end = message
