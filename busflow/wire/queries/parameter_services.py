"""ParameterServices: ROS 2's six services to list, read and set parameters, answered from a node's store.

The behaviour is rclpy's: where one of the names does not exist, the lists in the response are empty, by which
`ros2 param get` fails, and depth counts the parts of a name below a prefix.

Source: ros2/rclpy 8.0, `parameter_service.py`; ros2/ros2cli 0.36, `ros2param/verb/get.py`.
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

    def __init__(self, store: ParameterStore, *, is_for_ros2: bool = False) -> None:
        """Create the services; where nodes of ROS 2 take part, a node without parameters has them too.

        `ros2 param list` waits five seconds for those of each node.
        """
        self._store, self._is_offered = store, is_for_ros2 or bool(store.infos)

    def all(self) -> Iterator[tuple[str, type[ServiceType], Answer]]:
        """Yield each service's final name, its type and its handler."""
        if not self._is_offered:
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
        found = self._found(request.names)
        return GetParameters.Response(values=[value_message(each.value, each.info) for each in found])

    def types(self, request: GetParameterTypes.Request) -> GetParameterTypes.Response:
        """Return the types of parameters."""
        found = self._found(request.names)
        return GetParameterTypes.Response(types=[type_of(each.value, each.info) for each in found])

    def describe(self, request: DescribeParameters.Request) -> DescribeParameters.Response:
        """Return the descriptions of parameters."""
        found = self._found(request.names)
        return DescribeParameters.Response(descriptors=[descriptor_message(each.info, each.value) for each in found])

    def set(self, request: SetParameters.Request) -> SetParameters.Response:
        """Set parameters one after another, each independently."""
        return SetParameters.Response(results=[self._set([each]) for each in request.parameters])

    def set_atomically(self, request: SetParametersAtomically.Request) -> SetParametersAtomically.Response:
        """Set parameters together: all of them or none."""
        return SetParametersAtomically.Response(result=self._set(request.parameters))

    def _found(self, names: Sequence[str]) -> list[LiveParameter]:
        """Return the parameters of these names, or none at all if one of them does not exist."""
        exist = self._store.infos.keys() >= set(names)
        return [self._store.get(name) for name in names] if exist else []

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


def _listed(name: str, prefixes: Sequence[str], depth: int) -> bool:
    """Return whether a name is a prefix or at most `depth` parts below one; without any, below the root.

    >>> [_listed("noise.imu", prefixes, depth) for prefixes, depth in [((), 1), ((), 2), (("noise",), 1), (("no",), 1)]]
    [False, True, True, False]
    """
    if not prefixes:
        return name.count(".") < depth
    below = [name.removeprefix(f"{each}.") for each in prefixes if name.startswith(f"{each}.")]
    return name in prefixes or any(rest.count(".") < depth for rest in below)
