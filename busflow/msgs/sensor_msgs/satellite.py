"""Satellite navigation."""

from typing import Annotated, ClassVar

from busflow.interfaces.message import Float64Array, Length, Message, float64, int8, uint8, uint16, zeros
from busflow.msgs.std_msgs import Header


class NavSatStatus(Message, package="sensor_msgs"):
    """How a position was found. There is a position from STATUS_FIX upwards."""

    STATUS_UNKNOWN: ClassVar[int8] = -2
    STATUS_NO_FIX: ClassVar[int8] = -1
    STATUS_FIX: ClassVar[int8] = 0  # by navigation satellites alone
    STATUS_SBAS_FIX: ClassVar[int8] = 1  # with the help of further satellites
    STATUS_GBAS_FIX: ClassVar[int8] = 2  # with the help of stations on the ground

    status: int8 = -2

    SERVICE_UNKNOWN: ClassVar[uint16] = 0
    SERVICE_GPS: ClassVar[uint16] = 1
    SERVICE_GLONASS: ClassVar[uint16] = 2
    SERVICE_COMPASS: ClassVar[uint16] = 4  # BeiDou too
    SERVICE_GALILEO: ClassVar[uint16] = 8

    service: uint16 = 0
    """The SERVICE constants of the systems used, added up."""


class NavSatFix(Message, package="sensor_msgs"):
    """A position on the earth, by the WGS 84 ellipsoid."""

    header: Header = Header()
    """`frame_id` is the antenna's frame on the vehicle."""
    status: NavSatStatus = NavSatStatus()
    latitude: float64 = 0.0
    """°, north is positive."""
    longitude: float64 = 0.0
    """°, east is positive."""
    altitude: float64 = 0.0
    """m above the ellipsoid; NaN where unknown."""
    position_covariance: Annotated[Float64Array, Length(9)] = zeros(9)
    """3 × 3 by rows: east, north, up, m²."""

    COVARIANCE_TYPE_UNKNOWN: ClassVar[uint8] = 0
    COVARIANCE_TYPE_APPROXIMATED: ClassVar[uint8] = 1
    COVARIANCE_TYPE_DIAGONAL_KNOWN: ClassVar[uint8] = 2
    COVARIANCE_TYPE_KNOWN: ClassVar[uint8] = 3

    position_covariance_type: uint8 = 0
    """How much of the covariance is known: one of the constants."""
