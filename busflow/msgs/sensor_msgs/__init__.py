"""`sensor_msgs`: what sensors measure, one file per kind of sensor."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from busflow.msgs import read_on_demand

if TYPE_CHECKING:
    from busflow.msgs.sensor_msgs.camera import CameraInfo, CompressedImage, Image, RegionOfInterest, SetCameraInfo
    from busflow.msgs.sensor_msgs.environment import (
        FluidPressure,
        Illuminance,
        RelativeHumidity,
        Temperature,
        TimeReference,
    )
    from busflow.msgs.sensor_msgs.joystick import Joy, JoyFeedback, JoyFeedbackArray
    from busflow.msgs.sensor_msgs.motion import Imu, JointState, MagneticField
    from busflow.msgs.sensor_msgs.multi_dof import MultiDOFJointState
    from busflow.msgs.sensor_msgs.points import ChannelFloat32, PointCloud, PointCloud2, PointField
    from busflow.msgs.sensor_msgs.power import BatteryState
    from busflow.msgs.sensor_msgs.ranging import LaserEcho, LaserScan, MultiEchoLaserScan, Range
    from busflow.msgs.sensor_msgs.satellite import NavSatFix, NavSatStatus

_KINDS = {
    "camera": ("CameraInfo", "CompressedImage", "Image", "RegionOfInterest", "SetCameraInfo"),
    "environment": ("FluidPressure", "Illuminance", "RelativeHumidity", "Temperature", "TimeReference"),
    "joystick": ("Joy", "JoyFeedback", "JoyFeedbackArray"),
    "motion": ("Imu", "JointState", "MagneticField"),
    "multi_dof": ("MultiDOFJointState",),
    "points": ("ChannelFloat32", "PointCloud", "PointCloud2", "PointField"),
    "power": ("BatteryState",),
    "ranging": ("LaserEcho", "LaserScan", "MultiEchoLaserScan", "Range"),
    "satellite": ("NavSatFix", "NavSatStatus"),
}
_HOMES = {name: kind for kind, names in _KINDS.items() for name in names}

__all__ = [
    "BatteryState",
    "CameraInfo",
    "ChannelFloat32",
    "CompressedImage",
    "FluidPressure",
    "Illuminance",
    "Image",
    "Imu",
    "JointState",
    "Joy",
    "JoyFeedback",
    "JoyFeedbackArray",
    "LaserEcho",
    "LaserScan",
    "MagneticField",
    "MultiDOFJointState",
    "MultiEchoLaserScan",
    "NavSatFix",
    "NavSatStatus",
    "PointCloud",
    "PointCloud2",
    "PointField",
    "Range",
    "RegionOfInterest",
    "RelativeHumidity",
    "SetCameraInfo",
    "Temperature",
    "TimeReference",
]


__getattr__: Callable[[str], Any] = read_on_demand(__name__, _HOMES)  # reading an Imu needs no camera


def __dir__() -> list[str]:
    return [*globals(), *__all__]
