"""The services with which the parameters of a node are listed, read and set."""

from collections.abc import Sequence
from typing import ClassVar

from busflow.interfaces.message import Message, ServiceType, UInt8Array, uint64, zeros
from busflow.msgs.rcl_interfaces.parameters import (
    ListParametersResult,
    Parameter,
    ParameterDescriptor,
    ParameterValue,
    SetParametersResult,
)


class DescribeParameters(ServiceType, package="rcl_interfaces"):
    """Asks for the descriptions of parameters."""

    class Request(Message):
        """Which parameters."""

        names: Sequence[str] = ()

    class Response(Message):
        """Their descriptions."""

        descriptors: Sequence[ParameterDescriptor] = ()
        """In the order asked."""


class GetParameters(ServiceType, package="rcl_interfaces"):
    """Asks for the values of parameters."""

    class Request(Message):
        """Which parameters."""

        names: Sequence[str] = ()

    class Response(Message):
        """Their values."""

        values: Sequence[ParameterValue] = ()
        """In the order asked; PARAMETER_NOT_SET where there is none."""


class GetParameterTypes(ServiceType, package="rcl_interfaces"):
    """Asks for the types of parameters."""

    class Request(Message):
        """Which parameters."""

        names: Sequence[str] = ()

    class Response(Message):
        """Their types."""

        types: UInt8Array = zeros()
        """Constants of ParameterType in the order asked; PARAMETER_NOT_SET where there is none."""


class ListParameters(ServiceType, package="rcl_interfaces"):
    """Asks what parameters there are."""

    class Request(Message):
        """Where to look, and how deep."""

        DEPTH_RECURSIVE: ClassVar[uint64] = 0

        prefixes: Sequence[str] = ()
        """Where to look; everywhere when empty."""
        depth: uint64 = 0
        """How many parts a name may have below a prefix; DEPTH_RECURSIVE for any number."""

    class Response(Message):
        """What there is."""

        result: ListParametersResult = ListParametersResult()


class SetParameters(ServiceType, package="rcl_interfaces"):
    """Sets parameters one after another."""

    class Request(Message):
        """The parameters with their new values."""

        parameters: Sequence[Parameter] = ()

    class Response(Message):
        """What came of each."""

        results: Sequence[SetParametersResult] = ()
        """In the order asked."""


class SetParametersAtomically(ServiceType, package="rcl_interfaces"):
    """Sets parameters at one stroke: all of them or none."""

    class Request(Message):
        """The parameters with their new values."""

        parameters: Sequence[Parameter] = ()

    class Response(Message):
        """What came of it."""

        result: SetParametersResult = SetParametersResult()
