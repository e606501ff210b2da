"""`sensor_msgs`: what sensors measure, one file per kind of sensor."""

from busflow.msgs.sensor_msgs.camera import CameraInfo, CompressedImage, Image, RegionOfInterest, SetCameraInfo
from busflow.msgs.sensor_msgs.environment import (
    FluidPressure,
    Illuminance,
    RelativeHumidity,
    Temperature,
    TimeReference,
)
from busflow.msgs.sensor_msgs.joystick import Joy, JoyFeedback, JoyFeedbackArray
from busflow.msgs.sensor_msgs.motion import Imu, JointState, MagneticField, MultiDOFJointState
from busflow.msgs.sensor_msgs.points import ChannelFloat32, PointCloud, PointCloud2, PointField
from busflow.msgs.sensor_msgs.power import BatteryState
from busflow.msgs.sensor_msgs.ranging import LaserEcho, LaserScan, MultiEchoLaserScan, Range
from busflow.msgs.sensor_msgs.satellite import NavSatFix, NavSatStatus

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
