"""`tf2_msgs`: the tree of frames. Its action, LookupTransform, is left out: there are no actions yet."""

from collections.abc import Sequence
from typing import ClassVar

from busflow.interfaces.message import Message, ServiceType, uint8
from busflow.msgs.geometry_msgs import TransformStamped

__all__ = ["FrameGraph", "TF2Error", "TFMessage"]


class TFMessage(Message, package="tf2_msgs"):
    """Some edges of the tree, as published on `/tf` and `/tf_static`."""

    transforms: Sequence[TransformStamped] = ()


class TF2Error(Message, package="tf2_msgs"):
    """Why a transform could not be had."""

    NO_ERROR: ClassVar[uint8] = 0
    LOOKUP_ERROR: ClassVar[uint8] = 1  # a frame is not known
    CONNECTIVITY_ERROR: ClassVar[uint8] = 2  # the frames belong to trees apart
    EXTRAPOLATION_ERROR: ClassVar[uint8] = 3  # the time is outside what is known
    INVALID_ARGUMENT_ERROR: ClassVar[uint8] = 4
    TIMEOUT_ERROR: ClassVar[uint8] = 5
    TRANSFORM_ERROR: ClassVar[uint8] = 6

    error: uint8 = 0
    """One of the constants."""
    error_string: str = ""


class FrameGraph(ServiceType, package="tf2_msgs"):
    """Asks for the whole tree."""

    class Request(Message):
        """Nothing."""

    class Response(Message):
        """The tree."""

        frame_yaml: str = ""
        """As YAML, for people."""
