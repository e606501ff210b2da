"""WorkerProcess: starts one process of a run, watches it and restarts it; a life is one start of it, until its end."""

from __future__ import annotations

import asyncio
import json
import signal
import sys
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from busflow import timeouts
from busflow.errors import ExitCode
from busflow.launchfile.model.supervision import Restart
from busflow.processes.assignment import Memory
from busflow.processes.child import Child, busflow_environment, module_command
from busflow.processes.pipe import record_of
from busflow.runner.restarting import Restarting, following
from busflow.runner.signals import CODES, signal_name
from busflow.runner.supervisor import NodeState
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.launchfile.model.description import ProcessSpec
    from busflow.runner.graph import Graph

_LASTING = {ExitCode.USAGE, ExitCode.INCOMPLETE}
"""Exit codes after which no restart follows: another life would not mend a wrong command line, and an incomplete
recording ends the run.
"""
_SIGNALS = {int(code): number for number, code in CODES.items()}
"""Signals by the exit code of a process that stopped because of one."""


class WorkerState(StrEnum):
    """State of a worker process."""

    STARTING = "starting"
    RUNNING = "running"
    HANGS = "hangs"
    """The process was suspended (SIGSTOP) or had no time to answer for almost two seconds, or its event loop stands
    still.
    """
    RESTARTING = "restarting"
    ENDED = "ended"
    FAILED = "failed"


_OUT = {WorkerState.ENDED, WorkerState.FAILED}
TRANSITIONS: Mapping[WorkerState, Collection[WorkerState]] = {
    WorkerState.STARTING: {WorkerState.RUNNING, WorkerState.RESTARTING, *_OUT},
    WorkerState.RUNNING: {WorkerState.HANGS, WorkerState.RESTARTING, *_OUT},
    WorkerState.HANGS: {WorkerState.RUNNING, WorkerState.HANGS, WorkerState.RESTARTING, *_OUT},
    WorkerState.RESTARTING: {WorkerState.STARTING, WorkerState.ENDED},
    WorkerState.ENDED: set(),
    WorkerState.FAILED: set(),
}
"""The states that may follow each state of a worker process."""


@dataclass(frozen=True, slots=True)
class ProcessOutcome:
    """Outcome of one life of a process."""

    pid: int
    report: Mapping[str, Any] | None
    """Last report of the process; None if it sent none."""
    failure: str
    """Text that says how the process failed; empty if it ended as it should."""
    reported_end: bool = False
    """Whether the process itself reported its end; False if it was killed before it could."""


class WorkerOwner(Protocol):
    """Interface that a worker process needs of its process group."""

    @property
    def inherited(self) -> Sequence[int]:
        """Files that the process has open from its start."""
        ...

    def first_line(self, worker: WorkerProcess) -> bytes:
        """Return the first line for the process's standard input: its assignment, with the parameters set until now."""
        ...

    def on_outcome(self, worker: WorkerProcess, outcome: ProcessOutcome) -> None:
        """React to the end of a life, if nothing had asked the process to stop."""
        ...

    def on_snapshot(self, worker: WorkerProcess, message: Mapping[str, Any]) -> None:
        """React to a message of the process about a snapshot; called in any thread."""
        ...


