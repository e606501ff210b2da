"""Machines: the other machines of a run as this one sees them: linked or not, since when, and why not."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from busflow.launchfile.check.credentials import credentials_of
from busflow.launchfile.model.placement import MAIN, machine_of, process_name
from busflow.wire.machines.probe import why_not_linked
from busflow.wire.zenoh.network import Network

if TYPE_CHECKING:
    from structlog.typing import FilteringBoundLogger

    from busflow.launchfile.model.network import NetworkAddress, NetworkSpec

_FIRST_S = 0.5
"""Time for which a run must have been linked to count as older than another run of its machine."""
_LATE_S = 2.0
"""Time that a machine may take before the log says that it is missing."""
_NAMESAKE_S = 3.0
"""Time that another run of this machine's name may be seen: the token of a killed one goes sooner."""
_LOOK_S = 5.0
"""Interval at which the reason for a missing machine is looked for."""


@dataclass(slots=True)
class _Machine:
    """State of one machine."""

    linked: bool = False
    was_linked: bool = False
    changed_s: float = 0.0
    reason: str = ""
    """Last logged reason why the machine is not linked."""


class Machines:
    """Link states of a run's other machines; no node waits for them."""

    def __init__(self, spec: NetworkSpec, own: str, log: FilteringBoundLogger, seconds: Callable[[], float]) -> None:
        """Begin with no machine linked.

        Args:
            spec: all machines.
            own: which of them this is.
            log: receives each machine that links or is lost.
            seconds: the run's time.
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
        self._namesake: asyncio.TimerHandle | None = None
        self.on_doubled: Callable[[], None] = lambda: None
        """Callback for the case that another run was this machine before this one."""

    def on_presence(self, process: str, *, there: bool) -> None:
        """React to a process of the run that has come, or is gone or out of reach."""
        if process == process_name(self.own, MAIN):
            self._on_namesake(there=there)
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

    def _on_namesake(self, *, there: bool) -> None:
        """React to another session that claims to be this machine: another run, or the token of a killed one."""
        if self._namesake is not None:
            self._namesake.cancel()
            self._namesake = None
        if there:
            now_s = self._seconds()
            came_first = any(each.linked and now_s - each.changed_s > _FIRST_S for each in self._machines.values())
            judge = self._stay if came_first else self._give_way
            self._namesake = asyncio.get_running_loop().call_later(_NAMESAKE_S, judge)

    def _stay(self) -> None:
        self._log.error(f"another run says that it is the machine {self.own}: one of the two has to end")

    def _give_way(self) -> None:
        self._log.error(f"another run is the machine {self.own} already: this one ends")
        self.on_doubled()

    def about(self) -> Mapping[str, Any]:
        """Return the states of the machines, as the run answers queries."""
        states = {name: {"linked": each.linked, "reason": each.reason} for name, each in self._machines.items()}
        listen = self._spec.machines[self.own].listen
        return {"machine": self.own, "machines": states, "port": None if listen is None else listen.port}

    async def watch(self) -> None:
        """Log why each missing machine is missing, once for each reason, until this is cancelled."""
        wait_s = _LATE_S
        while True:
            self._changed.clear()
            try:
                async with asyncio.timeout(wait_s):
                    await self._changed.wait()
            except TimeoutError:
                wait_s = _LOOK_S
                for name, machine in self._machines.items():
                    if not machine.linked:
                        await self._look(name, machine)
            else:
                wait_s = _LATE_S

    async def _look(self, name: str, machine: _Machine) -> None:
        """Find out why a machine is missing, and log a new reason."""
        end = self._dialled.get(name)
        if end is None:
            listen = self._spec.machines[self.own].listen
            reason = f"it has not connected to {listen}: its run has not started, or it cannot get here"
        else:
            reason = await why_not_linked(end, credentials_of(self._spec, self.own), name)
            reason = reason or f"{end} answers, and is not linked yet"
        if not machine.linked and reason != machine.reason:
            machine.reason = reason
            self._log.warning(f"the machine {name} is not linked: {reason}")
