"""The surroundings: pressure, light, humidity, temperature, and other clocks. A variance of 0 means unknown."""

from busflow.interfaces.message import Message, float64
from busflow.msgs.builtin_interfaces import Time
from busflow.msgs.std_msgs import Header


class FluidPressure(Message, package="sensor_msgs"):
    """The absolute pressure of air, water or another fluid."""

    header: Header = Header()
    fluid_pressure: float64 = 0.0
    """Pa."""
    variance: float64 = 0.0
    """Pa²."""


class Illuminance(Message, package="sensor_msgs"):
    """How bright light is to the human eye where it falls on the sensor, along the sensor's x axis."""

    header: Header = Header()
    illuminance: float64 = 0.0
    """lx, 0 or more."""
    variance: float64 = 0.0
    """lx²."""


class RelativeHumidity(Message, package="sensor_msgs"):
    """How close the air is to being saturated with water."""

    header: Header = Header()
    relative_humidity: float64 = 0.0
    """0 is dry, 1 is saturated."""
    variance: float64 = 0.0


class Temperature(Message, package="sensor_msgs"):
    """A temperature."""

    header: Header = Header()
    temperature: float64 = 0.0
    """°C."""
    variance: float64 = 0.0
    """°C²."""


class TimeReference(Message, package="sensor_msgs"):
    """What another clock showed, one that nothing keeps in step with this computer's."""

    header: Header = Header()
    """`stamp` is this computer's time then; `frame_id` means nothing."""
    time_ref: Time = Time()
    """The other clock's time."""
    source: str = ""
    """What clock it is."""
