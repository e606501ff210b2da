"""The state of every run on this machine, or that it does not answer. Imports nothing heavy."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from busflow import timeouts
from busflow.clock import perf_counter
from busflow.errors import InspectionUnavailable
from busflow.wire.zenoh.run_directory import FoundRun, runs
from busflow.wire.zenoh.session import require_zenoh

if TYPE_CHECKING:
    from busflow.wire.client.client import Peer
    from busflow.wire.machines.remote import RemoteRun


@dataclass(frozen=True, slots=True)
class PresentRun:
    """A live run on this machine, and its processes' answers."""

    run: FoundRun | RemoteRun
    processes: tuple[Mapping[str, Any], ...] = ()
    """Each process's answer to `run`."""
    silence: str = ""
    """Why there is no answer; empty if there is one."""
    answered_in_s: float = 0.0
    """How long the answer took."""

    @property
    def nodes(self) -> int | None:
        """The number of its nodes; None if it does not answer."""
        return None if self.silence else sum(process["nodes"] for process in self.processes)

    @property
    def programs(self) -> tuple[Mapping[str, Any], ...]:
        """The programs that its processes have started: `{program, pid, state, restarts, command, last_failure}`."""
        return tuple(program for process in self.processes for program in process.get("programs", ()))

    @property
    def shared_memory(self) -> int:
        """Bytes of memory that its processes share, for large messages."""
        return sum(process.get("shared_memory", 0) for process in self.processes)

    @property
    def missing(self) -> Mapping[str, str]:
        """The machines that the run's own one is not linked to, and why."""
        machines = self._here.get("machines", {})
        return {name: how["reason"] for name, how in machines.items() if not how["linked"]}

    @property
    def versions(self) -> Mapping[str, str]:
        """The versions of busflow on the machines that the run's own one is linked to."""
        machines = self._here.get("machines", {})
        return {name: how["version"] for name, how in machines.items() if how["linked"] and how.get("version")}

    @property
    def port(self) -> int | None:
        """The port at which the run's own machine listens for the others, if it does."""
        return self._here.get("port")

    @property
    def _here(self) -> Mapping[str, Any]:
        """The answer of the main process of this machine; empty if it does not answer."""
        return next((each for each in self.processes if each["pid"] == self.run.card.pid), dict[str, Any]())

    @property
    def state(self) -> str:
        """The state of the run, in a word or two."""
        if self.silence:
            return "does not answer"
        states = Counter[str]()
        for process in self.processes:
            states.update(process.get("states", {}))
        states.update(program["state"] for program in self.programs)
        if states["failed"]:
            return f"{states['failed']} failed"
        if self.missing:
            return f"{', '.join(self.missing)} not linked"
        return next(
            (state for state in ("stopping", "restarting", "waiting", "starting", "built") if states[state]), "running"
        )


def ask_runs(patience_s: float | None = None) -> Iterator[PresentRun]:
    """Ask every run of this user for its state, the oldest first.

    Raises:
        InspectionUnavailable: A folder where runs would be is not safe.
    """
    for run in runs():
        yield ask_run(run, patience_s)


def ask_run(run: FoundRun | RemoteRun, patience_s: float | None = None) -> PresentRun:
    """Ask one run for its state."""
    try:
        require_zenoh()
        from busflow.wire.client.client import Peer

        with closing(Peer(run, patience_s=timeouts.current.present if patience_s is None else patience_s)) as peer:
            return ask_peer(peer)
    except InspectionUnavailable as error:
        return PresentRun(run, silence=str(error))


def ask_peer(peer: Peer) -> PresentRun:
    """Ask a run that is joined already for its state.

    Raises:
        InspectionUnavailable: It does not answer.
    """
    begun = perf_counter()
    processes = tuple(peer.ask("run"))
    took_s = perf_counter() - begun
    return PresentRun(peer.run.answered(processes), _with_silent_ones(processes), peer.silence, took_s)


def _with_silent_ones(answers: tuple[Mapping[str, Any], ...]) -> tuple[Mapping[str, Any], ...]:
    """Return the processes' answers, the main process's first, and its entries for silent processes."""
    answered = {answer["process"] for answer in answers}
    silent = [member for answer in answers for member in answer.get("members", ()) if member["process"] not in answered]
    return (*sorted(answers, key=lambda answer: (":" in answer["process"], "members" not in answer)), *silent)
