"""`rosgraph_msgs`: the clock of a simulation."""

from busflow.interfaces.message import Message
from busflow.msgs.builtin_interfaces import Time

__all__ = ["Clock"]


class Clock(Message, package="rosgraph_msgs"):
    """The time of a simulation, as published on `/clock`."""

    clock: Time = Time()
