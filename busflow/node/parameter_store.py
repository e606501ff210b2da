"""ParameterStore: the parameters of one node while it runs: what each is, where it came from, and setting them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, Protocol

from pydantic import BaseModel

from busflow.bus.timer import Timer, checked_period
from busflow.errors import Fault, InvalidDeclaration, InvalidParameter, Place
from busflow.node.parameters import ParameterInfo, Parameters, describe, unknown, value_of, with_changes
from busflow.validation.faults import same, shown


@dataclass(frozen=True, slots=True)
class ValueSource:
    """The source of a value: in words, and the place in a file."""

    text: str
    place: Place | None = None

    def __str__(self) -> str:
        return self.text


DEFAULT = ValueSource("default")
CODE = ValueSource("code")
"""Python code built the node with it."""
RUN_TIME = ValueSource("set at run time")


@dataclass(frozen=True, slots=True)
class LiveParameter:
    """One parameter of a node as it stands now; a nested one has a dotted name."""

    info: ParameterInfo
    """The declaration of a parameter: type, default, range, choices, description, read-only or not."""
    value: object
    """Plain data, as a file would hold it."""
    source: ValueSource

    @property
    def name(self) -> str:
        """Its dotted name."""
        return self.info.name


@dataclass(frozen=True, slots=True)
class ParameterChange:
    """One parameter that got another value; None is a parameter of an optional group that is not there."""

    name: str
    old: object
    new: object


@dataclass(frozen=True, slots=True)
class SetResult:
    """The result of setting parameters: the changes, or why there are none."""

    changed: tuple[ParameterChange, ...] = ()
    """Empty also where every value was the old one."""
    faults: tuple[Fault, ...] = ()
    """The reasons for a refusal; empty if the set was accepted."""

    @property
    def reason(self) -> str | None:
        """The reason for a refusal in one line; None if the set was accepted."""
        return str(InvalidParameter(self.faults)) if self.faults else None


@dataclass(frozen=True, slots=True)
class _Pace:
    """A timer whose period a parameter decides."""

    parameter: str
    period: Callable[[object], Fraction]
    timer: Timer


class Holder(Protocol):
    """The owner of parameters: a node."""

    parameters: Any


class ParameterStore:
    """The parameters of `node.parameters` one by one; only this class replaces that attribute.

    The node's own attribute is the truth; a restart builds the node from it. Everything here belongs
    to the thread of the graph's event loop.
    """

    def __init__(self, holder: Holder, node: str) -> None:
        self.node = node
        """The node's full name."""
        self._holder = holder
        self._first: Parameters = holder.parameters  # a set states every field, this one only what was given
        self.stated: Callable[[str], ValueSource | None] = lambda _name: None
        """The source of each parameter, by dotted name; from the node's surroundings."""
        self.on_change: list[Callable[[Parameters, SetResult], None]] = []
        """Listeners to a change, called just after it with the parameters before it."""
        self.is_shown: bool = False
        """Whether other processes see the parameters."""
        self.times_set: int = 0
        """The number of changes."""
        self._paces: list[_Pace] = []
        self._set_at_run_time: set[str] = set()

    @property
    def current(self) -> Parameters:
        """The parameters as the node sees them."""
        return self._holder.parameters

    @cached_property
    def infos(self) -> dict[str, ParameterInfo]:
        """The declared parameters by dotted name, in the order of declaration."""
        return {info.name: info for info in describe(type(self.current))}

    def describe(self) -> tuple[LiveParameter, ...]:
        """Return every parameter with its value and its source, in the order of declaration."""
        return tuple(self.get(name) for name in self.infos)

    def get(self, name: str) -> LiveParameter:
        """Return one parameter by its dotted name.

        Raises:
            InvalidParameter: there is none of that name; the message says which is nearest.
        """
        info = self.infos.get(name)
        if info is None:
            raise unknown(name, self.infos)
        return LiveParameter(info, value_of(self.current, name), self._source(name))

    def set(self, changes: Mapping[str, object]) -> SetResult:
        """Set parameters, all of them or none, by dotted or nested names.

        The whole is validated first. Then `node.parameters` is replaced, timers that a parameter paces begin a new
        grid, and listeners are called, all before this returns. Values that are the old ones change nothing.
        """
        old = self.current
        try:
            new = with_changes(old, changes)
        except InvalidParameter as refused:
            return SetResult(faults=refused.faults)
        changed = tuple(self._changes(old, new))
        names = {change.name for change in changed}
        paces = [pace for pace in self._paces if pace.parameter in names]
        faults = (*self._read_only_faults(changed), *_pace_faults(paces, new))
        if faults or not changed:
            return SetResult(faults=faults)
        self._holder.parameters = new
        self.times_set += 1
        self._set_at_run_time |= names
        for pace in paces:
            pace.timer.period_s = pace.period(new)
        result = SetResult(changed)
        for listener in self.on_change:
            listener(old, result)
        return result

    def pace(self, timer: Timer, parameter: str, period: Callable[[object], Fraction]) -> None:
        """Let a parameter decide a timer's period from now on."""
        self._paces.append(_Pace(parameter, period, timer))

    @property
    def set_at_run_time(self) -> frozenset[str]:
        """The names of all that were changed since the run began, also in an earlier life of the node."""
        return frozenset(self._set_at_run_time)

    def take_over(self, former: ParameterStore) -> None:
        """Go on counting where the store of the node's former instance ended."""
        self.times_set = former.times_set
        self._first = former._first
        self._set_at_run_time = set(former._set_at_run_time)

    def remember(self, names: Iterable[str], times_set: int) -> None:
        """Record that these were changed in an earlier life of the node's process."""
        self._set_at_run_time |= set(names) & self.infos.keys()
        self.times_set += times_set

    def _source(self, name: str) -> ValueSource:
        if name in self._set_at_run_time:
            return RUN_TIME
        return self.stated(name) or (CODE if _is_stated(self._first, name) else DEFAULT)

    def _changes(self, old: Parameters, new: Parameters) -> Iterator[ParameterChange]:
        for name in self.infos:
            before, after = value_of(old, name), value_of(new, name)
            if not same(before, after):
                yield ParameterChange(name, before, after)

    def _read_only_faults(self, changed: tuple[ParameterChange, ...]) -> Iterator[Fault]:
        for change in changed:
            if self.infos[change.name].read_only:
                text = f"{change.name} is read-only: it stays {shown(change.old)} while the node runs"
                yield Fault(tuple(change.name.split(".")), text, "change it in the launch file", "read-only")


def _pace_faults(paces: list[_Pace], parameters: Parameters) -> Iterator[Fault]:
    """Yield the timers that could not tick as these parameters say."""
    for pace in paces:
        try:
            checked_period(pace.period(parameters), pace.timer.name)
        except InvalidDeclaration as error:
            value = shown(value_of(parameters, pace.parameter))
            yield Fault(tuple(pace.parameter.split(".")), f"{pace.parameter} cannot be {value}: {error}", None, "range")


def _is_stated(parameters: BaseModel, name: str) -> bool:
    """Return whether the constructor of the parameters gave this one a value."""
    found: Any = parameters
    for step in name.split("."):
        if not isinstance(found, BaseModel) or step not in found.model_fields_set:
            return False
        found = getattr(found, step)
    return True
