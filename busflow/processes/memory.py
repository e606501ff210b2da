"""Memory: what a process's nodes were told while they ran, kept by the main process for their next life."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from busflow.bus.failure import is_failure
from busflow.errors import InvalidParameter
from busflow.node.parameter_store import ParameterStore
from busflow.node.parameters import validate
from busflow.runner.supervisor import built_anew
from busflow.text import printable
from busflow.validation.faults import plain

if TYPE_CHECKING:
    from busflow.bus.bus import Attached, Bus
    from busflow.launchfile.check.member import Member
    from busflow.launchfile.check.preflight import Plan
    from busflow.log import Log
    from busflow.node.parameter_store import SetResult
    from busflow.node.parameters import Parameters


@dataclass(frozen=True, slots=True)
class Memory:
    """What is known of the nodes of a process that had a life before."""

    parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict[str, Mapping[str, Any]])
    """By node, of those of which something was set at run time: `{values, set, times}`, as `tell_changes` tells it."""
    lives: Mapping[str, int] = field(default_factory=dict[str, int])
    """By node, how many lives it had: those of the process, and its own restarts in each of them."""

    def brought_back(self, plan: Plan, log: Log) -> list[Member]:
        """The members of a plan, each as it was when it died."""
        return [self._brought_back(member, log) for member in plan.members]

    def _brought_back(self, member: Member, log: Log) -> Member:
        name = member.runtime.full_name
        told, life = self.parameters.get(name), self.lives.get(name, 0)
        former: Parameters = member.runtime.node.parameters
        try:
            parameters: Parameters = former if told is None else validate(type(former), told["values"])
            runtime = built_anew(member.runtime, parameters, life)
        except BaseException as error:  # the code of a node may have been edited since, and may raise anything
            if not is_failure(error):
                raise
            why = str(error) if isinstance(error, InvalidParameter) else f"{type(error).__name__}: {printable(error)}"
            log.bind(name).warning("what was set at run time fits no more; it is as in the launch file", reason=why)
            return replace(member, node=built_anew(member.runtime, former, life).node)
        if told is not None:
            runtime.parameters.remember(told["set"], told["times"])
        return replace(member, node=runtime.node)


def tell_changes(bus: Bus, say: Callable[[Mapping[str, Any]], None]) -> None:
    """Say, as it happens, how the parameters of a node on this bus stand after a change."""

    def attached(end: Attached) -> None:
        if not isinstance(end, ParameterStore):
            return

        def changed(_old: Parameters, _result: SetResult) -> None:
            say({end.node: {"values": plain(end.current), "set": sorted(end.set_at_run_time), "times": end.times_set}})

        end.on_change.append(changed)

    bus.on_attach.append(attached)
