"""ParameterServices: ROS 2's six services to list, read and set parameters, answered from a node's store.

Where the interface files leave the behaviour open, it is rclpy's: a parameter that does not exist has the type
PARAMETER_NOT_SET, and depth counts the parts of a name below a prefix.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from busflow.errors import BusflowError
from busflow.interfaces.message import Message, ServiceType
from busflow.msgs.rcl_interfaces import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    ListParametersResult,
    Parameter,
    ParameterDescriptor,
    ParameterValue,
    SetParameters,
    SetParametersAtomically,
    SetParametersResult,
)
from busflow.node.parameter_messages import descriptor_message, plain_value, type_of, value_message

if TYPE_CHECKING:
    from busflow.node.parameter_store import LiveParameter, ParameterStore, SetResult

Answer = Callable[[Any], Awaitable[Message]]


class ParameterServices:
    """The parameter services of one node. Every method takes a request and returns the response."""

    def __init__(self, store: ParameterStore) -> None:
        self._store = store

    def all(self) -> Iterator[tuple[str, type[ServiceType], Answer]]:
        """Yield each service's final name, its type and its handler; nothing for a node without parameters."""
        if not self._store.infos:
            return
        answers: Mapping[str, tuple[type[ServiceType], Callable[[Any], Message]]] = {
            "list_parameters": (ListParameters, self.list),
            "get_parameters": (GetParameters, self.get),
            "get_parameter_types": (GetParameterTypes, self.types),
            "describe_parameters": (DescribeParameters, self.describe),
            "set_parameters": (SetParameters, self.set),
            "set_parameters_atomically": (SetParametersAtomically, self.set_atomically),
        }
        for name, (service_type, answer) in answers.items():
            yield f"{self._store.node}/{name}", service_type, _awaitable(answer)

    def list(self, request: ListParameters.Request) -> ListParameters.Response:
        """List the parameters below some prefixes."""
        names = [name for name in self._store.infos if _listed(name, request.prefixes, request.depth or len(name) + 1)]
        prefixes = dict.fromkeys(name.rpartition(".")[0] for name in names if "." in name)
        return ListParameters.Response(result=ListParametersResult(names=names, prefixes=tuple(prefixes)))

    def get(self, request: GetParameters.Request) -> GetParameters.Response:
        """Return the values of parameters."""
        return GetParameters.Response(values=[_value(self._find(name)) for name in request.names])

    def types(self, request: GetParameterTypes.Request) -> GetParameterTypes.Response:
        """Return the types of parameters."""
        found = [self._find(name) for name in request.names]
        return GetParameterTypes.Response(
            types=[0 if each is None else type_of(each.value, each.info) for each in found]
        )

    def describe(self, request: DescribeParameters.Request) -> DescribeParameters.Response:
        """Return the descriptions of parameters."""
        found = [(name, self._find(name)) for name in request.names]
        return DescribeParameters.Response(
            descriptors=[
                ParameterDescriptor(name=name) if each is None else descriptor_message(each.info, each.value)
                for name, each in found
            ]
        )

    def set(self, request: SetParameters.Request) -> SetParameters.Response:
        """Set parameters one after another, each independently."""
        return SetParameters.Response(results=[self._set([each]) for each in request.parameters])

    def set_atomically(self, request: SetParametersAtomically.Request) -> SetParametersAtomically.Response:
        """Set parameters together: all of them or none."""
        return SetParametersAtomically.Response(result=self._set(request.parameters))

    def _find(self, name: str) -> LiveParameter | None:
        return self._store.get(name) if name in self._store.infos else None

    def _set(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        try:
            result: SetResult = self._store.set({each.name: plain_value(each.value) for each in parameters})
        except BusflowError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=not result.faults, reason=result.reason or "")


def _awaitable(answer: Callable[[Any], Message]) -> Answer:
    async def ask(request: Message) -> Message:
        return answer(request)

    return ask


def _value(parameter: LiveParameter | None) -> ParameterValue:
    return ParameterValue() if parameter is None else value_message(parameter.value, parameter.info)


def _listed(name: str, prefixes: Sequence[str], depth: int) -> bool:
    """Return whether a name is a prefix or at most `depth` parts below one; without any, below the root.

    >>> [_listed("noise.imu", prefixes, depth) for prefixes, depth in [((), 1), ((), 2), (("noise",), 1), (("no",), 1)]]
    [False, True, True, False]
    """
    if not prefixes:
        return name.count(".") < depth
    below = [name.removeprefix(f"{each}.") for each in prefixes if name.startswith(f"{each}.")]
    return name in prefixes or any(rest.count(".") < depth for rest in below)
