"""Header: the time and the frame of a stamped message; a colour, and a message that only says "now"."""

from busflow.interfaces.message import Message, float32
from busflow.msgs.builtin_interfaces import Time


class Header(Message, package="std_msgs"):
    """The time and frame of the measurement in a message."""

    stamp: Time = Time()
    """The time of the measurement, not of sending."""
    frame_id: str = ""
    """The coordinate frame of the data."""


class Empty(Message, package="std_msgs"):
    """Nothing but the fact that it was published."""


class ColorRGBA(Message, package="std_msgs"):
    """A colour: red, green, blue and opacity, each from 0 to 1."""

    r: float32 = 0.0
    g: float32 = 0.0
    b: float32 = 0.0
    a: float32 = 0.0
