"""`sensor_msgs`: what sensors measure, one file per kind of sensor."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

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


def __getattr__(name: str) -> Any:
    """Import the file of a type when it is first named (PEP 562): reading an Imu needs no camera."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*globals(), *__all__]
