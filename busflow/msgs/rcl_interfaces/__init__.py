"""`rcl_interfaces`: parameters, logs and log levels of running nodes, as ROS 2's tools ask for them."""

from busflow.msgs.rcl_interfaces.logging import (
    GetLoggerLevels,
    Log,
    LoggerLevel,
    SetLoggerLevels,
    SetLoggerLevelsResult,
)
from busflow.msgs.rcl_interfaces.parameters import (
    FloatingPointRange,
    IntegerRange,
    ListParametersResult,
    Parameter,
    ParameterDescriptor,
    ParameterEvent,
    ParameterEventDescriptors,
    ParameterType,
    ParameterValue,
    SetParametersResult,
)
from busflow.msgs.rcl_interfaces.services import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)

__all__ = [
    "DescribeParameters",
    "FloatingPointRange",
    "GetLoggerLevels",
    "GetParameterTypes",
    "GetParameters",
    "IntegerRange",
    "ListParameters",
    "ListParametersResult",
    "Log",
    "LoggerLevel",
    "Parameter",
    "ParameterDescriptor",
    "ParameterEvent",
    "ParameterEventDescriptors",
    "ParameterType",
    "ParameterValue",
    "SetLoggerLevels",
    "SetLoggerLevelsResult",
    "SetParameters",
    "SetParametersAtomically",
    "SetParametersResult",
]
