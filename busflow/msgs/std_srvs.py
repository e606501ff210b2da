"""`std_srvs`: services that switch or trigger something."""

from busflow.interfaces.message import Message, ServiceType

__all__ = ["Empty", "SetBool", "Trigger"]


class Empty(ServiceType, package="std_srvs"):
    """Triggers an action, without a result."""

    class Request(Message):
        """Nothing."""

    class Response(Message):
        """Nothing, but that it is over."""


class SetBool(ServiceType, package="std_srvs"):
    """Switches something on or off."""

    class Request(Message):
        """The switch."""

        data: bool = False

    class Response(Message):
        """Whether it worked."""

        success: bool = False
        message: str = ""
        """For people: why it did not work, for one."""


class Trigger(ServiceType, package="std_srvs"):
    """Triggers something."""

    class Request(Message):
        """Nothing."""

    class Response(Message):
        """Whether it worked."""

        success: bool = False
        message: str = ""
        """For people: why it did not work, for one."""