class WorkerProcess(Restarting):
    """Worker process of a run, from its first start to its last end."""

    def __init__(
        self,
        graph: Graph,
        spec: ProcessSpec,
        nodes: Sequence[str],
        socket: str,
        *,
        environment: Mapping[str, str],
        owner: WorkerOwner,
    ) -> None:
        super().__init__(spec.name, spec.restart, graph.clock.seconds, graph.log.bind("busflow"))
        self.nodes: tuple[str, ...] = tuple(nodes)
        self.socket: str = socket
        self.state: WorkerState = WorkerState.STARTING
        """The state of the process; changed by `_become` alone."""
        self.failures: list[str] = []
        self.outcomes: list[ProcessOutcome] = []
        """The outcomes of the lives that are over."""
        self.report: Mapping[str, Any] | None = None
        """Last report of this life."""
        self.child: Child | None = None
        self.spec = spec
        self._graph, self._owner = graph, owner
        self._command = module_command("busflow.processes.worker", spec.name)
        self._environment = busflow_environment({**environment, **spec.env})
        self._end: dict[str, Any] = {}
        """The end that the process reported: `exit_code`, `failures`, `finished`; empty if it reported none."""
        self._last_message_s: float | None = None
        """Time of this life's last message; None before the first, until which the process reads no commands.

        A token that comes or goes before it is that of the life before: tokens take longer than a process's end.
        """
        self._last_report_s = 0.0
        self._is_debugged = False
        self._has_no_token = False
        self._killed_for = ""
        self._parameters: dict[str, Any] = {}
        self._stopped: tuple[str, ...] = ()
        """Names of the nodes that are stopped by hand."""

    @property
    def memory(self) -> Memory:
        """Parameters, restarts and nodes stopped by hand, with which the next life of the process begins."""
        restarts = Counter(dict.fromkeys(self.nodes, len(self.outcomes)))
        for outcome in self.outcomes:
            nodes = (outcome.report or {}).get("nodes", ())
            restarts.update({node["name"]: node["restarts"] + node["started_by_hand"] for node in nodes})
        return Memory(dict(self._parameters), dict(restarts), self._stopped)

    @property
    def pid(self) -> int | None:
        """Process number; None between two lives."""
        return None if self.child is None else self.child.pid

    def _become(self, state: WorkerState) -> None:
        """Change the state, as `TRANSITIONS` allows."""
        self.state = following(self.name, TRANSITIONS, self.state, state)

    async def _live_once(self) -> float | None:
        if self._stopping.is_set():
            return None
        if self.state is WorkerState.RESTARTING:
            self._become(WorkerState.STARTING)
        code, failure = await self._run()
        failures = self._end.get("failures") or ([failure] if failure else [])
        if self._stopping.is_set():  # a node may have failed in its `stop`
            self._become(WorkerState.FAILED if failures else WorkerState.ENDED)
            self.failures += failures
            return None
        mendable = self._end.get("exit_code") not in _LASTING
        pause_s = self._next_pause_s(failed=bool(failure), mendable=mendable)
        if pause_s is None:
            self._become(WorkerState.FAILED if failure else WorkerState.ENDED)
            self.failures += failures
            # The exit code says something about the nodes only if the process reported its end, and no signal ended it.
            known = self._end and code not in _SIGNALS
            self._end_run(code if known else ExitCode.FAILED)
        else:
            self._become(WorkerState.RESTARTING)
            self._log.warning(f"the process {self.name} restarts in {pause_s:g} s", restart=self.restarts)
        return pause_s

    def _end_run(self, code: int) -> None:
        """End the run with this process; if its nodes had only finished, wait for the others."""
        if self._end.get("finished") and not code:
            self._graph.course.end_if_finished()
        else:
            self._graph.ask_to_stop(next((each for each in ExitCode if each == code), ExitCode.FAILED))

    @property
    def _limit(self) -> str:
        return f"the process {self.name} is {super()._limit}"

    def _finish(self) -> None:
        if self.child is not None:
            self.child.kill()
        if self.state not in _OUT:  # the run ends before a life, or its task was cancelled
            self._become(WorkerState.ENDED)
        super()._finish()

    async def _run(self) -> tuple[int, str]:
        """Start the process and wait for its end; return its exit code, and how it failed, or an empty text."""
        self.report, self._killed_for, self._end, self._last_message_s = None, "", {}, None
        first, inherited = partial(self._owner.first_line, self), self._owner.inherited
        try:
            self.child = Child(self._command, self._environment, first, self, inherited=inherited)
        except OSError as error:
            failure = f"the process {self.name} cannot be started: {error}"
            self._log.error(failure)
            return ExitCode.FAILED, failure
        self._log.debug(f"the process {self.name} is started", pid=self.child.pid)
        code = await self.child.ended()
        failure = self._failure_text(code)
        outcome = ProcessOutcome(self.child.pid, self.report, failure, reported_end=bool(self._end))
        self.outcomes.append(outcome)
        self.child, self.report = None, None
        if failure:
            self._log.error(failure)
        if not self._stopping.is_set():
            self._owner.on_outcome(self, outcome)
        return code, failure

    def _failure_text(self, code: int) -> str:
        """Return a text that says how this life of the process failed; empty if it ended well."""
        stopping = self._stopping.is_set()
        if stopping and (self._end or code == -signal.SIGTERM):  # or SIGTERM came before it had a handler for it
            return ""
        if code == ExitCode.TERMINATED and not self._end:  # standard error names the node that did not stop
            return f"the process {self.name} did not stop in time, and had to end itself"
        if code == ExitCode.OK and (stopping or self._end):
            return ""
        if code >= 0 and code not in _SIGNALS:
            early = ", before its nodes had ended" if code == ExitCode.OK else ""
            return f"the process {self.name} ended with exit code {code}{early}"
        why = f", since it {self._killed_for}" if self._killed_for else ""
        return f"the process {self.name} was ended by {signal_name(_SIGNALS.get(code, -code))}{why}"

    def ask_to_stop(self, code: int = ExitCode.OK) -> None:
        """Ask the process to end, without a restart, since the run ends with this exit code."""
        super().ask_to_stop()
        if not self.send_command(end=int(code)) and self.child is not None:  # it does not read commands yet
            self.child.terminate()

    @property
    def reads_commands(self) -> bool:
        """Whether the process runs and has begun to read commands."""
        return self.child is not None and self.state is not WorkerState.STARTING and self._last_message_s is not None

    def send_command(self, **values: Any) -> bool:
        """Send a command to the process, such as one for a snapshot; return False if it does not run."""
        if self.child is None or not self.reads_commands:
            return False
        self.child.send(json.dumps(values).encode() + b"\n")
        return True

    def kill(self, why: str) -> None:
        """Kill the process at once."""
        if self.child is not None:
            self._killed_for = why
            self.child.kill()

    def on_presence(self, *, there: bool) -> None:
        """React to the process's liveliness token: it has appeared, or is gone because the process ends or hangs."""
        self._has_no_token = not there
        if self.child is None:  # between two lives, it is the token of the former life
            return
        if there:
            if self.state is WorkerState.HANGS:
                self._log.warning(f"the process {self.name} answers again")
            if self.state is not WorkerState.RUNNING:
                self._become(WorkerState.RUNNING)
            if self._running_since_s is None:  # else only its token was gone for a moment, and this is the same life
                self._running_since_s = self._seconds()
                self._log.debug(f"the process {self.name} runs")
                self._check_reports(self.child, self._seconds())
        elif self.state is WorkerState.RUNNING:
            asyncio.get_running_loop().call_later(timeouts.current.process_exit, self._check_for_hang, self.child)

    def _check_for_hang(self, child: Child) -> None:
        if self.child is not child or not self._has_no_token or self._stopping.is_set() or self._last_message_s is None:
            return
        # A recent message shows that the process lives: its token is gone because the main process stood still, or the
        # link broke.
        limit_s = timeouts.current.process_silent
        patience_s = limit_s * (10 if self._end else 1)  # after its last message it has the session and Python to end
        if self._seconds() - self._last_message_s < patience_s:
            asyncio.get_running_loop().call_later(limit_s, self._check_for_hang, child)
            return
        self._hang(child, "it is stopped (SIGSTOP), or has no time to answer")

    def _check_reports(self, child: Child, checked_s: float) -> None:
        """Check twice a second whether the process's event loop still turns; the loop sends two reports a second."""
        if self.child is not child or self._stopping.is_set():
            return
        now_s = self._seconds()
        limit_s = timeouts.current.process_silent
        if now_s - checked_s > limit_s:  # the main process stood still, and has not read the reports yet
            self._last_report_s = now_s
        silent_s = now_s - self._last_report_s
        if self.state is WorkerState.RUNNING and silent_s > self.spec.hang_s and self._is_at_work(child.pid):
            self._hang(child, f"its event loop stands still for {self.spec.hang_s:g} s (hang: in processes:)")
        elif self.state is WorkerState.HANGS and silent_s < limit_s and not self._has_no_token:
            self.on_presence(there=True)
        asyncio.get_running_loop().call_later(_CHECK_S, self._check_reports, child, now_s)

    def _is_at_work(self, pid: int) -> bool:
        """Return whether all nodes have started and no debugger is attached; else the event loop may stand still."""
        nodes = (self.report or {}).get("nodes", ())
        states = {node.get("state") for node in nodes}
        return bool(nodes) and not states & _BEFORE_WORK and not self._is_debugged and not _is_traced(pid)

    def _hang(self, child: Child, why: str) -> None:
        self._become(WorkerState.HANGS)
        self._log.error(f"the process {self.name} hangs: {why}", pid=child.pid)
        if self.policy.when is not Restart.NEVER:
            self.kill("hung")

    # The process's messages and prints; these methods run in the thread that reads them.

    def on_message(self, message: Mapping[str, Any]) -> None:
        """Handle a message of the child: a log line, a report or parameters."""
        self._last_message_s = now_s = self._seconds()
        if "log" in message:
            with suppress(ValueError):
                self._graph.log.pass_on(record_of(message["log"], self.name))
        elif "report" in message:
            self.report, self._last_report_s = message["report"], now_s
            if not self._stopping.is_set():
                nodes = message["report"]["nodes"] if message["report"] else ()
                self._stopped = tuple(node["name"] for node in nodes if node["state"] == NodeState.STOPPED_BY_HAND)
            self._is_debugged = bool(message.get("debugged"))
            self._end = dict(message.get("end") or self._end)
        elif "snapshot" in message:
            self._owner.on_snapshot(self, message["snapshot"])
        elif "parameters" in message:
            self._parameters |= message["parameters"]

    def on_print(self, line: str, *, error: bool) -> None:
        """Print a line that one of the process's nodes printed, with the name of the process."""
        stream = sys.stderr if error else sys.stdout
        if stream:  # None if the shell closed it
            stream.write(f"[{self.name}] {printable(line)}\n")
            stream.flush()


_CHECK_S = 0.5
"""Time between two checks of the last report's age."""
_BEFORE_WORK = {NodeState.BUILT, NodeState.WAITING, NodeState.STARTING, NodeState.RESTARTING}


def _is_traced(pid: int) -> bool:
    """Return whether a debugger such as gdb is attached to a process; False where the system has no /proc to say it."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return False
    return "TracerPid:" in status and "TracerPid:\t0\n" not in status
