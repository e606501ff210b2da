"""Machines: a run's other machines as this one sees them: linked or not, since when, and why not."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import busflow
from busflow import timeouts
from busflow.launchfile.model.placement import MAIN, machine_of, process_name
from busflow.runner.planning.credentials import credentials_of
from busflow.text import printable
from busflow.validation.versions import work_together
from busflow.wire.machines.probe import why_not_linked
from busflow.wire.zenoh.network import Network

if TYPE_CHECKING:
    from busflow.launchfile.model.network import NetworkAddress, NetworkSpec
    from busflow.log import Logger

_CHECK_S = 5.0
"""Interval of the checks why a machine is missing."""


@dataclass(slots=True)
class _Machine:
    """State of one machine."""

    linked: bool = False
    was_linked: bool = False
    changed_s: float = 0.0
    reason: str = ""
    """Last logged reason why the machine is not linked."""
    version: str = ""
    """Its version of busflow; empty as long as it is unknown."""


class Machines:
    """Link states of a run's other machines; no node waits for them."""

    def __init__(self, spec: NetworkSpec, own: str, log: Logger, seconds: Callable[[], float]) -> None:
        """Begin with no machine linked.

        Args:
            spec: all machines of the run.
            own: the name of this machine.
            log: receives a line when a machine is linked, or is not any more.
            seconds: returns the run's time.
        """
        self.own: str = own
        self._spec, self._log, self._seconds = spec, log, seconds
        self.network: Network = Network.of(spec, own)
        self._dialled: dict[str, NetworkAddress] = {}
        for name, machine in spec.machines.items():
            if machine.connect is not None and machine.connect in spec.dialled_by(own):
                self._dialled[name] = machine.connect
        self._machines = {name: _Machine() for name in spec.machines if name != own}
        self._changed = asyncio.Event()
        self._double_check: asyncio.TimerHandle | None = None
        self.on_doubled: Callable[[], None] = lambda: None
        """Called if another run of this machine is older than this one."""

    def on_presence(self, process: str, *, there: bool) -> None:
        """React to a process of the run that has come, or is gone or out of reach."""
        if process == process_name(self.own, MAIN):
            self._on_double(there=there)
            return
        name = machine_of(process)
        machine = self._machines.get(name)
        if machine is None or process != process_name(name, MAIN) or machine.linked is there:
            return
        now_s = self._seconds()
        if not there:
            self._log.warning(f"the machine {name} is not linked any more; the nodes here go on without it")
        elif machine.was_linked:
            self._log.info(f"the machine {name} is linked again", after_s=round(now_s - machine.changed_s, 3))
        else:
            self._log.info(f"the machine {name} is linked")
        machine.linked, machine.changed_s, machine.reason = there, now_s, ""
        machine.was_linked = machine.was_linked or there
        self._changed.set()

    def on_version(self, process: str, version: str) -> None:
        """React to the version of busflow that a process of the run has; another one is logged as an error, once."""
        machine = self._machines.get(name := machine_of(process))
        if machine is None or process != process_name(name, MAIN) or machine.version == version:
            return
        machine.version, own = version, busflow.__version__
        if not work_together(own, version):
            shown = printable(version)
            self._log.error(
                f"the machine {name} has busflow {shown}, and this one {own}: they may misread each other; "
                "install one version on both"
            )

    def _on_double(self, *, there: bool) -> None:
        """React to another session with this machine's name: it is another run, or the token of a killed one."""
        if self._double_check is not None:
            self._double_check.cancel()
            self._double_check = None
        if there:
            now_s = self._seconds()
            limits = timeouts.current
            linked_s = [now_s - each.changed_s for each in self._machines.values() if each.linked]
            came_first = max(linked_s, default=0.0) > limits.machine_older
            react = self._report_double if came_first else self._end_run
            self._double_check = asyncio.get_running_loop().call_later(limits.machine_double, react)

    def _report_double(self) -> None:
        self._log.error(f"another run is started as the machine {self.own} too: one of the two has to end")

    def _end_run(self) -> None:
        self._log.error(f"another run is the machine {self.own} already: this one ends")
        self.on_doubled()

    def about(self) -> Mapping[str, Any]:
        """Return the states of the machines, as plain data for the answer to a query."""
        states = {
            name: {"linked": each.linked, "reason": each.reason, "version": each.version}
            for name, each in self._machines.items()
        }
        listen = self._spec.machines[self.own].listen
        return {"machine": self.own, "machines": states, "port": None if listen is None else listen.port}

    async def watch(self) -> None:
        """Log the reason why a machine is missing, each new reason once, until this task is cancelled."""
        wait_s = timeouts.current.machine_missing
        while True:
            self._changed.clear()
            try:
                async with asyncio.timeout(wait_s):
                    await self._changed.wait()
            except TimeoutError:
                wait_s = _CHECK_S
                for name, machine in self._machines.items():
                    if not machine.linked:
                        await self._check(name, machine)
            else:
                wait_s = timeouts.current.machine_missing

    async def _check(self, name: str, machine: _Machine) -> None:
        """Find out why a machine is missing, and log a new reason."""
        end = self._dialled.get(name)
        if end is None:
            listen = self._spec.machines[self.own].listen
            reason = f"it has not connected to {listen}: its run has not started, or it cannot reach this machine"
        else:
            reason = await why_not_linked(end, credentials_of(self._spec, self.own), name)
            reason = reason or f"{end} answers, but the link is not there yet"
        if not machine.linked and reason != machine.reason:
            machine.reason = reason
            self._log.warning(f"the machine {name} is not linked: {reason}")
