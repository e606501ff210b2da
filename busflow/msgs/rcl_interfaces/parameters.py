"""Parameters: their values, their descriptions and what happens to them."""

from collections.abc import Sequence
from typing import Annotated, ClassVar

from busflow.interfaces.message import (
    BoolArray,
    ByteArray,
    Float64Array,
    Int64Array,
    Length,
    Message,
    float64,
    int64,
    uint8,
    uint64,
    zeros,
)
from busflow.msgs.builtin_interfaces import Time


class ParameterType(Message, package="rcl_interfaces"):
    """The types that a parameter can have. The message itself is empty; its constants matter."""

    PARAMETER_NOT_SET: ClassVar[uint8] = 0
    PARAMETER_BOOL: ClassVar[uint8] = 1
    PARAMETER_INTEGER: ClassVar[uint8] = 2
    PARAMETER_DOUBLE: ClassVar[uint8] = 3
    PARAMETER_STRING: ClassVar[uint8] = 4
    PARAMETER_BYTE_ARRAY: ClassVar[uint8] = 5
    PARAMETER_BOOL_ARRAY: ClassVar[uint8] = 6
    PARAMETER_INTEGER_ARRAY: ClassVar[uint8] = 7
    PARAMETER_DOUBLE_ARRAY: ClassVar[uint8] = 8
    PARAMETER_STRING_ARRAY: ClassVar[uint8] = 9


class ParameterValue(Message, package="rcl_interfaces"):
    """The value of a parameter: `type` says which of the other fields holds it."""

    type: uint8 = 0
    """A constant of ParameterType."""
    bool_value: bool = False
    integer_value: int64 = 0
    double_value: float64 = 0.0
    string_value: str = ""
    byte_array_value: ByteArray = zeros()
    bool_array_value: BoolArray = zeros()
    integer_array_value: Int64Array = zeros()
    double_array_value: Float64Array = zeros()
    string_array_value: Sequence[str] = ()


class Parameter(Message, package="rcl_interfaces"):
    """A parameter and its value."""

    name: str = ""
    """Its full name, with dots between the parts."""
    value: ParameterValue = ParameterValue()


class FloatingPointRange(Message, package="rcl_interfaces"):
    """The numbers that a parameter may take. Both ends belong to it, whatever the step."""

    from_value: float64 = 0.0
    to_value: float64 = 0.0
    step: float64 = 0.0
    """From one allowed number to the next, counted from `from_value`; 0 allows all, the sign does not matter."""


class IntegerRange(Message, package="rcl_interfaces"):
    """The integers that a parameter may take. Both ends belong to it, whatever the step."""

    from_value: int64 = 0
    to_value: int64 = 0
    step: uint64 = 0
    """From one allowed integer to the next, counted from `from_value`; 0 allows all."""


class ParameterDescriptor(Message, package="rcl_interfaces"):
    """What there is to know about a parameter besides its value."""

    name: str = ""
    type: uint8 = 0
    """A constant of ParameterType."""
    description: str = ""
    """For people."""
    additional_constraints: str = ""
    """For people: what the ranges cannot express."""
    read_only: bool = False
    """Whether it keeps its first value."""
    dynamic_typing: bool = False
    """Whether it may change its type."""
    floating_point_range: Annotated[Sequence[FloatingPointRange], Length(max=1)] = ()
    """The range of a double; empty where all are allowed."""
    integer_range: Annotated[Sequence[IntegerRange], Length(max=1)] = ()
    """The range of an integer; empty where all are allowed."""


class ParameterEvent(Message, package="rcl_interfaces"):
    """Which parameters of a node changed at one stroke, as published on `/parameter_events`.

    A name is in one of the three sequences at most.
    """

    stamp: Time = Time()
    node: str = ""
    """The node's full name."""
    new_parameters: Sequence[Parameter] = ()
    changed_parameters: Sequence[Parameter] = ()
    deleted_parameters: Sequence[Parameter] = ()


class ParameterEventDescriptors(Message, package="rcl_interfaces"):
    """The descriptions of parameters that changed at one stroke. A name is in one sequence at most."""

    new_parameters: Sequence[ParameterDescriptor] = ()
    changed_parameters: Sequence[ParameterDescriptor] = ()
    deleted_parameters: Sequence[ParameterDescriptor] = ()


class ListParametersResult(Message, package="rcl_interfaces"):
    """The parameters found below some prefixes."""

    names: Sequence[str] = ()
    prefixes: Sequence[str] = ()
    """The prefixes of those names."""


class SetParametersResult(Message, package="rcl_interfaces"):
    """Whether a parameter took its value."""

    successful: bool = False
    reason: str = ""
    """Why not, for people."""
