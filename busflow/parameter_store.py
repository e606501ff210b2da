"""ParameterStore: the parameters of one node while it runs: what each is and where its value came from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from busflow.errors import Fault, InvalidParameter, Place
from busflow.parameters import ParameterInfo, Parameters, describe
from busflow.text import did_you_mean
from busflow.validation import plain

if TYPE_CHECKING:
    from busflow.node import Node


@dataclass(frozen=True, slots=True)
class ValueSource:
    """Where a value came from: in words, and the place where a file states it."""

    text: str
    place: Place | None = None

    def __str__(self) -> str:
        return self.text


DEFAULT = ValueSource("default")
CODE = ValueSource("code")
"""Python code built the node with it."""


@dataclass(frozen=True, slots=True)
class LiveParameter:
    """One parameter of a node as it stands now; a nested one has a dotted name."""

    info: ParameterInfo
    """What is declared: type, default, range, choices, description, whether it is read-only."""
    value: object
    """Plain data, as a file would hold it."""
    source: ValueSource

    @property
    def name(self) -> str:
        """Its dotted name."""
        return self.info.name


class ParameterStore:
    """What `node.parameters` holds, parameter by parameter.

    The node's own attribute is the truth; whoever builds the node anew builds it from that.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self.stated: Callable[[str], ValueSource | None] = lambda _name: None
        """Who stated a parameter for the run, by its dotted name; the node's surroundings tell."""

    @property
    def current(self) -> Parameters:
        """The parameters as the node sees them."""
        return self._node.parameters

    @cached_property
    def infos(self) -> dict[str, ParameterInfo]:
        """What is declared, by dotted name, in the order of declaration."""
        return {info.name: info for info in describe(type(self.current))}

    def describe(self) -> tuple[LiveParameter, ...]:
        """Every parameter with its value and its source, in the order of declaration."""
        return tuple(self.get(name) for name in self.infos)

    def get(self, name: str) -> LiveParameter:
        """One parameter by its dotted name.

        Raises:
            InvalidParameter: there is none of that name; the message says which is nearest.
        """
        info = self.infos.get(name)
        if info is None:
            fix = did_you_mean(name, self.infos)
            raise InvalidParameter([Fault(tuple(name.split(".")), f"unknown parameter {name}", fix, "unknown")])
        return LiveParameter(info, _value(self.current, name), self._source(name))

    def _source(self, name: str) -> ValueSource:
        return self.stated(name) or (CODE if _is_stated(self.current, name) else DEFAULT)


def _value(parameters: BaseModel, name: str) -> Any:
    """What a dotted name stands for, as plain data; None inside an optional group that is not there."""
    found: Any = parameters
    for step in name.split("."):
        found = getattr(found, step, None)
    return plain(found)


def _is_stated(parameters: BaseModel, name: str) -> bool:
    """Whether whoever constructed the parameters gave this one a value."""
    found: Any = parameters
    for step in name.split("."):
        if not isinstance(found, BaseModel) or step not in found.model_fields_set:
            return False
        found = getattr(found, step)
    return True
